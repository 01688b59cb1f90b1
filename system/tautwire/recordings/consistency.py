"""Consistency of a recording and a robot: start, winch travel, and the balance of forces and moments."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError
from ..robot.schema import Robot
from .alternative_readings import WindingReading
from .anchor_scale import AnchorScale, anchor_scale
from .consistency_errors import (
    anchor_error,
    cable_order_error,
    hopeless_tension_error,
    motion_error,
    odd_winch_error,
    point_error,
    tension_error,
    unexplained_error,
)
from .geometry_reading import IDENTITY, GeometryReading, recorded_poses
from .mistaken_motion import EQUAL_DIFFERENCE, EQUAL_RATIO, MAX_MISFIT, MIN_IMPROVEMENT, MotionCheck, check_motion
from .mistaken_orientation import start_orientation_error
from .mistaken_points import PointMistake, point_mistake
from .mistaken_tensions import check_tensions
from .motion_regression import centred, dynamic_amplification, length_regression, moving_rows, robot_size
from .odd_winches import OddWinch, odd_winches
from .recording import Recording
from .standing_winches import all_winches_stand
from .unwound_motion import unwound_motion_error

Array = NDArray[np.float64]

# Shares of the robot's size: a nearer start, or a shorter winch travel, is not checked.
MIN_CHECKED_START_SHARE, MIN_REELED_SHARE = 0.1, 1e-3
# In sizes of the robot: no winch moves more rope, counted from where it begins.
MAX_TRAVEL_TO_SIZE = 3.0
# m/s; the fastest cable robots reach a quarter of it.
MAX_WINCH_SPEED, SPEED_QUANTILE = 60.0, 0.99
# Share of the winch travel: stretch, wrong drums and drift stay far below, another robot mismatches by all of it.
MAX_REELING_MISMATCH = 0.5
CHECKED_DURATION = 60.0  # s
MAX_SAMPLE_INTERVAL = 0.5  # s
# Rms of what lengths in the columns of speeds miss, over that of the geometric ones.
MAX_LENGTH_MISFIT = 0.1
# What no winch that stands would miss: where ropes give, the platform still goes the way of its winches.
MAX_UNEXPLAINED = 1.0
# Their contributions to readings and points, and beside these to forces, are not computed here.
EFFECTS_ON_POSES = frozenset(
    ("frame", "sensor_delay", "sensor_gain", "sensor_offset", "attachment", "centre_of_mass"),
)
EFFECTS_ON_FORCES = EFFECTS_ON_POSES | {"payload", "hanging_load", "inertia"}
# Rows at rest at the start, and the quantile of rows without outliers of the tracker.
ROWS_AT_REST, INLIER_QUANTILE = 5, 0.95
CONSISTENCY_HINT = (
    "give a recording of this robot, with positions in m in the robot file's frame, or correct the robot file"
)


def require_plausible(robot: Robot, recording: Recording) -> None:
    """Raises RecordingError where units, signs, orders, axes or clocks seem to be others than the files say.

    It names what shows each mistake, the likely cause, and what mends it.
    """
    mistakes = recording_mistakes(robot, recording)
    if mistakes:
        texts = zip(*((m.problem, m.hint) for m in mistakes), strict=True)
        problem, hint = ("; ".join(dict.fromkeys(each)) for each in texts)
        raise RecordingError(recording.path, problem, hint)


def recording_mistakes(robot: Robot, recording: Recording) -> tuple[RecordingError, ...]:
    """What the winch travel, the poses and the tensions say of mistakes in the recording or the robot file.

    Empty where they say nothing. For a robot that declares effects which are no part of the kinematics only travel
    beyond its size counts, and its tensions do not for one with effects that are no part of the balance of forces.
    """
    declared = {setting.name for setting in robot.effects}
    if declared & EFFECTS_ON_POSES:
        error = travel_error(robot, recording)
        return (error,) if error else ()
    if error := unwound_motion_error(robot, recording):
        return (error,)
    # Else, where no winch turns, what moves the platform is no matter of the columns.
    motion = None if all_winches_stand(robot, recording) else check_motion(robot, recording)
    travel = None if _follows(motion) else _excessive_travel(robot, recording)
    errors = []
    geometry, winding = GeometryReading(), WindingReading()
    is_off = motion is not None and not _follows(motion)
    if is_off and (error := row_number_error(robot, recording) or length_column_error(robot, recording)):
        return (error,)
    odd = odd_winches(robot, recording) if is_off else ()
    points = point_mistake(robot, recording) if is_off and not _are_of_factors(odd) else None
    scale = None if _are_of_factors(odd) else anchor_scale(robot, recording)
    if scale is not None and not _is_read_as_well(motion, scale):
        return (anchor_error(recording, scale),)
    if motion is not None and motion.readings and not _is_better(points, odd, motion):
        errors.append(motion_error(robot, recording, motion))
        geometry, winding = motion.readings[0].geometry, motion.readings[0].winding
    elif motion is not None and points is not None:
        errors.append(point_error(recording, motion, points))
    elif odd:
        errors += [odd_winch_error(recording, each) for each in odd]
    elif error := travel or speed_error(recording) or start_orientation_error(robot, recording):
        return (error,)
    elif motion is not None and _is_hopeless(robot, recording, motion):
        errors.append(unexplained_error(recording, motion))
    if robot.formulas or declared & EFFECTS_ON_FORCES:
        return tuple(errors)
    return _with_tension_errors(robot, recording, geometry, winding, tuple(errors))


def _with_tension_errors(
    robot: Robot,
    recording: Recording,
    geometry: GeometryReading,
    winding: WindingReading,
    errors: tuple[RecordingError, ...],
) -> tuple[RecordingError, ...]:
    """The errors, with what the tensions say where poses and winches are read in the way that mends these."""
    # Of a platform outside of its robot ropes have no directions: that is told first, and by its start.
    if not errors and _distance_of_first(robot, recording) > robot_size(robot):
        return errors
    tensions = check_tensions(robot, recording, geometry, winding)
    if tensions is None:
        return errors
    if tensions.mistakes:
        errors = (*errors, tension_error(recording, tensions))
        is_of_both = tensions.order == winding.order != tuple(sorted(winding.order))
        return (cable_order_error(errors, winding.order),) if is_of_both else errors
    return (hopeless_tension_error(recording, tensions),) if tensions.is_hopeless and not errors else errors


def travel_error(robot: Robot, recording: Recording) -> RecordingError | None:
    """The error of a recording in which a winch moves more rope than fits into the robot, None where none does.

    None too where positions confirm it: a platform may hang far below where it starts.
    """
    error = _excessive_travel(robot, recording)
    return None if error is None or _follows(check_motion(robot, recording)) else error


def _follows(motion: MotionCheck | None) -> bool:
    return motion is not None and motion.misfit <= MAX_MISFIT


def _excessive_travel(robot: Robot, recording: Recording) -> RecordingError | None:
    """The error of :func:`travel_error`, whatever the positions say."""
    travel, size = np.max(np.abs(recording.wound_lengths()), axis=0), robot_size(robot)
    cable = int(np.argmax(travel)) + 1
    if travel[cable - 1] <= MAX_TRAVEL_TO_SIZE * size:
        return None
    problem = f"winch {cable} moves {travel[cable - 1]:,.4g} m of rope, and the robot is no larger than {size:.3g} m"
    hint = "check that time is in s and winch speeds are in m/s; [recording.columns] declares other units and factors"
    if cable in recording.rope_lengths:
        hint = (
            f"give rope_length_{cable} in m: for counts add factor = 2 pi * drum radius / counts per turn to it in "
            "[recording.columns]"
        )
    return RecordingError(recording.path, problem, hint)


def row_number_error(robot: Robot, recording: Recording) -> RecordingError | None:
    """The error of times that count samples, whose interval the winch travel then tells; None of other times."""
    if not np.all(np.diff(recording.time) == 1.0) or recording.rope_lengths:
        return None
    regression = length_regression(robot, recording)
    if regression is None:
        return None
    interval = float(np.nanmedian(regression.slopes))
    if not 0.0 < interval < MAX_SAMPLE_INTERVAL:
        return None
    problem = "time rises by exactly 1 from row to row, as the number of a sample does, and winch travel does not match"
    hint = f"its factor is the time between samples in s, about {interval:.3g} by the winch travel"
    return RecordingError(recording.path, problem, f"declare time in [recording.columns]: {hint}")


def length_column_error(robot: Robot, recording: Recording) -> RecordingError | None:
    """The error of winch speeds that vary as the lengths of the ropes do; None of others."""
    regression = length_regression(robot, recording)
    if regression is None or recording.rope_lengths:
        return None
    columns = centred(recording.winch_speed[regression.rows])
    squares = np.sum(columns**2, axis=0)
    slopes = np.sum(columns * regression.lengths, axis=0) / np.where(squares > 0.0, squares, np.inf)
    missed = np.linalg.norm(regression.lengths - slopes * columns, axis=0)
    if np.any(missed > MAX_LENGTH_MISFIT * np.linalg.norm(regression.lengths, axis=0)):
        return None
    scale = float(np.median(slopes))
    problem = f"winch_speed_1 to winch_speed_{recording.cable_count} vary as the lengths of the ropes, not their rates"
    hint = f"name them rope_length_1 to rope_length_{recording.cable_count}; 1 of theirs is about {scale:.2g} m of rope"
    return RecordingError(recording.path, problem, hint)


def speed_error(recording: Recording) -> RecordingError | None:
    """The error of a recording whose winches are faster than those of any robot; None where they are not."""
    speed = float(np.quantile(np.abs(recording.winch_speed), SPEED_QUANTILE))
    if speed <= MAX_WINCH_SPEED:
        return None
    problem = f"winches reach {speed:,.4g} m/s, no robot's are faster than {MAX_WINCH_SPEED:g} m/s"
    hint = "check that anchors and positions are in m, speeds in m/s and time in s; all lengths alike seem to be in mm"
    return RecordingError(recording.path, problem, hint)


def _is_better(points: PointMistake | None, odd: Sequence[OddWinch], motion: MotionCheck) -> bool:
    """Whether mistaken points, factors of winches or one odd winch beside a frame explain more than other readings do.

    Where all ropes but one follow their winches, the frame is the declared one.
    """
    reading = motion.readings[0]
    is_frame = reading.geometry.rotation != IDENTITY
    is_of_winches = is_frame and (_are_of_factors(odd) or len(odd) == 1)
    return is_of_winches or (points is not None and MIN_IMPROVEMENT * points.misfit < reading.misfit)


def _is_hopeless(robot: Robot, recording: Recording, motion: MotionCheck) -> bool:
    """Whether winch travel explains nothing of a motion slow enough to follow the winches.

    Of positions that begin elsewhere :func:`require_matching_reeling` tells more.
    """
    rows = moving_rows(robot, recording)
    is_slow = rows is not None and np.isfinite(dynamic_amplification(robot, recording, rows))
    return is_slow and MAX_UNEXPLAINED < motion.misfit < np.inf and not _starts_far_away(robot, recording)


def _are_of_factors(odd: Sequence[OddWinch]) -> bool:
    return bool(odd) and all(each.is_factor for each in odd)


def _is_read_as_well(motion: MotionCheck | None, scale: AnchorScale) -> bool:
    """Whether other readings of the columns leave hardly more than a scale of the anchors does."""
    readings = motion.readings if motion is not None else ()
    return bool(readings) and readings[0].misfit <= EQUAL_RATIO * scale.misfit_left + EQUAL_DIFFERENCE


def describe_start(robot: Robot, start: Array) -> str:
    """Describe how far a start is from the robot file's."""
    return (
        f"{_start_distance(robot, start):.3g} m from the start in the robot file, "
        f"[{_position_text(robot.platform.start)}] m"
    )


def require_start_within_robot(robot: Robot, start: Array, where: str) -> None:
    """Raises RecordingError where a start is farther from the robot file's than the robot is large."""
    size = robot_size(robot)
    if _start_distance(robot, start) > size:
        raise RecordingError(
            where, f"{_start_text(robot, start)}, and the robot is no larger than {size:.3g} m", CONSISTENCY_HINT
        )


def require_matching_reeling(robot: Robot, recording: Recording, start: Array, where: str) -> None:
    """Refuse a recording that starts far away and whose winch travel does not match its positions.

    Raises RecordingError.
    """
    size = robot_size(robot)
    if _start_distance(robot, start) < MIN_CHECKED_START_SHARE * size:
        return
    reeled, mismatch = reeling_mismatch(robot, recording)
    if reeled > MIN_REELED_SHARE * size and mismatch > MAX_REELING_MISMATCH * reeled:
        mismatch_text = (
            f"winch travel does not match the positions: {reeled:.2g} m reeled, {mismatch:.2g} m rms mismatch"
        )
        raise RecordingError(where, f"{_start_text(robot, start)}, and {mismatch_text}", CONSISTENCY_HINT)


def reeling_mismatch(robot: Robot, recording: Recording) -> tuple[float, float]:
    """Winch travel, and its mismatch with the rope lengths at the recorded positions; rms in m.

    Omits the rows with the largest mismatch, since they may be outliers.
    """
    time, reeled = recording.time, recording.wound_lengths()
    rows = np.isfinite(recording.position).all(axis=1) & (time <= time[0] + CHECKED_DURATION)
    if robot.platform.is_rigid_body and recording.has_orientation:
        rows &= np.isfinite(recording.orientation).all(axis=1)
    if not rows.any():
        return 0.0, 0.0
    lengths = GeometryReading().directions(robot, recorded_poses(recording, np.flatnonzero(rows)))[0]
    reeled_length = reeled[rows] - reeled[rows][0]
    errors = reeled_length + lengths - np.median(lengths[:ROWS_AT_REST], axis=0)
    mean_squares = np.mean(errors**2, axis=1)
    inliers = mean_squares <= np.quantile(mean_squares, INLIER_QUANTILE)
    return _rms(reeled_length[inliers]), _rms(errors[inliers])


def _starts_far_away(robot: Robot, recording: Recording) -> bool:
    """Whether positions begin where :func:`require_matching_reeling` judges, and tells more."""
    return _distance_of_first(robot, recording) >= MIN_CHECKED_START_SHARE * robot_size(robot)


def _distance_of_first(robot: Robot, recording: Recording) -> float:
    """How far the first positions are from the robot file's start, m; 0 where there are none."""
    first = recording.position[np.isfinite(recording.position[:, robot.axes_in_plane]).all(axis=1)][:ROWS_AT_REST]
    start = np.where(np.isfinite(first), first, robot.platform.start)
    return _start_distance(robot, start.mean(axis=0)) if len(start) else 0.0


def _start_distance(robot: Robot, start: Array) -> float:
    return float(np.linalg.norm(start - np.array(robot.platform.start)))


def _start_text(robot: Robot, start: Array) -> str:
    return f"they begin at [{_position_text(start)}] m, {describe_start(robot, start)}"


def _position_text(position: Sequence[float] | Array) -> str:
    return ", ".join(f"{coordinate:.5g}" for coordinate in position)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
