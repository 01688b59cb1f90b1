"""Multisine path of the platform, from rest to rest."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import Point

Array = NDArray[np.float64]

# Share of the duration in which the sines fade in, and in which they fade out.
RISE_RATIO = 0.15


@dataclass(frozen=True)
class MultisinePath:
    """Multisine path ``p = start + w(t) sum_k a_k sin(2 pi f_k t)``.

    The window ``w`` rises from 0 to 1 and falls back by the fifth-order law.

    ``amplitudes`` are (k, 3) in m, ``frequencies`` (k, 3) in Hz, ``start`` in m, ``duration`` in s.
    """

    start: Point
    duration: float
    amplitudes: tuple[tuple[float, float, float], ...]
    frequencies: tuple[tuple[float, float, float], ...]

    def scaled(self, factor: float) -> MultisinePath:
        """The path with all amplitudes times a factor."""
        rows = np.array(self.amplitudes) * factor
        return replace(self, amplitudes=tuple((float(x), float(y), float(z)) for x, y, z in rows))

    def position(self, times: Array) -> Array:
        """Position of the platform, (N, 3) in m."""
        window, _, _ = self._window(times)
        return np.array(self.start) + window[:, None] * self._sines(times, 0)

    def velocity(self, times: Array) -> Array:
        """Velocity of the platform, (N, 3) in m/s."""
        window, slope, _ = self._window(times)
        return window[:, None] * self._sines(times, 1) + slope[:, None] * self._sines(times, 0)

    def acceleration(self, times: Array) -> Array:
        """Acceleration of the platform, (N, 3) in m/s^2."""
        window, slope, curvature = (column[:, None] for column in self._window(times))
        return window * self._sines(times, 2) + 2.0 * slope * self._sines(times, 1) + curvature * self._sines(times, 0)

    @cached_property
    def _terms(self) -> tuple[Array, Array]:
        return np.array(self.amplitudes), 2.0 * np.pi * np.array(self.frequencies)

    def _sines(self, times: Array, order: int) -> Array:
        """The sum of the sines, or its derivative of first or second order."""
        amplitudes, angular_frequency = self._terms
        phase = np.asarray(times, dtype=float)[:, None, None] * angular_frequency + 0.5 * np.pi * order
        total: Array = np.sum(amplitudes * angular_frequency**order * np.sin(phase), axis=1)
        return total

    def _window(self, times: Array) -> tuple[Array, Array, Array]:
        rise = RISE_RATIO * self.duration
        begin, end = (np.asarray(times, dtype=float) / rise, (self.duration - np.asarray(times, dtype=float)) / rise)
        progress = np.clip(np.minimum(begin, end), 0.0, 1.0)
        sign = np.where(begin <= end, 1.0, -1.0) / rise
        value = progress**3 * (10.0 - 15.0 * progress + 6.0 * progress**2)
        slope = 30.0 * progress**2 * (1.0 - progress) ** 2 * sign
        curvature = 60.0 * progress * (1.0 - 3.0 * progress + 2.0 * progress**2) * sign**2
        return value, slope, curvature
