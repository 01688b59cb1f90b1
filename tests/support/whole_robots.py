"""Whole robots as one FMU, driven by winch speeds that are linear between samples."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tautwire.cosimulation.robot_cosimulation import CosimulationResult, cosimulate
from tautwire.fmus.packaging import build_fmus, build_whole_fmu
from tautwire.robot.schema import Robot
from tests.support.fmus import Hand, in_hand

Array = NDArray[np.float64]
CABLE_QUANTITIES = ("tension", "length", "elongation", "strain")


def communication_points(time: Array, step: float) -> Array:
    """Every ``step`` from each sample to the next one."""
    pieces = [np.arange(begin, end - 1e-9, step) for begin, end in pairwise(time)]
    return np.array([*np.concatenate(pieces), time[-1]])


def recorded_names(robot: Robot, hand: Hand) -> list[str]:
    """Outputs in the order of a result file's columns."""
    position = "measured_position" if "measured_position.x" in hand.references else "position"
    names = [f"{name}.{axis}" for name in (position, "velocity") for axis in "xyz"]
    if robot.platform.is_rigid_body:
        names += [f"orientation.{part}" for part in "wxyz"] + [f"angular_velocity.{axis}" for axis in "xyz"]
    names += [f"{quantity}_{i}" for quantity in CABLE_QUANTITIES for i in robot.cable_numbers]
    return names + [f"winch_speed_{i}" for i in robot.winch_numbers]


def run_whole(
    fmu: Path,
    robot: Robot,
    time: Array,
    speed: Array,
    step: float,
    prepare: Callable[[Hand], None] | None = None,
) -> Array:
    """Rows of a result file at ``time``, by steps that extrapolate each speed by its rate."""
    points = communication_points(time, step)
    inputs = ("speed_command", "speed_command_rate") if robot.winch else ("winch_speed", "winch_acceleration")
    names = [f"{name}_{i}" for name in inputs for i in robot.cable_numbers]
    speeds = np.stack([np.interp(points, time, column) for column in speed.T], axis=1)
    slopes = np.diff(speeds, axis=0) / np.diff(points)[:, None]
    with in_hand(fmu) as hand:
        references = [hand.references[name] for name in names]
        outputs = recorded_names(robot, hand)
        if prepare is not None:
            prepare(hand)
        hand.fmu.setReal(references, [*speeds[0], *slopes[0]])
        hand.run()
        rows = [hand.get(*outputs)]
        for k, (begin, length) in enumerate(zip(points, np.diff(points), strict=False)):
            hand.fmu.setReal(references, [*speeds[k], *slopes[k]])
            hand.step(begin, length)
            rows.append(hand.get(*outputs))
    return np.array(rows)[np.searchsorted(points, time - 1e-9)]


def both_ways(robot: Robot, folder: Path, time: Array, speed: Array, steps: tuple[float, float]) -> float:
    """Largest difference of a whole robot from its components' co-simulation, each column by its largest value or one.

    ``steps`` are those of the whole robot and of the co-simulation.
    """
    whole = run_whole(build_whole_fmu(robot, folder), robot, time, speed, steps[0])
    result: CosimulationResult = cosimulate(build_fmus(robot, folder, native=True), time, speed, steps[1])
    rows = result.frame().to_numpy()[:, 1:]
    return float(np.max(np.abs(whole - rows) / np.maximum(np.max(np.abs(rows), axis=0), 1.0)))
