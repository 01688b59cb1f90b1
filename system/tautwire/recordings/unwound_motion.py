"""Motion of a platform whose winches all stand: ropes that change in length by far more than tension stretches them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from ..errors import RecordingError
from ..robot.schema import Robot
from .geometry_reading import GeometryReading, recorded_poses
from .recording import Recording
from .standing_winches import all_winches_stand
from .white_noise_estimate import white_noise_deviation

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

ROWS_USED, MIN_ROWS, INLIER_QUANTILE = 1000, 10, 0.95
# Rms of lengths to that of what tension stretches ropes by; to what the load does, where none was measured; to noise.
MIN_STRETCH_RATIO, MIN_LOAD_RATIO, MIN_NOISE_RATIO = 20.0, 8.0, 20.0
MIN_TAUT_SHARE = 0.2
MIN_LENGTH_SHARE = 0.003  # of a rope, which a survey and pulleys may be off by where the platform swings
# Rows of a median, in which outliers of a tracker are left out.
OUTLIER_ROWS = 5
# Share of the lengths' range that ropes get back; correlation of each length with its tension, where ropes are softer.
MIN_RETURN, MIN_SOFT_CORRELATION = 0.3, 0.7


def unwound_motion_text(robot: Robot, recording: Recording) -> str | None:
    """What is to be said of winches that stand throughout while the ropes' geometric lengths change, None otherwise.

    A taut rope on a winch that stands changes by ``L dT / (E A)``; all ropes have to change by far more, and where no
    tension was measured by far more than any load stretches them. A load that swings on one rope keeps the length of
    that. By itself it is no error: hands lift platforms, and ropes creep. None where the orientation of a rigid
    platform is not known.
    """
    unwound = _unwound_lengths(robot, recording)
    if unwound is None:
        return None
    largest = float(np.ptp(unwound[1], axis=0).max())
    return (
        f"all winches stand, and by the positions ropes change in length by up to {largest:.3g} "
        "m, far more than tension stretches them: the platform was held or lifted, ropes creep, or the columns of the "
        "winches are not of this motion"
    )


def unwound_motion_error(robot: Robot, recording: Recording) -> RecordingError | None:
    """The error of winch speeds that are all zero while ropes that are taut grow and shrink; None without one.

    Hands that lift a platform let ropes hang, creep gives nothing back, and ropes that are softer than declared follow
    their tension: none of these is an error, and speeds within their noise are none.
    """
    unwound = None if recording.winch_speed.any() else _unwound_lengths(robot, recording)
    if unwound is None:
        return None
    rows, lengths = unwound
    measured = np.isfinite(recording.tension[rows]).all(axis=1)
    lengths, tension = median_filter(lengths[measured], (OUTLIER_ROWS, 1)), recording.tension[rows[measured]]
    if len(tension) < MIN_ROWS or not all(_is_taut(column) for column in tension.T):
        return None
    returned = np.maximum.accumulate(lengths, axis=0) - lengths
    if np.any(returned.max(axis=0) < MIN_RETURN * np.ptp(lengths, axis=0)):
        return None
    changes, pulls = lengths - lengths.mean(axis=0), tension - tension.mean(axis=0)
    correlations = np.sum(changes * pulls, axis=0) / np.sqrt(np.sum(changes**2, axis=0) * np.sum(pulls**2, axis=0))
    if np.all(correlations > MIN_SOFT_CORRELATION):
        return None
    problem = (
        f"no winch turns, and taut ropes change in length by up to {np.ptp(lengths, axis=0).max():.3g} m by "
        "the positions, far more than tension stretches them"
    )
    return RecordingError(
        recording.path, problem, "the columns of the winches are not of this motion: log their speeds"
    )


def _unwound_lengths(robot: Robot, recording: Recording) -> tuple[Rows, Array] | None:
    """Rows (M,) and lengths (M, n) that change by far more than winches that stand allow; None where they do not."""
    rows = _complete_rows(robot, recording)
    if rows is None:
        return None
    lengths = GeometryReading().directions(robot, recorded_poses(recording, rows))[0]
    if not np.isfinite(lengths).all():
        return None
    noise = float(np.nan_to_num(white_noise_deviation(recording.position)))
    limits = np.maximum(_largest_changes(robot, recording.tension[rows], lengths), MIN_NOISE_RATIO * noise)
    limits = np.maximum(limits, MIN_LENGTH_SHARE * lengths.mean(axis=0))
    return None if np.any(_deviations(lengths) <= limits) else (rows, lengths)


def _complete_rows(robot: Robot, recording: Recording) -> Rows | None:
    """Rows with a whole pose, (M,), while all winches stand; None where one turns, or poses are too few."""
    is_rigid = robot.platform.is_rigid_body
    if (
        not all_winches_stand(robot, recording)
        or not recording.has_position
        or (is_rigid and not recording.has_orientation)
    ):
        return None
    measured = recording.position[:, np.isfinite(recording.position).any(axis=0)]
    pose = np.hstack([measured, recording.orientation]) if is_rigid else measured
    rows = np.flatnonzero(np.isfinite(pose).all(axis=1))
    if rows.size < MIN_ROWS or measured.shape[1] < len(robot.axes_in_plane):
        return None
    return rows[:: max(1, rows.size // ROWS_USED)]


def _deviations(values: Array) -> Array:
    """Rms of each column (M, n) about its median, (n,), without the twentieth of values that is farthest out."""
    errors = np.abs(values - np.median(values, axis=0))
    inliers = np.where(errors <= np.quantile(errors, INLIER_QUANTILE, axis=0), errors, 0.0)
    return np.asarray(np.sqrt(np.mean(inliers**2, axis=0)))


def _largest_changes(robot: Robot, tension: Array, lengths: Array) -> Array:
    """What each rope's length may change by on a winch that stands, (n,) in m; endless where it was slack."""
    preferred = 0.0 if robot.tension is None else robot.tension.preferred
    load = max(robot.platform.mass * robot.gravity / robot.cable_count, preferred)
    limits = []
    for rope, column, length in zip(robot.cables, tension.T, lengths.mean(axis=0), strict=True):
        compliance, taut = length / (rope.modulus * rope.area), column[np.isfinite(column)]
        if taut.size < MIN_ROWS or not np.ptp(taut):
            limits.append(MIN_LOAD_RATIO * compliance * load)
        elif not _is_taut(taut):
            limits.append(np.inf)
        else:
            limits.append(MIN_STRETCH_RATIO * compliance * float(np.std(taut)))
    return np.array(limits)


def _is_taut(tension: Array) -> bool:
    """Whether a rope's measured tensions (M,) never come close to zero; False where all are the same."""
    return bool(np.ptp(tension) > 0.0 and tension.min() >= MIN_TAUT_SHARE * np.median(tension) > 0.0)
