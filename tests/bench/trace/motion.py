"""How each robot moves in the benchmark, and the true program that drives it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from tests.rig import PathProgram, Robot, SampledProgram, load_robot, wander
from tests.support.robots import EXAMPLES


@dataclass(frozen=True)
class Motion:
    """Length in s, samples in Hz, reach and centre in m, bounds of slow periods in s, fast accelerations in m/s^2."""

    duration: float
    rate: float
    reach: float
    centre: tuple[float, float, float]
    slow: tuple[float, float]
    shake: float

    @property
    def times(self) -> np.ndarray:
        """All samples, s."""
        return np.arange(round(self.duration * self.rate) + 1) / self.rate


MOTIONS = {
    "three": Motion(24.0, 50.0, 5.0, (28.86, 0.0, 9.0), (5.0, 12.0), 0.12),
    "caroca": Motion(8.0, 200.0, 0.5, (0.3, -0.4, 1.2), (3.0, 6.0), 0.1),
    "eight": Motion(12.0, 100.0, 0.8, (5.0, 4.0, 2.8), (3.0, 8.0), 0.2),
}


@cache
def declared(robot: str) -> Robot:
    """An example robot as the rig has it."""
    return load_robot(EXAMPLES / robot / "robot.toml")


def smooth_program(robot: str, motion: Motion, seed: int) -> PathProgram:
    """A rich program for a robot."""
    return wander(declared(robot), seed, motion.reach, motion.centre, slow=motion.slow, shake=motion.shake)


def program_of(robot: str, motion: Motion, seed: int) -> SampledProgram:
    """Winch speeds linear between samples, as a recording has them by its format."""
    smooth = smooth_program(robot, motion, seed)
    return SampledProgram(motion.times, np.array([smooth.speed(float(time)) for time in motion.times]))
