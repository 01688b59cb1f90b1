"""Convergence criterion of a macro step, relative to an estimate of its interpolation error."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .hermite_interpolation import DerivativeChain, hermite_weights, scale_weights

Array = NDArray[np.float64]

# Values with two derivatives at both ends make a polynomial of degree five, close to that of a step.
MIN_CHAIN_LENGTH = 3
MAX_CACHED_STEP_SIZES = 64


class InterpolationErrorEstimate:
    """Difference at mid-step between outputs and the Hermite interpolant of their values and derivatives at the ends.

    For a chain of three that is ``h^6 / 46080`` times the sixth derivative, for the second derivative 24 of it over
    ``h^2``. ``nominal`` are the nominal values of all outputs.
    """

    def __init__(self, chains: Sequence[DerivativeChain], nominal: Array) -> None:
        midpoint_chains = [c for c in chains if c.midpoints is not None and len(c.ends) >= MIN_CHAIN_LENGTH]
        lengths = sorted({len(chain.ends) for chain in midpoint_chains})
        groups = [[chain for chain in midpoint_chains if len(chain.ends) == length] for length in lengths]
        self._groups = [
            (np.array([chain.ends for chain in group]).T, np.array([chain.midpoints for chain in group]).T)
            for group in groups
        ]
        self._nominals = [nominal[middles] for _, middles in self._groups]
        self._weights: dict[float, list[Array]] = {}

    def max_error(self, outputs_at_start: Array, outputs: Array, step: float) -> float:
        """The largest error of a ``step`` (s) from ``outputs_at_start`` to ``outputs``, relative to nominal values."""
        max_relative_error = 0.0
        for (ends, midpoints), nominals, weight in zip(
            self._groups, self._nominals, self._weights_for(step), strict=True
        ):
            errors = weight @ np.concatenate([outputs_at_start[ends], outputs[ends]]) - outputs[midpoints]
            max_relative_error = max(max_relative_error, float(np.abs(errors / nominals).max()))
        return max_relative_error

    def _weights_for(self, step: float) -> list[Array]:
        key = round(step, 12)
        if key not in self._weights:
            if len(self._weights) >= MAX_CACHED_STEP_SIZES:
                self._weights.clear()
            counts = [ends.shape[0] for ends, _ in self._groups]
            self._weights[key] = [
                scale_weights(hermite_weights((0.0, 1.0), count, (0.5,)), step).reshape(count, 2 * count)
                for count in counts
            ]
        return self._weights[key]


# From one step to the next of the same size, the allowed error hardly ever grows more than this many times.
MAX_TOLERANCE_GROWTH = 100.0
# Equal steps differ by the rounding of their times.
STEP_SIZE_RTOL = 1e-6


class ConvergenceCriterion:
    """Convergence criterion: the iteration error against a tolerance or a share of the interpolation error.

    ``tolerance`` is the convergence tolerance, relative to nominal values; with an ``interpolation_error_share`` of
    zero it alone decides.

    The interpolation error is not evaluated where the iteration error is far above what the step before was allowed,
    unless no iteration is left. Iterating further is not worth while: the step itself has the interpolation error.
    """

    def __init__(
        self, interpolation_error: InterpolationErrorEstimate, tolerance: float, interpolation_error_share: float
    ) -> None:
        self._interpolation_error = interpolation_error
        self._tolerance = tolerance
        self._interpolation_error_share = interpolation_error_share
        self.reset()

    def reset(self) -> None:
        """Drop the allowed error of the step before."""
        self._step_size, self._allowed_error = 0.0, np.inf

    def is_unconverged(
        self,
        error: float,
        outputs_at_start: Array,
        outputs: Array,
        step: float,
        is_last_iteration: bool = False,
    ) -> bool:
        """Whether ``error`` exceeds what a ``step`` (s) from ``outputs_at_start`` to ``outputs`` may have.

        ``error`` is relative to nominal values; with ``is_last_iteration`` none is left.
        """
        if not self._interpolation_error_share or error <= self._tolerance:
            return error > self._tolerance
        if (
            not is_last_iteration
            and abs(step - self._step_size) <= STEP_SIZE_RTOL * step
            and error > MAX_TOLERANCE_GROWTH * self._allowed_error
        ):
            return True
        self._step_size = step
        self._allowed_error = max(
            self._tolerance,
            self._interpolation_error_share * self._interpolation_error.max_error(outputs_at_start, outputs, step),
        )
        return error > self._allowed_error
