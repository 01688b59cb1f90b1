"""Convergence criterion of the iterations within a macro step."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .bends import InterpolationErrorEstimate

Array = NDArray[np.float64]

# From one step to the next of the same size, the allowed error hardly ever grows more than this many times.
MAX_TOLERANCE_GROWTH = 100.0
# Equal steps differ by the rounding of their times.
STEP_SIZE_RTOL = 1e-6


class ConvergenceCriterion:
    """Convergence criterion: the iteration error against a tolerance or a share of the interpolation error.

    The interpolation error is not evaluated where the iteration error is far above what the step before was allowed,
    unless no iteration is left. Iterating further is not worth while: the step itself has the interpolation error.
    """

    def __init__(self, interpolation_error: InterpolationErrorEstimate) -> None:
        self._interpolation_error = interpolation_error
        self.reset()

    def reset(self) -> None:
        """Drop the allowed error of the step before."""
        self._step_size, self._allowed_error = 0.0, np.inf

    def is_unconverged(
        self,
        error: float,
        tolerance: float,
        interpolation_error_share: float,
        outputs_at_start: Array,
        outputs: Array,
        step: float,
        is_last_iteration: bool = False,
    ) -> bool:
        """Whether ``error`` exceeds what a ``step`` (s) from ``outputs_at_start`` to ``outputs`` may have.

        ``error`` and ``tolerance`` are relative to nominal values; with ``is_last_iteration`` none is left.
        """
        if not interpolation_error_share or error <= tolerance:
            return error > tolerance
        if (
            not is_last_iteration
            and abs(step - self._step_size) <= STEP_SIZE_RTOL * step
            and error > MAX_TOLERANCE_GROWTH * self._allowed_error
        ):
            return True
        self._step_size = step
        self._allowed_error = max(
            tolerance, interpolation_error_share * self._interpolation_error.max_error(outputs_at_start, outputs, step)
        )
        return error > self._allowed_error
