"""Drift of each winch: the constant speed by which a rope's length runs away from what its winch is said to wind."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import Robot
from .clock_fit import OUTLIER_RATIO, ClockFit, TrackerClock
from .geometry_reading import GeometryReading, recorded_poses
from .motion_regression import moving_rows
from .recording import Recording

Array = NDArray[np.float64]

# Of what a length misses beside constant and scale, in squares, that a straight line has to explain: 0.69 at most on
# lifelike and exact recordings, 0.999 of an offset of 2 mm/s.
MIN_EXPLAINED_SHARE = 0.95


@dataclass(frozen=True)
class WinchDrift:
    """Cable, counted from 1, and the constant ``rate`` (m/s) at which its rope lengthens beside what was wound."""

    cable: int
    rate: float


def winch_drifts(robot: Robot, recording: Recording) -> tuple[WinchDrift, ...]:
    """The cables whose geometric length drifts steadily from what was wound, as an offset of a measured speed makes it.

    Least squares of each length, less its elongation by the measured tension, on constant, what was wound, and time.
    Ropes that creep drift as well; those whose length was recorded in place of a speed are not judged.
    """
    rows = moving_rows(robot, recording)
    if rows is None:
        return ()
    lengths = GeometryReading().directions(robot, recorded_poses(recording, rows))[0]
    if not np.isfinite(lengths).all():
        return ()
    start = TrackerClock(float(recording.time[0]))
    overlap = ClockFit(robot, recording, recording.time[rows], lengths).overlap(start)
    drifts = []
    for number, (wound, errors) in enumerate(zip(overlap.travel.T, overlap.errors.T, strict=True), 1):
        basis = np.column_stack([np.ones_like(wound), wound, overlap.times - overlap.times.mean()])
        squares = (errors - basis @ _least_squares(basis, errors)[0]) ** 2
        is_inlier = squares <= OUTLIER_RATIO * np.median(squares)
        basis, errors = basis[is_inlier], errors[is_inlier]
        coefficients, left = _least_squares(basis, errors)
        _, missed = _least_squares(basis[:, :2], errors)
        if number not in recording.rope_lengths and left < (1.0 - MIN_EXPLAINED_SHARE) * missed:
            drifts.append(WinchDrift(number, float(coefficients[-1])))
    return tuple(drifts)


def _least_squares(basis: Array, values: Array) -> tuple[Array, float]:
    """Coefficients, and the sum of the squares that they leave."""
    coefficients = np.asarray(np.linalg.lstsq(basis, values, rcond=None)[0], dtype=np.float64)
    return coefficients, float(np.sum((values - basis @ coefficients) ** 2))
