"""Winch programs: the true rope speed that each winch is driven at, positive reels in."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from tests.rig.robot import Vector


class Program(Protocol):
    """Speed of every winch over time, with the instants at which it is not smooth."""

    @property
    def kinks(self) -> Sequence[float]:
        """Where integration has to restart, s."""

    def speed(self, time: float) -> Vector:
        """V_i, m/s."""

    def travel(self, time: float) -> Vector:
        """Integral of V_i since the start, m."""


@dataclass(frozen=True)
class StillProgram:
    """Winches that hold."""

    count: int
    kinks: tuple[float, ...] = ()

    def speed(self, time: float) -> Vector:
        """Nothing."""
        return np.zeros(self.count)

    def travel(self, time: float) -> Vector:
        """Nothing."""
        return np.zeros(self.count)


@dataclass(frozen=True)
class RampProgram:
    """V_i = a_i t until |V_i| = peak, then held; what the paper calls a trapezoid."""

    accelerations: Vector
    peak: float

    @property
    def kinks(self) -> Sequence[float]:
        """Where a ramp meets its hold."""
        moving = np.abs(self.accelerations[self.accelerations != 0])
        return [float(time) for time in np.unique(self.peak / moving)]

    def speed(self, time: float) -> Vector:
        """The ramp, cut at the peak."""
        return np.clip(np.asarray(self.accelerations) * time, -self.peak, self.peak)

    def travel(self, time: float) -> Vector:
        """V^2/(2 a) on the ramp, then V per second."""
        acceleration = np.asarray(self.accelerations, float)
        top = np.divide(
            self.peak, np.abs(acceleration), out=np.full(acceleration.shape, np.inf), where=acceleration != 0
        )
        ramped = np.minimum(time, top)
        held = np.sign(acceleration) * self.peak * (time - ramped)
        return 0.5 * acceleration * ramped**2 + held


@dataclass(frozen=True)
class SampledProgram:
    """Speeds linear between samples; times (m), speeds (m, n)."""

    times: Vector
    speeds: Vector

    @property
    def kinks(self) -> Sequence[float]:
        """Every sample."""
        return [float(time) for time in self.times]

    def speed(self, time: float) -> Vector:
        """The straight line between two samples."""
        left, share = self._find(time)
        return self.speeds[left] + share * (self.speeds[left + 1] - self.speeds[left])

    def travel(self, time: float) -> Vector:
        """Trapezes up to the last sample, and the part of one after it."""
        left, share = self._find(time)
        elapsed = share * (self._instants[left + 1] - self._instants[left])
        return self._travelled[left] + 0.5 * elapsed * (self.speeds[left] + self.speed(time))

    def _find(self, time: float) -> tuple[int, float]:
        left = min(max(bisect_right(self._instants, time) - 1, 0), len(self._instants) - 2)
        return left, (time - self._instants[left]) / (self._instants[left + 1] - self._instants[left])

    @cached_property
    def _instants(self) -> list[float]:
        return [float(time) for time in self.times]

    @cached_property
    def _travelled(self) -> Vector:
        steps = np.diff(self.times)[:, None] * 0.5 * (self.speeds[1:] + self.speeds[:-1])
        return np.vstack([np.zeros(self.speeds.shape[1]), np.cumsum(steps, axis=0)])


@dataclass(frozen=True)
class PathProgram:
    """Winches that would lead stiff ropes along p(t) = start + s(t) (shift + sum_k a_k sin(w_k t + f_k)).

    s rises smoothly from 0 to 1 (two derivatives vanish at both ends) over `rise` seconds, so V(0) = 0.
    """

    anchors: Vector
    start: Vector
    shift: Vector
    amplitudes: Vector  # (tones, 3), m
    angular: Vector  # (tones), rad/s
    phases: Vector  # (tones, 3), rad
    rise: float

    @property
    def kinks(self) -> Sequence[float]:
        """The end of the rise."""
        return (self.rise,)

    def path(self, time: float) -> tuple[Vector, Vector]:
        """Planned position and velocity."""
        share, share_rate = smooth_rise(time, self.rise)
        angles = self.angular[:, None] * time + self.phases
        offset = self.shift + (self.amplitudes * np.sin(angles)).sum(axis=0)
        offset_rate = (self.amplitudes * self.angular[:, None] * np.cos(angles)).sum(axis=0)
        return self.start + share * offset, share_rate * offset + share * offset_rate

    def speed(self, time: float) -> Vector:
        """Minus the rate of the planned rope lengths."""
        position, velocity = self.path(time)
        span = self.anchors - position
        return (span @ velocity) / np.sqrt(np.einsum("ij,ij->i", span, span))

    def travel(self, time: float) -> Vector:
        """Start length minus the planned length."""
        planned = np.linalg.norm(self.anchors - self.path(time)[0], axis=1)
        return np.linalg.norm(self.anchors - self.start, axis=1) - planned


def smooth_rise(time: float, rise: float) -> tuple[float, float]:
    """What rises from 0 to 1 within `rise` seconds, two derivatives vanishing at both ends, and its rate."""
    if time >= rise:
        return 1.0, 0.0
    part = time / rise
    share = part**3 * (10.0 - 15.0 * part + 6.0 * part**2)
    return share, 30.0 * part**2 * (1.0 - part) ** 2 / rise
