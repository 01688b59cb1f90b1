"""Mistakes in quaternions that their beginning tells, and what a rigid platform's recording lacks."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError
from ..number_format import format_significant
from ..robot.schema import QUATERNION_COLUMNS, Quaternion, Robot
from .alternative_readings import mistakes_text
from .geometry_reading import GeometryReading, QuaternionReading
from .mistaken_motion import EQUAL_DIFFERENCE, EQUAL_RATIO, MIN_IMPROVEMENT, misfit_of_geometry
from .recording import Recording

Array = NDArray[np.float64]

# rad; platforms begin nearer to what the robot file declares, and quaternions in another order mostly do not.
MIN_START_ANGLE = 0.5
EULER_NAMES = ("roll", "pitch", "yaw", "euler", "rx", "ry", "rz", "rot_x", "rot_y", "rot_z", "phi", "theta", "psi")


def angle_between(first: Quaternion | Array, second: Quaternion | Array) -> float:
    """Angle in rad of the rotation between two unit quaternions, of any sign."""
    return float(2.0 * np.arccos(min(abs(float(np.dot(first, second))), 1.0)))


def first_orientation(recording: Recording) -> Array | None:
    """The first orientation that was measured, a unit quaternion (4,); None where none was."""
    rows = np.flatnonzero(np.isfinite(recording.orientation).all(axis=1))
    return recording.orientation[rows[0]] if len(rows) else None


def start_orientation_error(robot: Robot, recording: Recording) -> RecordingError | None:
    """The error of quaternions that begin far from the declared orientation, and near it if they are read otherwise.

    None where their winch travel contradicts that, and where no other reading brings them to a quarter of the angle.
    """
    first = first_orientation(recording)
    if first is None or not robot.platform.is_rigid_body:
        return None
    angle = angle_between(first, robot.platform.start_orientation)
    if angle < MIN_START_ANGLE:
        return None
    as_declared = misfit_of_geometry(robot, recording, GeometryReading())
    for reading in _other_readings():
        corrected = angle_between(reading.read(first[None])[0], robot.platform.start_orientation)
        misfit = misfit_of_geometry(robot, recording, GeometryReading(quaternion=reading))
        if corrected * MIN_IMPROVEMENT > angle:
            continue
        if as_declared is not None and misfit is not None and misfit > EQUAL_RATIO * as_declared + EQUAL_DIFFERENCE:
            continue
        cause, remedy = mistakes_text([tuple(reading.mistakes())], recording)
        problem = (
            f"orientation begins {_degrees(angle)} from start_orientation in the robot file, {_degrees(corrected)} if "
            f"{cause}"
        )
        return RecordingError(recording.path, problem, f"{remedy}, or correct start_orientation")
    return None


def _other_readings() -> Iterator[QuaternionReading]:
    """Readings of quaternions, those with one mistake first."""
    readings = [QuaternionReading(*flags) for flags in product((False, True), repeat=2) if any(flags)]
    yield from sorted(readings, key=lambda reading: reading.is_scalar_last + reading.is_inverse)


def _degrees(angle: float) -> str:
    return f"{format_significant(float(np.degrees(angle)))} degrees"


def orientation_notes(robot: Robot, recording: Recording) -> tuple[str, ...]:
    """Notes on a rigid platform's recording without orientation: what is not checked, and how Euler angles are mended.

    Empty where the orientation was recorded, or the platform is a point mass.
    """
    if recording.has_orientation or not robot.platform.is_rigid_body:
        return ()
    names = ", ".join(QUATERNION_COLUMNS)
    notes = [f"{recording.path}: no orientation ({names}): neither rope lengths nor moments are checked by it"]
    angles = [name for name in recording.unknown_columns if _is_euler_angle(name)]
    if angles:
        line = "Rotation.from_euler('ZYX', angles, degrees=True).as_quat(scalar_first=True)"
        notes.append(
            f"{recording.path}: {', '.join(angles)} may be Euler angles, which are not read; write {names} by their "
            f"own order of axes and unit, in Python as in scipy's {line}"
        )
    return tuple(notes)


def _is_euler_angle(name: str) -> bool:
    words = name.lower().replace("-", "_").replace(".", "_").replace(" ", "_")
    return words in EULER_NAMES or any(word in words.split("_") for word in EULER_NAMES)
