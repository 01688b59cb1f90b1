"""The start of a recording, and the robot placed there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import hypot

import numpy as np
from numpy.typing import NDArray

from ..errors import UnreachableError
from ..robot.measured_start import shown_position, with_measured_start, with_true_start
from ..robot.schema import AXES, Point, Quaternion, Robot
from ..robot.static_equilibrium import static_tensions
from .consistency import CONSISTENCY_HINT, describe_start, require_matching_reeling, require_start_within_robot
from .mistaken_orientation import angle_between
from .recording import Recording
from .white_noise_estimate import white_noise_deviation

Array = NDArray[np.float64]

START_SIGNIFICANCE = 6.0
# Of a plane's unit normal, and of its largest dimension.
PLANE_TOLERANCE = 1e-9
# The robot starts at rest: its first samples are of one position.
START_ROWS, MAX_START_SAMPLES = 10, 5
# Fewer cables leave the orientation of a rigid platform to statics.
RIGID_FREEDOMS = 6


@dataclass(frozen=True)
class StartPose:
    """Where a recording starts: ``position`` in m, and ``orientation``, a unit quaternion, platform to world."""

    position: Point
    orientation: Quaternion


def start_position(robot: Robot, position_noise: float, recording: Recording) -> tuple[Point, tuple[str, ...]]:
    """The position of :func:`start_pose`, and a note on it if it differs significantly from the robot file's."""
    orientation, _ = _start_orientation(robot, recording)
    return _start_position(robot, position_noise, recording, orientation)


def start_pose(robot: Robot, position_noise: float, recording: Recording) -> tuple[StartPose, tuple[str, ...]]:
    """The start pose of a recording, and notes where it differs significantly from the robot file's.

    Its position is the robot file's, or one as the position sensor shows it, with the sensor's errors; an axis without
    positions starts as declared, and so does the one across the plane of a planar robot; out of an oblique plane noise
    does not lead. Its orientation is the robot file's, or that of the first samples where six cables or more hold a
    rigid platform: fewer decide it by statics.

    Raises RecordingError where the recording cannot be this robot's, UnreachableError where the cables cannot hold the
    platform there; both name the recording.
    """
    orientation, orientation_notes = _start_orientation(robot, recording)
    position, notes = _start_position(robot, position_noise, recording, orientation)
    return StartPose(position, orientation), (*notes, *orientation_notes)


def at_recorded_start(robot: Robot, recording: Recording) -> tuple[Robot, tuple[str, ...]]:
    """The robot truly where its sensors show that a recording starts, and notes and errors as of :func:`start_pose`."""
    noise = robot.sensors.position_noise or white_noise_deviation(recording.position)
    start, notes = start_pose(robot, noise, recording)
    robot = with_start(robot, robot.platform.start, start.orientation)
    return with_true_start(with_measured_start(robot, start.position)), notes


def _start_position(
    robot: Robot, position_noise: float, recording: Recording, orientation: Quaternion
) -> tuple[Point, tuple[str, ...]]:
    """The start position with this orientation, which the cables have to hold, and a note if it differs."""
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
        if orientation != robot.platform.start_orientation:
            _require_holdable(with_start(robot, robot.platform.start, orientation), recording)
        return robot.platform.start, ()
    start = np.where(np.isfinite(uncertainty), expected + offset, robot.platform.start)
    start += _step_into_plane(robot, offset, uncertainty)
    x, y, z = start.tolist()
    where = f"{recording.path}: first positions"
    require_start_within_robot(robot, start, where)
    _require_holdable(with_start(robot, (x, y, z), orientation), recording, f"it is {describe_start(robot, start)}; ")
    require_matching_reeling(robot, recording, start, where)
    coordinates = ", ".join(f"{axis} {value:.6g}" for axis, value in zip(AXES, (x, y, z), strict=True))
    note = (
        f"{recording.path} starts at {coordinates} m, not at the robot file's start; the run starts there too, unless "
        "the zero of the position sensor is wrong"
    )
    return (x, y, z), (note,)


def _step_into_plane(robot: Robot, offset: Array, uncertainty: Array) -> Array:
    """The most likely step (3,) in m from a measured start into the plane of a planar robot; 0 if noise is no reason.

    An axis without positions takes all of it; ``offset`` (3,) in m is the measured one from the declared start.
    """
    _, sizes, directions = np.linalg.svd(np.subtract(robot.anchors, robot.platform.start))
    if robot.platform.is_rigid_body or (len(sizes) == 3 and sizes[2] > PLANE_TOLERANCE * sizes[0]):
        return np.zeros(3)
    normal, is_unknown = directions[2], np.isinf(uncertainty)
    is_free = is_unknown & (np.abs(normal) > PLANE_TOLERANCE)
    variances = is_free.astype(float) if np.any(is_free) else np.where(is_unknown, 0.0, uncertainty) ** 2
    distance, variance = float(normal @ offset), float(variances @ normal**2)
    if variance == 0.0 or not (np.any(is_free) or abs(distance) <= START_SIGNIFICANCE * variance**0.5):
        return np.zeros(3)
    step: Array = -distance * variances * normal / variance
    return step


def _require_holdable(robot: Robot, recording: Recording, described: str = "") -> None:
    """Raises UnreachableError, about a recording, where the cables cannot hold the platform at the start."""
    try:
        static_tensions(robot)
    except UnreachableError as error:
        where = f"{recording.path}: first {'positions' if described else 'orientations'}"
        reason = f"{described}{error.reason}"
        hint = CONSISTENCY_HINT
        if described and robot.platform.is_rigid_body:
            hint += "; if the tracker shows another point of the platform than its origin, give attachments from there"
        raise UnreachableError(where, error.position, error.cable, error.tension, reason, hint) from error


def _start_orientation(robot: Robot, recording: Recording) -> tuple[Quaternion, tuple[str, ...]]:
    """The orientation at the start, and a note if it differs significantly from the robot file's."""
    declared, measured = robot.platform.start_orientation, recording.orientation[:START_ROWS]
    samples = measured[np.isfinite(measured).all(axis=1)][:MAX_START_SAMPLES]
    if not robot.platform.is_rigid_body or robot.cable_count < RIGID_FREEDOMS or not len(samples):
        return declared, ()
    mean = samples.mean(axis=0) / np.linalg.norm(samples.mean(axis=0))
    angle = angle_between(mean, declared)
    # A small rotation changes each of the last three numbers by half its angle.
    noise = robot.sensors.orientation_noise or 2.0 * white_noise_deviation(recording.orientation)
    if angle <= START_SIGNIFICANCE * noise / len(samples) ** 0.5:
        return declared, ()
    w, x, y, z = mean.tolist()
    numbers = ", ".join(f"{part:.6f}" for part in mean)
    note = (
        f"{recording.path} starts turned by {np.degrees(angle):.3g} degrees from the robot file's start_orientation; "
        f"the run starts so too, at [{numbers}]"
    )
    return (w, x, y, z), (note,)


def with_start(robot: Robot, start: Point, orientation: Quaternion | None = None) -> Robot:
    """The robot at another start, and with another orientation there if one is given."""
    platform = replace(robot.platform, start=start, start_orientation=orientation or robot.platform.start_orientation)
    return robot if platform == robot.platform else replace(robot, platform=platform)
