"""Reference input of a campaign's run: winch speeds along a path, or a controller designed for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
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
from ..recordings.start_position import with_start
from ..robot.pose_path import pose_path, sample_poses
from ..robot.pose_trajectory import PoseTrajectory, slerp
from ..robot.schema import Robot
from ..robot.trajectory import Helix, Line, Trajectory
from ..robot.winch_speeds import ideal_winch_speeds
from .campaign_plan import OPEN_LOOP, Compute, PathPlan

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ReferenceInput:
    """Reference input of a run: ``time`` (N,) in s with ``winch_speeds`` (N, n), or ``design`` with its ``reference``.

    ``desired_position`` (N, 3) is the path in m, None for a recording, and ``desired_orientation`` (N, 4) that of a
    rigid platform; ``nominal_robot`` is the model for the design.
    """

    nominal_robot: Robot
    time: Array
    desired_position: Array | None
    trajectory: Trajectory | None
    winch_speeds: Array | None = None
    design: Design | None = None
    reference: Reference | None = None
    desired_orientation: Array | None = None


def at_path_start(robot: Robot, path: PathPlan) -> Robot:
    """The robot at the start of a path."""
    start, orientation = path.start or robot.platform.start, path.start_orientation
    if path.kind == "helix":
        x, y, z = path_trajectory(robot, path).position(np.zeros(1))[0].tolist()
        start = (x, y, z)
    if orientation is not None:
        robot = replace(robot, platform=replace(robot.platform, start_orientation=orientation))
    return with_start(robot, start)


def build_reference_input(
    robot: Robot, path: PathPlan, controller: str, compute: Compute, recordings: Mapping[str, Recording]
) -> ReferenceInput:
    """Reference input along a path: a controller designed for the robot, or winch speeds for inelastic cables.

    Raises UnreachableError where the path asks a cable to push, and what designs of controllers raise.
    """
    nominal_robot = at_path_start(robot, path)
    if path.kind == "recording":
        recording = recordings[path.name]
        count = int(np.searchsorted(recording.time, recording.time[0] + path.numbers["duration"], side="right"))
        time = recording.time[:count]
        return ReferenceInput(nominal_robot, time, None, None, recording.winch_speed[:count])
    trajectory = path_trajectory(nominal_robot, path)
    duration = path.numbers["duration"] + compute.settle
    design = None if controller == OPEN_LOOP else designed_controller(nominal_robot, trajectory, controller)
    if design is None:
        time = np.linspace(0.0, duration, ceil(duration / compute.step) + 1)
    else:
        time = sample_times(design.aim.period, duration)
    poses = sample_poses(path.name, nominal_robot, pose_path(nominal_robot, trajectory), time)
    return ReferenceInput(
        nominal_robot,
        time,
        poses.position,
        trajectory,
        ideal_winch_speeds(nominal_robot, trajectory, time) if design is None else None,
        design,
        None if design is None else elastic_reference(nominal_robot, trajectory, time),
        poses.orientation if nominal_robot.platform.is_rigid_body else None,
    )


def designed_controller(robot: Robot, trajectory: Trajectory, controller: str) -> Design:
    """The controller of a name that is not ``none``, designed for the robot at the start of its path."""
    if controller == "feedforward":
        return Feedforward(robot.cable_count)
    if controller == "lqg":
        return design_controller(robot)
    return schedule_controller(robot, trajectory) if controller == "scheduled" else design_robust(robot)


def path_trajectory(robot: Robot, path: PathPlan) -> Trajectory:
    """The trajectory of a line or a helix; where it states no start, it begins where the platform does."""
    numbers, platform = path.numbers, robot.platform
    duration, end = numbers["duration"], path.end or platform.start
    translation: Trajectory = Line(path.start or platform.start, end, duration)
    if path.kind == "helix":
        translation = Helix(end, numbers["radius"], numbers["rise"], numbers["angle"], duration)
    start_orientation = path.start_orientation or platform.start_orientation
    if path.end_orientation is None:
        # A path without orientation keeps that of the start, where fewer than six cables allow it.
        return translation
    return PoseTrajectory(translation, slerp(start_orientation, path.end_orientation, duration))
