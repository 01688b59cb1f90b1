"""The same robot as Python FMUs and as native ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tautwire.cosimulation.robot_cosimulation import CosimulationResult, cosimulate
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.schema import Robot


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
