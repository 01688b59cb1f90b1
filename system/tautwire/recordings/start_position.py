"""The start position of a recording, and the robot placed there."""

from __future__ import annotations

from dataclasses import replace
from math import hypot

import numpy as np

from ..errors import UnreachableError
from ..robot.measured_start import shown_position
from ..robot.schema import AXES, Robot
from ..robot.static_equilibrium import static_tensions
from .consistency import CONSISTENCY_HINT, describe_start, require_matching_reeling, require_start_within_robot
from .recording import Recording

START_SIGNIFICANCE = 6.0
# The robot starts at rest: its first samples are of one position.
START_ROWS, MAX_START_SAMPLES = 10, 5


def start_position(
    robot: Robot, position_noise: float, recording: Recording
) -> tuple[tuple[float, float, float], tuple[str, ...]]:
    """The start position of a recording, and a note if it differs significantly from the robot file's start.

    It is the robot file's, or one as the position sensor shows it, with the sensor's errors; an axis without positions
    starts as declared, and so does the one across the plane of a planar robot.

    Raises RecordingError where the recording cannot be this robot's, UnreachableError where the cables cannot hold the
    platform there; both name the recording.
    """
    expected = np.array(shown_position(robot, robot.platform.start), dtype=float)
    offset, uncertainty = np.zeros(3), np.full(3, np.inf)
    for axis in robot.axes_in_plane:
        column = recording.position[:START_ROWS, axis]
        valid_samples = column[np.isfinite(column)][:MAX_START_SAMPLES]
        if len(valid_samples):
            offset[axis] = float(np.mean(valid_samples)) - expected[axis]
            uncertainty[axis] = hypot(
                position_noise / len(valid_samples) ** 0.5, robot.sensors.position_offset_uncertainty
            )
    if np.all(np.abs(offset) <= START_SIGNIFICANCE * uncertainty):
        return robot.platform.start, ()
    start = np.where(np.isfinite(uncertainty), expected + offset, robot.platform.start)
    x, y, z = start.tolist()
    where = f"{recording.path}: first positions"
    require_start_within_robot(robot, start, where)
    try:
        static_tensions(with_start(robot, (x, y, z)))
    except UnreachableError as error:
        reason = f"it is {describe_start(robot, start)}; {error.reason}"
        raise UnreachableError(where, error.position, error.cable, error.tension, reason, CONSISTENCY_HINT) from error
    require_matching_reeling(robot, recording, start, where)
    coordinates = ", ".join(f"{axis} {value:.6g}" for axis, value in zip(AXES, (x, y, z), strict=True))
    note = (
        f"{recording.path} starts at {coordinates} m, not at the robot file's start; the run starts there too, unless "
        "the zero of the position sensor is wrong"
    )
    return (x, y, z), (note,)


def with_start(robot: Robot, start: tuple[float, float, float]) -> Robot:
    """The robot at another start."""
    return robot if start == robot.platform.start else replace(robot, platform=replace(robot.platform, start=start))
