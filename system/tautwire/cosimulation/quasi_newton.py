"""Quasi-Newton acceleration of the fixed-point iteration within a macro step."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MAX_STEP_SIZES = 4
STEP_SIZE_RTOL = 0.1
MIN_RESIDUAL_CHANGE = 1e-12
MIN_INDEPENDENT_SHARE = 1e-3
# Decay of the remembered contraction rate from one iteration to the next.
CONTRACTION_RATE_DECAY = 0.8


class QuasiNewton:
    """Multi-vector quasi-Newton method for the fixed-point equation ``z = F(z)`` of the tear variables.

    A Gauss-Seidel sweep maps ``z`` to ``F(z)``; with the residual ``r = F(z) - z`` the next iterate is

        z' = F(z) - A r,   A dr = dF for any two sweeps of a step

    The inverse Jacobian ``A`` is kept from step to step, since the coupling changes slowly, and takes the smallest
    update that the newest sweeps ask for; :meth:`reset` drops it where the coupling jumps. All vectors are in units of
    their nominal values.

    Source: Bogaers, Kok, Reddy and Franz (2014), Quasi-Newton methods for implicit black-box FSI coupling, Computer
    Methods in Applied Mechanics and Engineering 279, 113-132.
    """

    def __init__(self, count: int) -> None:
        self._inverse_jacobian = np.zeros((count, count))
        self._residual_directions: list[Array] = []
        self._last_iterate: tuple[Array, Array, float] | None = None
        self._correction = np.zeros(count)
        self._contraction_rate = 1.0

    def begin_step(self) -> None:
        """Start a new step: its first sweep is not compared with the last step's."""
        self._last_iterate = None
        self._residual_directions = []

    def reset(self) -> None:
        """Drop the inverse Jacobian and the contraction rate."""
        self._inverse_jacobian.fill(0.0)
        self._residual_directions = []
        self._contraction_rate = 1.0

    def update(self, x: Array, fx: Array) -> None:
        """Update the inverse Jacobian from one sweep, which maps ``x`` to ``fx``."""
        residual = fx - x
        residual_norm = float(np.abs(residual).max(initial=0.0))
        if self._last_iterate is not None:
            previous_residual, previous_fx, previous_norm = self._last_iterate
            if residual_norm > previous_norm:
                self.reset()
            if previous_norm > MIN_RESIDUAL_CHANGE:
                self._contraction_rate = min(
                    1.0, max(residual_norm / previous_norm, CONTRACTION_RATE_DECAY * self._contraction_rate)
                )
            self._rank_one_update(residual - previous_residual, fx - previous_fx)
        self._last_iterate = residual, fx, residual_norm
        self._correction = self._inverse_jacobian @ residual

    def _rank_one_update(self, residual_change: Array, output_change: Array) -> None:
        """Rank-one update: exact for this change, unchanged orthogonally to it and to this step's others."""
        orthogonal_change = residual_change.copy()
        for direction in self._residual_directions:
            orthogonal_change -= (direction @ orthogonal_change) * direction
        norm = float(np.sqrt(orthogonal_change @ orthogonal_change))
        if norm > max(MIN_RESIDUAL_CHANGE, MIN_INDEPENDENT_SHARE * float(np.sqrt(residual_change @ residual_change))):
            orthogonal_change /= norm
            self._inverse_jacobian += np.outer(
                (output_change - self._inverse_jacobian @ residual_change) / (orthogonal_change @ residual_change),
                orthogonal_change,
            )
            self._residual_directions.append(orthogonal_change)

    def error_estimate(self) -> float:
        """Error estimate of the last sweep: the next correction plus the contraction rate times the residual."""
        assert self._last_iterate is not None
        return float(np.abs(self._correction).max(initial=0.0)) + self._contraction_rate * self._last_iterate[2]

    def next_input(self) -> Array:
        """The iterate for the next sweep."""
        assert self._last_iterate is not None
        next_iterate: Array = self._last_iterate[1] - self._correction
        return next_iterate


class QuasiNewtonHistory:
    """Quasi-Newton history per step size, since the coupling depends on it; kept for the last few step sizes."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._by_step_size: deque[tuple[float, QuasiNewton]] = deque(maxlen=MAX_STEP_SIZES)

    def for_step_size(self, step: float) -> QuasiNewton:
        """The quasi-Newton method of steps of nearly this size; a new one where there were none."""
        for step_size, quasi_newton in self._by_step_size:
            if abs(step - step_size) <= STEP_SIZE_RTOL * step_size:
                return quasi_newton
        self._by_step_size.appendleft((step, QuasiNewton(self._count)))
        return self._by_step_size[0][1]

    def reset(self) -> None:
        """Drop the history of all step sizes."""
        self._by_step_size.clear()
