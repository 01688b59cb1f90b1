"""Reference input of a run along a path, from the nominal robot: winch speeds, or a controller with reference."""

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
from ..runs.start import with_start
from ..trajectory import Helix, Line, Trajectory, ideal_winch_speeds
from .plan import OPEN_LOOP, Compute, PathPlan

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ReferenceInput:
    """Reference input of a run: ``time`` (N,) in s with ``winch_speeds`` (N, n), or ``design`` with its ``reference``.

    ``desired_position`` (N, 3) is the path in m, None for a recording; ``nominal_robot`` is the model for the design.
    """

    nominal_robot: Robot
    time: Array
    desired_position: Array | None
    trajectory: Trajectory | None
    winch_speeds: Array | None = None
    design: Design | None = None
    reference: Reference | None = None


def path_start(robot: Robot, path: PathPlan) -> Point:
    """Start position of a run along a path."""
    if path.kind == "helix":
        x, y, z = _path_trajectory(robot, path).position(np.zeros(1))[0].tolist()
        return (x, y, z)
    return path.start or robot.platform.start


def build_reference_input(
    robot: Robot, path: PathPlan, controller: str, compute: Compute, recordings: Mapping[str, Recording]
) -> ReferenceInput:
    """Reference input along a path: a controller designed for the robot, or winch speeds for inelastic cables.

    Raises UnreachableError where the path asks a cable to push, and what designs of controllers raise.
    """
    nominal_robot = with_start(robot, path_start(robot, path))
    if path.kind == "recording":
        recording = recordings[path.name]
        count = int(np.searchsorted(recording.time, recording.time[0] + path.numbers["duration"], side="right"))
        time = recording.time[:count]
        return ReferenceInput(nominal_robot, time, None, None, recording.winch_speed[:count])
    trajectory = _path_trajectory(nominal_robot, path)
    duration = path.numbers["duration"] + compute.settle
    if controller == OPEN_LOOP:
        time = np.linspace(0.0, duration, ceil(duration / compute.step) + 1)
        winch_speeds = ideal_winch_speeds(nominal_robot, trajectory, time)
        return ReferenceInput(nominal_robot, time, trajectory.position(time), trajectory, winch_speeds)
    design = _designed_controller(nominal_robot, trajectory, controller)
    time = sample_times(design.aim.period, duration)
    reference = elastic_reference(nominal_robot, trajectory, time)
    return ReferenceInput(nominal_robot, time, trajectory.position(time), trajectory, None, design, reference)


def _designed_controller(robot: Robot, trajectory: Trajectory, controller: str) -> Design:
    if controller == "feedforward":
        return Feedforward(robot.cable_count)
    if controller == "lqg":
        return design_controller(robot)
    return schedule_controller(robot, trajectory) if controller == "scheduled" else design_robust(robot)


def _path_trajectory(robot: Robot, path: PathPlan) -> Trajectory:
    numbers = path.numbers
    end = path.end or robot.platform.start
    if path.kind == "helix":
        return Helix(end, numbers["radius"], numbers["rise"], numbers["angle"], numbers["duration"])
    return Line(path.start or robot.platform.start, end, numbers["duration"])
