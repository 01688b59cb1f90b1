"""What drives a run along a path, by what is believed of the robot: winch speeds, or a controller with reference."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil

import numpy as np
from numpy.typing import NDArray

from ..control import (
    Design,
    Feedforward,
    Reference,
    design_controller,
    design_robust,
    elastic_reference,
    sample_times,
    schedule_controller,
)
from ..recordings.recording import Recording
from ..robots.robot import Point, Robot
from ..runs.start import placed
from ..trajectory import Helix, Line, Trajectory, ideal_winch_speeds
from .plan import OPEN_LOOP, Compute, PathPlan

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Drive:
    """What a run is given: ``time`` (N,) in s with winch ``speeds`` (N, n), or a ``design`` and its ``reference``.

    ``wanted`` (N, 3) is the path in m, None where a recording has none.
    """

    believed: Robot
    time: Array
    wanted: Array | None
    trajectory: Trajectory | None
    speeds: Array | None = None
    design: Design | None = None
    reference: Reference | None = None


def start_of_path(robot: Robot, path: PathPlan) -> Point:
    """Where a run along a path starts."""
    if path.kind == "helix":
        x, y, z = _trajectory(robot, path).position(np.zeros(1))[0].tolist()
        return (x, y, z)
    return path.start or robot.platform.start


def drive_of(
    robot: Robot, path: PathPlan, controller: str, compute: Compute, recordings: Mapping[str, Recording]
) -> Drive:
    """What drives a robot along a path, by a controller designed for it; winches reel for inelastic cables without.

    Raises UnreachableError where the path asks a cable to push, and what designs of controllers raise.
    """
    believed = placed(robot, start_of_path(robot, path))
    if path.kind == "recording":
        recording = recordings[path.name]
        count = int(np.searchsorted(recording.time, recording.time[0] + path.numbers["duration"], side="right"))
        time = recording.time[:count]
        return Drive(believed, time, None, None, recording.winch_speed[:count])
    trajectory = _trajectory(believed, path)
    duration = path.numbers["duration"] + compute.settle
    if controller == OPEN_LOOP:
        time = np.linspace(0.0, duration, ceil(duration / compute.step) + 1)
        speeds = ideal_winch_speeds(believed, trajectory, time)
        return Drive(believed, time, trajectory.position(time), trajectory, speeds)
    design = _design(believed, trajectory, controller)
    time = sample_times(design.aim.period, duration)
    reference = elastic_reference(believed, trajectory, time)
    return Drive(believed, time, trajectory.position(time), trajectory, None, design, reference)


def _design(robot: Robot, trajectory: Trajectory, controller: str) -> Design:
    if controller == "feedforward":
        return Feedforward(robot.cable_count)
    if controller == "lqg":
        return design_controller(robot)
    return schedule_controller(robot, trajectory) if controller == "scheduled" else design_robust(robot)


def _trajectory(robot: Robot, path: PathPlan) -> Trajectory:
    numbers = path.numbers
    end = path.end or robot.platform.start
    if path.kind == "helix":
        return Helix(end, numbers["radius"], numbers["rise"], numbers["angle"], numbers["duration"])
    return Line(path.start or robot.platform.start, end, numbers["duration"])
