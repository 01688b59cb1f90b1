"""Exit points that are all too far or too near by one factor, which is no unit's, told by rope lengths."""

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
MIN_MISFIT, MIN_IMPROVEMENT, MAX_LEFT = 0.01, 4.0, 0.025
# Of the ropes' motion to what was wound: beyond, other columns are in another unit too.
MAX_WINDING_ERROR = 0.15


@dataclass(frozen=True)
class AnchorScale:
    """Declared distance of exit points from the origin over the true one, and misfits with and without it."""

    factor: float
    misfit: float
    misfit_left: float


def anchor_scale(robot: Robot, recording: Recording) -> AnchorScale | None:
    """The factor on all exit points that explains how rope lengths differ from what was wound; None where none does.

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
    declared = _misfit(robot, poses, wound, ramp, 1.0)[0]
    if not declared > MIN_MISFIT or not _is_told(robot, poses):
        return None

    def left(logarithm: float) -> float:
        return _misfit(robot, poses, wound, ramp, float(np.exp(logarithm)))[0]

    trials = np.log(FACTORS)
    first = int(np.argmin([left(trial) for trial in trials]))
    bounds = trials[max(first - 1, 0)], trials[min(first + 1, len(trials) - 1)]
    best = minimize_scalar(left, bounds=bounds, method="bounded", options={"xatol": 1e-3})
    factor = float(np.exp(best.x))
    misfit, winding = _misfit(robot, poses, wound, ramp, factor)
    is_other = abs(factor - 1.0) > MIN_DIFFERENCE and abs(winding - 1.0) <= MAX_WINDING_ERROR
    if is_other and misfit <= min(MAX_LEFT, declared / MIN_IMPROVEMENT):
        return AnchorScale(1.0 / factor, declared, misfit)
    return None


def _is_told(robot: Robot, poses: RecordedPoses) -> bool:
    return moves_along_two_axes(centred(GeometryReading().directions(robot, poses)[0]))


def _misfit(robot: Robot, poses: RecordedPoses, wound: Array, ramp: Array, factor: float) -> tuple[float, float]:
    """Misfit with the anchors times a factor, and the common factor on what was wound (M, n) with which it is least."""
    lengths = GeometryReading().directions(_with_anchors_scaled(robot, factor), poses)[0]
    lengths = lengths - ramp @ (ramp.T @ lengths)
    winding = -float(np.sum(lengths * wound) / np.sum(wound**2))
    energy = float(np.sum(lengths**2))
    if not np.isfinite(energy) or energy == 0.0:
        return np.inf, winding
    return float(np.sqrt(np.sum((lengths + winding * wound) ** 2) / energy)), winding


def _with_anchors_scaled(robot: Robot, factor: float) -> Robot:
    cables = tuple(replace(cable, anchor=_scaled(cable.anchor, factor)) for cable in robot.cables)
    return replace(robot, cables=cables)


def _scaled(point: Point, factor: float) -> Point:
    x, y, z = point
    return (factor * x, factor * y, factor * z)
