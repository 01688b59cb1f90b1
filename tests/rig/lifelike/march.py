"""Integration in fixed steps between tabulated inputs: fast enough for many long recordings.

Classical Runge-Kutta of fourth order. With w the highest natural frequency and h the step, a free oscillation loses
(w h)^6/144 of its amplitude in a step; `steps_for` keeps w h below 0.3, so that damping ratios err by less than 2e-5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.rig.effect import Moment
from tests.rig.mechanics import Rig
from tests.rig.modes import frequencies_of
from tests.rig.robot import Robot, Vector

MOST_TURN = 0.3


@dataclass(frozen=True)
class TabulatedProgram:
    """Winch speeds (m/s) and travel (m) at every half step, shape (2 steps + 1, n); asked at these instants only."""

    half_step: float
    speeds: Vector
    travels: Vector
    kinks: tuple[float, ...] = ()

    def speed(self, time: float) -> Vector:
        """What the table says."""
        return np.asarray(self.speeds[round(time / self.half_step)], float)

    def travel(self, time: float) -> Vector:
        """What the table says."""
        return np.asarray(self.travels[round(time / self.half_step)], float)


def steps_for(robot: Robot, interval: float) -> int:
    """Steps between two samples."""
    highest = 2.0 * np.pi * float(frequencies_of(robot).max())
    return max(1, int(np.ceil(highest * interval / MOST_TURN)))


def march(rig: Rig, step: float, count: int) -> tuple[Vector, Vector, Vector | None]:
    """Load cells (count + 1, n) in N and positions (count + 1, 3) in m after each step, from rest at 0.

    Of a platform that turns also its rotation matrices (count + 1, 3, 3).
    """
    state, rotations = rig.begin(), np.empty((count + 1, 3, 3)) if rig.turning else None
    cells, places = np.empty((count + 1, rig.robot.count)), np.empty((count + 1, 3))
    for index in range(count + 1):
        time = index * step
        first: Moment = rig.evaluate(time, state)
        cells[index], places[index] = first.cell, first.position
        if rotations is not None:
            rotations[index] = first.rotation
        if index == count:
            break
        middle = time + 0.5 * step
        second = rig.rates(middle, state + 0.5 * step * first.rates)
        third = rig.rates(middle, state + 0.5 * step * second)
        fourth = rig.rates(time + step, state + step * third)
        state = state + step / 6.0 * (first.rates + 2.0 * (second + third) + fourth)
    if not np.all(np.isfinite(cells)):
        raise ValueError("the integration ran away")
    return cells, places, rotations
