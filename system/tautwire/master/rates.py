"""Estimation of output derivatives that an FMU does not provide, from its past outputs.

The derivative now is that of the polynomial through the value now and those at the last communication points:

    y'(t) = sum over j of w_j y(t_j),   w_j the derivative, at t, of the Lagrange polynomial that is one at t_j

With k points before the present one, h apart, its error is h^k y^(k+1) / (k + 1). The difference to the estimate
with one point fewer is about the error of the latter.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IndexArray = NDArray[np.intp]
PastOutputs = Sequence[tuple[float, Array]]


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

    def __init__(self, value_indices: IndexArray, derivative_indices: IndexArray) -> None:
        self._value_indices = value_indices
        self._derivative_indices = derivative_indices
        self._past_sum = self._coarse_past_sum = np.zeros(len(value_indices))
        self._present_weight = self._coarse_present_weight = 0.0

    @property
    def count(self) -> int:
        """Number of estimated derivatives."""
        return len(self._derivative_indices)

    def begin_step(self, past: PastOutputs, time: float) -> None:
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

    def _weighted_past(self, past: PastOutputs, time: float) -> tuple[Array, float]:
        weights = derivative_weights([at for at, _ in past] + [time])
        past_sum = sum(
            (weight * values[self._value_indices] for weight, (_, values) in zip(weights, past, strict=False)), 0.0
        )
        return np.broadcast_to(past_sum, self._value_indices.shape), float(weights[-1])
