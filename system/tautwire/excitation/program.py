"""A path of the platform made of sines, from rest to rest."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..robots.robot import Point

Array = NDArray[np.float64]

# Part of the duration in which the sines grow, and in which they die.
RISE = 0.15


@dataclass(frozen=True)
class MultisinePath:
    """``p = start + w(t) sum_k a_k sin(2 pi f_k t)``, with ``w`` rising from 0 to 1 and back by the fifth-order law.

    ``amplitudes`` are (k, 3) in m, ``frequencies`` (k, 3) in Hz, ``start`` in m, ``duration`` in s.
    """

    start: Point
    duration: float
    amplitudes: tuple[tuple[float, float, float], ...]
    frequencies: tuple[tuple[float, float, float], ...]

    def scaled(self, factor: float) -> MultisinePath:
        """The same with all amplitudes times a factor."""
        rows = np.array(self.amplitudes) * factor
        return replace(self, amplitudes=tuple((float(x), float(y), float(z)) for x, y, z in rows))

    def position(self, times: Array) -> Array:
        """Where the platform shall be, (N, 3) in m."""
        window, _, _ = self._window(times)
        return np.array(self.start) + window[:, None] * self._sines(times, 0)

    def velocity(self, times: Array) -> Array:
        """The rate of position, (N, 3) in m/s."""
        window, slope, _ = self._window(times)
        return window[:, None] * self._sines(times, 1) + slope[:, None] * self._sines(times, 0)

    def acceleration(self, times: Array) -> Array:
        """The rate of velocity, (N, 3) in m/s^2."""
        window, slope, bend = (column[:, None] for column in self._window(times))
        return window * self._sines(times, 2) + 2.0 * slope * self._sines(times, 1) + bend * self._sines(times, 0)

    @cached_property
    def _terms(self) -> tuple[Array, Array]:
        return np.array(self.amplitudes), 2.0 * np.pi * np.array(self.frequencies)

    def _sines(self, times: Array, order: int) -> Array:
        """The sum of the sines, or its derivative of first or second order."""
        amplitudes, pace = self._terms
        phase = np.asarray(times, dtype=float)[:, None, None] * pace + 0.5 * np.pi * order
        total: Array = np.sum(amplitudes * pace**order * np.sin(phase), axis=1)
        return total

    def _window(self, times: Array) -> tuple[Array, Array, Array]:
        rise = RISE * self.duration
        begin, end = (np.asarray(times, dtype=float) / rise, (self.duration - np.asarray(times, dtype=float)) / rise)
        nearer = np.clip(np.minimum(begin, end), 0.0, 1.0)
        sign = np.where(begin <= end, 1.0, -1.0) / rise
        value = nearer**3 * (10.0 - 15.0 * nearer + 6.0 * nearer**2)
        slope = 30.0 * nearer**2 * (1.0 - nearer) ** 2 * sign
        bend = 60.0 * nearer * (1.0 - 3.0 * nearer + 2.0 * nearer**2) * sign**2
        return value, slope, bend
