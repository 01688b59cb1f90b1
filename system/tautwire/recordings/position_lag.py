"""Lag of recorded positions behind the winches of the same file: a clock, or a tracker that shows late."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import Robot
from .clock_fit import ClockFit, TrackerClock
from .geometry_reading import GeometryReading, recorded_poses
from .motion_regression import INLIER_QUANTILE, lowest_frequency, moving_rows, quasi_static_units
from .recording import Recording

Array = NDArray[np.float64]

MIN_SIGMAS, MIN_INTERVALS = 8.0, 2.0
# A platform lags behind its winches by ``2 zeta / omega``: damping ratios up to 0.05 are no clock.
MIN_PERIOD_SHARE = 0.1
# Rms that lengths miss beside each winch's scale and drift, with the lag over that without.
MAX_RESIDUAL_SHARE = 0.5


@dataclass(frozen=True)
class PositionLag:
    """Lag in s of positions behind the winches, negative where they are ahead, and its standard deviation.

    ``rms_before`` and ``rms_after``, in m, are what rope lengths and winch travel differ by, without and with it.
    """

    seconds: float
    deviation: float
    rms_before: float
    rms_after: float


def position_lag(robot: Robot, recording: Recording) -> PositionLag | None:
    """The lag where it is significant and explains most of what rope lengths and winch travel differ by; else None.

    Time-delay estimation as of a tracker's clock, which each winch's scale and drift do not affect. None too of a
    motion that makes the platform swing, of a lag that damping makes, and where a pose lies in a pulley.
    """
    rows = moving_rows(robot, recording)
    if rows is None or "m" not in quasi_static_units(robot, recording, rows).get("s", ()):
        return None
    lengths = GeometryReading().directions(robot, recorded_poses(recording, rows))[0]
    natural = lowest_frequency(robot, "m")
    if not (natural > 0.0 and np.isfinite(lengths).all()):
        return None
    fit, start = ClockFit(robot, recording, recording.time[rows], lengths), float(recording.time[0])
    alignment = fit.converged(start, is_rate_free=False)
    if alignment is None:
        return None
    seconds, deviation = alignment.clock.offset - start, alignment.clock.deviation
    least = (
        MIN_SIGMAS * deviation,
        MIN_INTERVALS * _position_interval(recording),
        MIN_PERIOD_SHARE / natural,
    )
    rms_before, rms_after = (_rms(fit, clock) for clock in (TrackerClock(start), alignment.clock))
    if abs(seconds) <= max(least) or rms_after > MAX_RESIDUAL_SHARE * rms_before:
        return None
    return PositionLag(seconds, deviation, rms_before, rms_after)


def _position_interval(recording: Recording) -> float:
    """Median time in s between rows in which another position was measured than in the row before."""
    time = recording.time[np.isfinite(recording.position).any(axis=1)]
    position = np.nan_to_num(recording.position[np.isfinite(recording.position).any(axis=1)])
    is_new = np.any(np.diff(position, axis=0) != 0.0, axis=1)
    return float(np.median(np.diff(time[1:][is_new])))


def _rms(fit: ClockFit, clock: TrackerClock) -> float:
    """Rms of what lengths miss beside scales and drifts, in m, without the twentieth of rows that err most."""
    overlap = fit.overlap(clock)
    squares = np.sum(overlap.without_nuisances(overlap.errors) ** 2, axis=1)
    return float(np.sqrt(squares[squares <= np.quantile(squares, INLIER_QUANTILE)].mean() / overlap.errors.shape[1]))
