"""Extrapolation of outputs, and estimation of their derivatives, from past communication points.

An output is extrapolated by the Hermite polynomial through its values and derivatives at the last communication points.
How many of these do best shows at the end of the step. The error of the longest polynomial oscillates as the system
does, so it is extrapolated too, by linear prediction:

    e_n = c_1 e_(n-1) + c_2 e_(n-2),   c by least squares over the last steps, the same for all outputs

Source of the latter: Makhoul (1975), Linear prediction: a tutorial review, Proceedings of the IEEE 63(4), 561-580.

The derivative now is that of the polynomial through the value now and those at the last communication points:

    y'(t) = sum over j of w_j y(t_j),   w_j the derivative, at t, of the Lagrange polynomial that is one at t_j

With k points before the present one, h apart, its error is h^k y^(k+1) / (k + 1). The difference to the estimate
with one point fewer is about the error of the latter.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .hermite_interpolation import DerivativeChain, Indices, hermite_weights, scale_weights

Array = NDArray[np.float64]
Past = tuple[tuple[float, Array], ...]

MAX_POINTS, MAX_PAST_POINTS = 3, 4
MIN_ERRORS, MAX_ERRORS = 3, 8
RELATIVE_DAMPING, ABSOLUTE_DAMPING = 1e-10, 1e-100
# Where even the best candidate is this many times worse than a step before, outputs have a corner.
CORNER_ERROR_RATIO, NEGLIGIBLE_ERROR = 10.0, 1e-9
# Farther than this many point distances, a polynomial extrapolates mostly the errors of its points.
MAX_EXTRAPOLATION_RATIO = 5.0
MAX_CACHED_STEP_SIZES = 64


class ExtrapolationHistory(NamedTuple):
    """Extrapolation history: the ``past`` points, oldest first, and the ``errors`` of the longest polynomial.

    Errors have a row for each of the last steps, the newest first; None right after a corner. Of the past points,
    ``smooth_points`` lie after the last corner. ``best_candidate`` did best in the last step, with ``best_error``.
    """

    past: Past
    smooth_points: int = 1
    best_candidate: int = 0
    best_error: float = np.inf
    errors: Array | None = None


def restart_history(time: float, outputs: Array) -> ExtrapolationHistory:
    """The history of outputs that are known at ``time`` only."""
    return ExtrapolationHistory(((time, outputs.copy()),))


class Extrapolator:
    """Extrapolates the outputs at ``indices``; ``nominals`` (number of indices,) are their nominal values.

    ``chains`` tell which outputs are derivatives of which.
    """

    def __init__(self, chains: Sequence[DerivativeChain], indices: Indices, nominals: Array) -> None:
        lengths = sorted({len(chain.ends) for chain in chains})
        self._groups = [[chain for chain in chains if len(chain.ends) == length] for length in lengths]
        self._ends = [np.array([chain.ends for chain in group]).T for group in self._groups]
        target_indices = [index for group in self._groups for index in _target_indices(group)]
        self._target_order = np.array([target_indices.index(index) for index in indices], dtype=np.intp)
        self._indices = indices
        self._nominals = nominals
        self._weights: dict[tuple[float, ...], list[Array]] = {}
        # Of the step that was last begun, for its end to rate.
        self._candidates: Array = np.zeros((1, len(indices)))

    def begin_step(self, history: ExtrapolationHistory, time: float, outputs: Array) -> ExtrapolationHistory:
        """Begin a step that ends at ``time``: set ``outputs`` to their extrapolation; returns the history used."""
        if not len(self._indices):
            return history
        history = _drop_close_points(history, time)
        points = history.past[-min(history.smooth_points, MAX_POINTS) :]
        values = np.array([value for _, value in points])
        weights = self._weights_for([point_time for point_time, _ in points], time)
        values_by_length = [
            (weight @ values.take(ends, axis=1).reshape(-1, ends.shape[1])).reshape(len(points), -1)
            for ends, weight in zip(self._ends, weights, strict=True)
        ]
        self._candidates = np.concatenate(values_by_length, axis=1).take(self._target_order, axis=1)
        if history.errors is not None and len(history.errors) >= MIN_ERRORS:
            corrected = self._candidates[-1] + _predict_error(history.errors) * self._nominals
            self._candidates = np.concatenate([self._candidates, corrected[None, :]])
        outputs[self._indices] = self._candidates[min(history.best_candidate, len(self._candidates) - 1)]
        return history

    def end_step(self, history: ExtrapolationHistory, time: float, outputs: Array) -> ExtrapolationHistory:
        """The history with the outputs at ``time``, the end of the step, which rate the candidates."""
        past = (*history.past[1 - MAX_PAST_POINTS :], (time, outputs.copy()))
        if not len(self._indices):
            return history._replace(past=past)
        errors = (outputs[self._indices] - self._candidates) / self._nominals
        max_errors = np.abs(errors).max(axis=1)
        best_candidate, best_error = int(max_errors.argmin()), float(max_errors.min())
        points = min(history.smooth_points, MAX_POINTS)
        if best_error > CORNER_ERROR_RATIO * max(history.best_error, NEGLIGIBLE_ERROR):
            # Beginning and end of this step are taken to lie on the same side of the corner.
            return ExtrapolationHistory(past, smooth_points=2, best_candidate=1, best_error=best_error)
        if points < MAX_POINTS:
            # From now on there is one point more, which is tried where all points were of use.
            return ExtrapolationHistory(past, points + 1, best_candidate + (best_candidate == points - 1), best_error)
        kept_errors = errors[MAX_POINTS - 1 : MAX_POINTS]
        if history.errors is not None:
            kept_errors = np.concatenate([kept_errors, history.errors[: MAX_ERRORS - 1]])
        return ExtrapolationHistory(past, points, best_candidate, best_error, kept_errors)

    def _weights_for(self, times: Sequence[float], end: float) -> list[Array]:
        """Weights of the past points in all candidates at a step's midpoint and end, for chains of each length."""
        step = end - times[-1]
        # Equal steps differ by the rounding of their times.
        key = (round(step, 12), *(round((time - times[-1]) / step, 9) for time in times))
        if key not in self._weights:
            if len(self._weights) >= MAX_CACHED_STEP_SIZES:
                self._weights.clear()
            self._weights[key] = [_candidate_weights(key[1:], ends.shape[0], step) for ends in self._ends]
        return self._weights[key]


def _drop_close_points(history: ExtrapolationHistory, time: float) -> ExtrapolationHistory:
    """The history without points that are too close together to extrapolate to ``time``."""
    times = [at for at, _ in history.past[-min(history.smooth_points, MAX_POINTS) :]]
    min_distance = (time - times[-1]) / MAX_EXTRAPOLATION_RATIO
    usable_points = 1
    while usable_points < len(times) and times[-usable_points] - times[-usable_points - 1] >= min_distance:
        usable_points += 1
    if usable_points == len(times):
        return history
    return history._replace(
        smooth_points=usable_points, best_candidate=min(history.best_candidate, usable_points - 1), errors=None
    )


def _target_indices(group: Sequence[DerivativeChain]) -> list[int]:
    """Output indices of a group of chains: first at the midpoint, then at the end, derivative after derivative."""
    length = len(group[0].ends)
    midpoints = [-1 if chain.midpoints is None else chain.midpoints[k] for k in range(length) for chain in group]
    return [*midpoints, *(chain.ends[k] for k in range(length) for chain in group)]


def _candidate_weights(times: tuple[float, ...], count: int, step: float) -> Array:
    """Weights of the polynomials through the last point, the last two ..., stacked; ``times`` in steps."""
    points = len(times)
    weights = np.zeros((points, 2, count, points, count))
    for used in range(1, points + 1):
        weights[used - 1, :, :, points - used :] = scale_weights(
            hermite_weights(times[points - used :], count, (0.5, 1.0)), step
        )
    return weights.reshape(points * 2 * count, points * count)


def _predict_error(errors: Array) -> Array:
    """Linear prediction of the error that follows ``errors`` (N, n), the newest first."""
    targets, last, before_last = errors[:-2].ravel(), errors[1:-1].ravel(), errors[2:].ravel()
    square, product, other = last @ last, last @ before_last, before_last @ before_last
    damped = RELATIVE_DAMPING * (square + other) + ABSOLUTE_DAMPING
    square, other = square + damped, other + damped
    first, second = last @ targets, before_last @ targets
    predicted: Array = (
        (first * other - second * product) * errors[0] + (second * square - first * product) * errors[1]
    ) / (square * other - product * product)
    return predicted


def derivative_weights(times: Sequence[float]) -> Array:
    """The weights of values at ``times`` (s, all different) in the derivative at the last one, in 1/s; shape (N,)."""
    *earlier, now = times
    weights = np.zeros(len(times))
    for index, time in enumerate(earlier):
        weight = 1.0 / (time - now)
        for other in earlier[:index] + earlier[index + 1 :]:
            weight *= (now - other) / (time - other)
        weights[index] = weight
    weights[-1] = -np.sum(weights[:-1])
    return weights


class DerivativeEstimator:
    """Estimates the outputs at ``derivative_indices`` as derivatives of those at ``value_indices``, one for each."""

    def __init__(self, value_indices: Indices, derivative_indices: Indices) -> None:
        self._value_indices = value_indices
        self._derivative_indices = derivative_indices
        self._past_sum = self._coarse_past_sum = np.zeros(len(value_indices))
        self._present_weight = self._coarse_present_weight = 0.0

    @property
    def count(self) -> int:
        """Number of estimated derivatives."""
        return len(self._derivative_indices)

    def begin_step(self, past: Past, time: float) -> None:
        """Begin a step that ends at ``time``; ``past`` holds the outputs at earlier communication points."""
        if not self.count:
            return
        self._past_sum, self._present_weight = self._weighted_past(past, time)
        # With a single earlier point there is no coarser estimate to compare with.
        self._coarse_past_sum, self._coarse_present_weight = self._weighted_past(past[1:] or past, time)

    def fill(self, outputs: Array) -> None:
        """Set the derivatives that belong to the present values."""
        if self.count:
            outputs[self._derivative_indices] = self._past_sum + self._present_weight * outputs[self._value_indices]

    def error_estimates(self, outputs: Array) -> Array:
        """Error estimate of each derivative: its difference to the estimate with one point fewer."""
        errors: Array = np.abs(
            outputs[self._derivative_indices]
            - self._coarse_past_sum
            - self._coarse_present_weight * outputs[self._value_indices]
        )
        return errors

    def _weighted_past(self, past: Past, time: float) -> tuple[Array, float]:
        weights = derivative_weights([at for at, _ in past] + [time])
        past_sum = sum(
            (weight * values[self._value_indices] for weight, (_, values) in zip(weights, past, strict=False)), 0.0
        )
        return np.broadcast_to(past_sum, self._value_indices.shape), float(weights[-1])
