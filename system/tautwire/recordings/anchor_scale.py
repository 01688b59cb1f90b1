"""Exit points or attachments that are all off by one factor, which is no unit's, told by rope lengths."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from ..robot.schema import Point, Robot
from .geometry_reading import GeometryReading, RecordedPoses, recorded_poses
from .motion_regression import centred, moves_along_two_axes, moving_rows
from .recording import Recording

Array = NDArray[np.float64]

# Factors that are tried, and by how much one has to differ from 1: surveys are off by far less.
FACTORS, MIN_DIFFERENCE = np.geomspace(0.3, 3.0, 25), 0.08
# Misfit as declared, at least by its ratio to that which is left, and the misfit left.
MIN_MISFIT, MIN_IMPROVEMENT, MAX_LEFT = 0.015, 4.0, 0.025
# Of the ropes' motion to what was wound: beyond, other columns are in another unit too.
MAX_WINDING_ERROR = 0.15


@dataclass(frozen=True)
class AnchorScale:
    """Declared distances of points from their origin over the true ones, and misfits with and without the factor.

    The points are those of the ``key`` ``anchor`` or ``attachment``.
    """

    key: str
    factor: float
    misfit: float
    misfit_left: float


def anchor_scale(robot: Robot, recording: Recording) -> AnchorScale | None:
    """The factor on all anchors, or attachments, that explains how rope lengths miss what was wound; None without one.

    Misfit is the rms of the geometric lengths plus what was wound, times a common factor for drums, over that of the
    lengths about their means and drifts.
    """
    rows = moving_rows(robot, recording)
    if rows is None:
        return None
    poses, wound = recorded_poses(recording, rows), recording.wound_lengths()[rows]
    ramp = np.linalg.qr(np.column_stack([np.ones(len(rows)), recording.time[rows] - recording.time[rows[0]]]))[0]
    wound = wound - ramp @ (ramp.T @ wound)
    if not np.any(wound):
        return None
    declared = _misfit(robot, poses, wound, ramp)[0]
    if not declared > MIN_MISFIT or not _is_told(robot, poses):
        return None
    keys = ("anchor", "attachment") if robot.platform.is_rigid_body else ("anchor",)
    scales = [_best_scale(robot, poses, wound, ramp, key) for key in keys]
    told = [
        replace(each, misfit=declared) for each in scales if each and MIN_IMPROVEMENT * each.misfit_left <= declared
    ]
    return min(told, key=lambda each: each.misfit_left, default=None)


def _best_scale(robot: Robot, poses: RecordedPoses, wound: Array, ramp: Array, key: str) -> AnchorScale | None:
    """The scale of the points of a key with the least misfit; None where it is near 1, or misses too much."""

    def left(logarithm: float) -> float:
        return _misfit(_scaled_robot(robot, key, float(np.exp(logarithm))), poses, wound, ramp)[0]

    trials = np.log(FACTORS)
    first = int(np.argmin([left(trial) for trial in trials]))
    bounds = trials[max(first - 1, 0)], trials[min(first + 1, len(trials) - 1)]
    best = minimize_scalar(left, bounds=bounds, method="bounded", options={"xatol": 1e-3})
    factor = float(np.exp(best.x))
    misfit, winding = _misfit(_scaled_robot(robot, key, factor), poses, wound, ramp)
    is_other = abs(factor - 1.0) > MIN_DIFFERENCE and abs(winding - 1.0) <= MAX_WINDING_ERROR
    return AnchorScale(key, 1.0 / factor, misfit, misfit) if is_other and misfit <= MAX_LEFT else None


def _is_told(robot: Robot, poses: RecordedPoses) -> bool:
    return moves_along_two_axes(centred(GeometryReading().directions(robot, poses)[0]))


def _misfit(robot: Robot, poses: RecordedPoses, wound: Array, ramp: Array) -> tuple[float, float]:
    """Misfit, and the common factor on what was wound (M, n) with which it is least."""
    lengths = GeometryReading().directions(robot, poses)[0]
    lengths = lengths - ramp @ (ramp.T @ lengths)
    winding = -float(np.sum(lengths * wound) / np.sum(wound**2))
    energy = float(np.sum(lengths**2))
    if not np.isfinite(energy) or energy == 0.0:
        return np.inf, winding
    return float(np.sqrt(np.sum((lengths + winding * wound) ** 2) / energy)), winding


def _scaled_robot(robot: Robot, key: str, factor: float) -> Robot:
    if key == "anchor":
        cables = tuple(replace(cable, anchor=_scaled(cable.anchor, factor)) for cable in robot.cables)
    else:
        cables = tuple(replace(cable, attachment=_scaled(cable.attachment, factor)) for cable in robot.cables)
    return replace(robot, cables=cables)


def _scaled(point: Point, factor: float) -> Point:
    x, y, z = point
    return (factor * x, factor * y, factor * z)
