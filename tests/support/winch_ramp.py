"""The paper's ramp as a path: the place to which winches take inelastic cables, for robots with three."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tautwire.robot.schema import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True)
class WinchRamp:
    """Winches that speed up at ``rates`` (m/s^2) until ``limit`` (m/s) and go on so; not meant beyond ``duration`` (s).

    Baklouti et al. 2017, section 4.2. The path's acceleration jumps where a winch ends its ramp.
    """

    robot: Robot
    duration: float
    rates: tuple[float, float, float] = (0.3, 0.25, -0.25)
    limit: float = 1.0

    def speeds(self, times: Array) -> Array:
        """Of the winches, (N, 3) in m/s."""
        return np.clip(np.outer(np.maximum(times, 0.0), self.rates), -self.limit, self.limit)

    def position(self, times: Array) -> Array:
        """Where the three spheres around the exit points meet, the lower of the two places, (N, 3) in m."""
        anchors = np.array(self.robot.anchors)
        lengths = np.linalg.norm(anchors - self.robot.platform.start, axis=1) - self._wound(times)
        apart = anchors[1:] - anchors[0]
        across = np.cross(*apart)
        across *= -np.sign(across[2]) / np.linalg.norm(across)
        squares = 0.5 * (lengths[:, :1] ** 2 - lengths[:, 1:] ** 2 + np.sum(apart**2, axis=1))
        foot = np.linalg.solve(np.vstack([apart, across]), np.column_stack([squares, np.zeros(len(squares))]).T).T
        depth = np.sqrt(lengths[:, 0] ** 2 - np.sum(foot**2, axis=1))
        return anchors[0] + foot + np.outer(depth, across)

    def velocity(self, times: Array) -> Array:
        """The rate of position, (N, 3) in m/s: ``u_i . v = V_i``."""
        unit = self._unit_vectors(self.position(times))
        return _solved(unit, self.speeds(times))

    def acceleration(self, times: Array) -> Array:
        """The rate of velocity, (N, 3) in m/s^2: ``u_i . a = dV_i/dt + (v . v - (u_i . v)^2) / l_i``."""
        position, velocity = self.position(times), self.velocity(times)
        lengths = np.linalg.norm(np.array(self.robot.anchors) - position[:, None], axis=2)
        turned = (np.sum(velocity**2, axis=1)[:, None] - self.speeds(times) ** 2) / lengths
        rising = (times[:, None] >= 0.0) & (times[:, None] < self.limit / np.abs(self.rates))
        return _solved(self._unit_vectors(position), np.where(rising, self.rates, 0.0) + turned)

    def _unit_vectors(self, position: Array) -> Array:
        """Along the cables to the exit points, (N, 3, 3)."""
        spans = np.array(self.robot.anchors).T - position[:, :, None]
        return np.asarray(spans / np.linalg.norm(spans, axis=1, keepdims=True))

    def _wound(self, times: Array) -> Array:
        """Rope reeled in, (N, 3) in m."""
        rates = np.abs(self.rates)
        now = np.maximum(times, 0.0)[:, None]
        within = np.minimum(now, self.limit / rates)
        return np.sign(self.rates) * (0.5 * rates * within**2 + self.limit * (now - within))


def _solved(unit: Array, along: Array) -> Array:
    """Vectors (N, 3) with given parts along the cables."""
    return np.linalg.solve(np.swapaxes(unit, 1, 2), along[:, :, None])[:, :, 0]
