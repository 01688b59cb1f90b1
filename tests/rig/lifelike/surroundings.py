"""What acts on every robot a little: wind and ropes that tremble, a frame that sways, belts, ropes that warm up."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.rig.effect import Effect, Moment
from tests.rig.robot import Vector


@dataclass(kw_only=True)
class Trembling(Effect):
    """A random force on the platform, random tensions and a frame that sways, from tables with one row per half step.

    `force` (rows, 3) in N, `tension` (rows, n) in N, `sway` of all exit points and its rate (rows, 3) in m and m/s,
    the ropes' free strain and its rate (rows, n), and on a platform that turns `torque` (rows, 3) in N m.
    """

    half_step: float
    force: Vector
    tension: Vector
    sway: Vector
    sway_rate: Vector
    growth: Vector
    growth_rate: Vector
    torque: Vector | None = None

    def _row(self, time: float) -> int:
        return round(time / self.half_step)

    def exits(self, moment: Moment) -> None:
        """Sway."""
        row = self._row(moment.time)
        moment.exits = moment.exits + self.sway[row]
        moment.exit_velocity = moment.exit_velocity + self.sway_rate[row]

    def strains(self, moment: Moment) -> None:
        """Let ropes grow."""
        row = self._row(moment.time)
        moment.strain = moment.strain - self.growth[row]
        moment.free_rate = moment.free_rate + self.growth_rate[row]

    def viscous(self, moment: Moment) -> None:
        """Let ropes tremble."""
        moment.tension = moment.tension + self.tension[self._row(moment.time)]

    def load(self, moment: Moment) -> None:
        """Push the platform."""
        if moment.time > 0.0:
            moment.force = moment.force + self.force[self._row(moment.time)]
            if self.torque is not None:
                moment.torque = moment.torque + self.torque[self._row(moment.time)]


@dataclass(kw_only=True)
class Belt(Effect):
    """An elastic belt between motor and drum: the drum lags by y, dy/dt = ((T - T0)/k - y)/tau.

    k `stiffness_constant` in N/m of rope, tau `time` in s.
    """

    stiffness_constant: float
    time: float = 0.05

    def size(self) -> int:
        """The lag of each drum, m."""
        return self.rig.robot.count

    def winding(self, moment: Moment) -> None:
        """Turn what the motor does into rope speed."""
        lag = moment.state[self.part]
        rate = ((moment.tension - self.rig.start_tension) / self.stiffness_constant - lag) / self.time
        moment.rates[self.part] = rate
        moment.speed = moment.speed - rate


def played(travel: Vector, gap: float) -> Vector:
    """Travel of a drum behind a backlash: it follows the motor only where the gap (m of rope) is used up."""
    result = np.empty_like(travel)
    follower = travel[0].copy()
    for row, motor in enumerate(travel):
        follower = np.clip(follower, motor - 0.5 * gap, motor + 0.5 * gap)
        result[row] = follower
    return result
