"""Motion of a platform whose winches all stand: ropes that change in length by far more than tension stretches them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import Robot
from .geometry_reading import GeometryReading, recorded_poses
from .recording import Recording
from .standing_winches import all_winches_stand
from .white_noise_estimate import white_noise_deviation

Array = NDArray[np.float64]

ROWS_USED, MIN_ROWS, INLIER_QUANTILE = 1000, 10, 0.95
# Rms of lengths to that of what tension stretches ropes by; to what the load does, where none was measured; to noise.
MIN_STRETCH_RATIO, MIN_LOAD_RATIO, MIN_NOISE_RATIO = 20.0, 8.0, 20.0
MIN_TAUT_SHARE = 0.2
MIN_LENGTH_SHARE = 0.003  # of a rope, which a survey and pulleys may be off by where the platform swings


def unwound_motion_text(robot: Robot, recording: Recording) -> str | None:
    """What is to be said of winches that stand throughout while the ropes' geometric lengths change, None otherwise.

    A taut rope on a winch that stands changes by ``L dT / (E A)``; all ropes have to change by far more, and where no
    tension was measured by far more than any load stretches them. A load that swings on one rope keeps the length of
    that. It is no error: hands lift platforms, and ropes creep. None where a rigid platform's orientation is not known.
    """
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
    rows = rows[:: max(1, rows.size // ROWS_USED)]
    lengths = GeometryReading().directions(robot, recorded_poses(recording, rows))[0]
    if not np.isfinite(lengths).all():
        return None
    noise = float(np.nan_to_num(white_noise_deviation(recording.position)))
    limits = np.maximum(_largest_changes(robot, recording.tension[rows], lengths), MIN_NOISE_RATIO * noise)
    limits = np.maximum(limits, MIN_LENGTH_SHARE * lengths.mean(axis=0))
    if np.any(_deviations(lengths) <= limits):
        return None
    return (
        f"all winches stand, and by the positions ropes change in length by up to {np.ptp(lengths, axis=0).max():.3g} "
        "m, far more than tension stretches them: the platform was held or lifted, ropes creep, or the columns of the "
        "winches are not of this motion"
    )


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
        elif taut.min() < MIN_TAUT_SHARE * np.median(taut):
            limits.append(np.inf)
        else:
            limits.append(MIN_STRETCH_RATIO * compliance * float(np.std(taut)))
    return np.array(limits)
