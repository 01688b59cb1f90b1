"""Where a recording starts, and the robot placed there."""

from __future__ import annotations

from dataclasses import replace
from math import hypot

import numpy as np

from ..errors import UnreachableError
from ..recordings.recording import AXES, Recording
from ..robots.robot import Robot
from ..statics.equilibrium import static_tensions
from .belonging import MEND, require_near, require_ropes, start_told

START_SIGNIFICANCE = 6.0
# The robot starts at rest: its first samples are of one place.
START_ROWS, START_SAMPLES = 10, 5


def start_of(
    robot: Robot, position_noise: float, recording: Recording
) -> tuple[tuple[float, float, float], tuple[str, ...]]:
    """Where a recording starts, and a note if that is not the robot file's start but where it says.

    Raises RecordingError where the recording cannot be this robot's, UnreachableError where the cables cannot hold the
    platform there; both name the recording.
    """
    declared = np.array(robot.platform.start)
    away, spread = np.zeros(3), np.full(3, np.inf)
    for axis, column in enumerate(recording.position[:START_ROWS].T):
        seen = column[np.isfinite(column)][:START_SAMPLES]
        if len(seen):
            away[axis] = float(np.mean(seen)) - declared[axis]
            spread[axis] = hypot(position_noise / len(seen) ** 0.5, robot.sensors.position_offset_uncertainty)
    if np.all(np.abs(away) <= START_SIGNIFICANCE * spread):
        return robot.platform.start, ()
    x, y, z = (declared + away).tolist()
    where = f"{recording.path}: first positions"
    require_near(robot, declared + away, where)
    try:
        static_tensions(placed(robot, (x, y, z)))
    except UnreachableError as error:
        reason = f"it is {start_told(robot, declared + away)}; {error.reason}"
        raise UnreachableError(where, error.position, error.cable, error.tension, reason, MEND) from error
    require_ropes(robot, recording, declared + away, where)
    shown = ", ".join(f"{axis} {value:.6g}" for axis, value in zip(AXES, (x, y, z), strict=True))
    note = f"{recording.path} starts at {shown} m, not at the robot file's start; the run starts where it says"
    return (x, y, z), (note,)


def placed(robot: Robot, start: tuple[float, float, float]) -> Robot:
    """The robot at another start."""
    return robot if start == robot.platform.start else replace(robot, platform=replace(robot.platform, start=start))
