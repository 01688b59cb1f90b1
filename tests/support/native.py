"""The same robot as Python FMUs and as native ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tautwire.cosimulation.robot_cosimulation import CosimulationResult, cosimulate
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.schema import Robot
from tests.support.effect_cases import DELAYED, SEVERAL, Case, same
from tests.support.effects import with_effects
from tests.support.rigid_robots import crane_robot
from tests.support.robots import LIMITED, example, with_winch

# Robots whose FMUs are held against derivatives of the laws.
DIFFERENTIATED = {
    "plain": example("three"),
    "several": with_winch(with_effects(example("three"), *SEVERAL), LIMITED),
    "delayed": with_effects(example("three"), *SEVERAL, DELAYED),
    "rigid": crane_robot()
    .with_effect(Case("payload", {}, {"mass": 10.0, "x": 0.1, "y": 0.2, "z": -0.1}).setting(crane_robot()))
    .with_effect(same("attachment", 2, x=0.02, z=-0.03).setting(crane_robot()))
    .with_effect(same("rotational_drag", damping=20.0).setting(crane_robot())),
}


def both_kinds(robot: Robot, folder: Path) -> tuple[RobotFmus, RobotFmus]:
    """FMUs of Python, and native ones."""
    return build_fmus(robot, folder / "python"), build_fmus(robot, folder / "native", native=True)


def both_runs(
    robot: Robot, folder: Path, time: np.ndarray, speed: np.ndarray
) -> tuple[CosimulationResult, CosimulationResult]:
    """Runs over the same winch speeds."""
    python, native = both_kinds(robot, folder)
    return cosimulate(python, time, speed), cosimulate(native, time, speed)


def largest_difference(first: CosimulationResult, second: CosimulationResult) -> float:
    """Largest difference of two runs, each column by its largest value or one."""
    one, other = (run.frame().to_numpy() for run in (first, second))
    return float(np.max(np.abs(one - other) / np.maximum(np.max(np.abs(one), axis=0), 1.0)))
