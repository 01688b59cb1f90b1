"""Rope lengths by a tracker at the rows of a log whose winch columns have no scale yet."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar
from scipy.signal import correlation_lags

from .encoder_counts import MAX_MISFIT, MIN_CONTRAST, RopeScales, rope_scales
from .travel_correlation import TRAVEL_WINDOW, correlated, lowest_valleys, travel_on_grid

Array = NDArray[np.float64]

MIN_GRID_INTERVAL, MAX_GRID_POINTS = 0.02, 50_000  # s
MIN_SAMPLES, MAX_ROWS, TINY = 20, 50_000, np.finfo(float).tiny
# Share of the motion of the log or of the tracker that both have to have recorded.
MIN_MOTION_SHARE = 0.5
# Coarse misfits up to this are refined; scales of two offsets differ beyond the second.
MAX_COARSE_MISFIT, EQUAL_SCALES = 0.2, 0.02


def scales_by_tracker(
    log_time: Array, columns: Sequence[Array], tracker: tuple[Array, Array], cables: Sequence[int] | None
) -> RopeScales | None:
    """Scales of columns (N,) of a log at times (N,) by a ``tracker``'s times (M,) and rope lengths (M, n), in s and m.

    Offsets of the clock are compared by how well rope lengths regress on the columns, whatever the scale of each. None
    where no offset fits, or two fit with other scales.
    """
    rows = _thinned(np.asarray(np.isfinite(tracker[0]) & np.isfinite(tracker[1]).all(axis=1)))
    times, lengths = tracker[0][rows], tracker[1][rows]
    rows = _thinned(np.asarray(np.isfinite([log_time, *columns]).all(axis=0)))
    log_time, signals = log_time[rows], np.array([column[rows] for column in columns])
    is_rising = all(len(each) > MIN_SAMPLES and np.all(np.diff(each) > 0.0) for each in (times, log_time))
    if not is_rising:
        return None

    def scales_at(offset: float) -> RopeScales | None:
        return rope_scales(_at_rows(log_time + offset, times, lengths), list(signals), cables)

    def misfit_at(offset: float) -> float:
        scales = scales_at(offset)
        return MAX_MISFIT if scales is None else float(np.nanmean(scales.misfits))

    offsets, interval = _coarse_offsets(log_time, signals, times, lengths, cables)
    fits: list[RopeScales] = []
    for coarse in offsets:
        nearby = coarse + interval * np.linspace(-2.0, 2.0, 9)
        middle = min(nearby, key=misfit_at)
        bounds = (middle - 0.5 * interval, middle + 0.5 * interval)
        fit = scales_at(float(minimize_scalar(misfit_at, bounds=bounds, method="bounded").x))
        fits += [fit] if fit is not None else []
    fits.sort(key=lambda fit: float(np.nanmean(fit.misfits)))
    return fits[0] if fits and not any(_contradicts(fits[0], other) for other in fits[1:]) else None


def _thinned(is_measured: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Rows that were measured, of many evenly fewer."""
    rows = np.flatnonzero(is_measured)
    return rows[:: 1 + len(rows) // MAX_ROWS]


def _contradicts(best: RopeScales, other: RopeScales) -> bool:
    """Whether another offset fits almost as well with other cables or scales."""
    if np.nanmean(other.misfits) > MIN_CONTRAST * np.nanmean(best.misfits):
        return False
    is_alike = np.abs(other.scales - best.scales) <= EQUAL_SCALES * np.abs(best.scales)
    return not (np.array_equal(best.cables, other.cables) and is_alike[best.cables >= 0].all())


def _at_rows(row_times: Array, times: Array, lengths: Array) -> Array:
    """Rope lengths (N, n) at times (N,) by linear interpolation; NaN outside, and in gaps of the tracker."""
    at_rows = np.column_stack([np.interp(row_times, times, column) for column in lengths.T])
    after = np.clip(np.searchsorted(times, row_times), 1, len(times) - 1)
    is_known = times[after] - times[after - 1] <= max(TRAVEL_WINDOW, 2.0 * float(np.median(np.diff(times))))
    at_rows[~is_known | (row_times < times[0]) | (row_times > times[-1])] = np.nan
    return at_rows


def _coarse_offsets(
    log_time: Array, signals: Array, times: Array, lengths: Array, cables: Sequence[int] | None
) -> tuple[list[float], float]:
    """What to add to the log's times for the tracker's, where travels correlate best, and the grid's step, in s."""
    span = float(np.ptp(times) + np.ptp(log_time))
    steps = [float(np.median(np.diff(each))) for each in (times, log_time)]
    interval = max(MIN_GRID_INTERVAL, *steps, span / MAX_GRID_POINTS)
    of_log, is_logged = travel_on_grid(log_time, signals.T, interval)
    of_tracker, is_tracked = travel_on_grid(times, lengths, interval)
    # Columns may have any scales, and each counts alike; one that does not move fits nothing.
    of_log, of_tracker = (each / (np.linalg.norm(each, axis=0) + TINY) for each in (of_log, of_tracker))
    log_energies = [correlated(is_tracked, column**2) for column in of_log.T]
    tracker_energies = [correlated(column**2, is_logged) for column in of_tracker.T]

    def misfits_of(column: int, cable: int) -> Array:
        product = correlated(of_tracker[:, cable], of_log[:, column])
        energy = log_energies[column] * tracker_energies[cable]
        is_shared = np.maximum(log_energies[column], tracker_energies[cable]) >= MIN_MOTION_SHARE
        is_shared &= energy > np.finfo(float).eps
        return 1.0 - np.where(is_shared, product**2 / np.where(is_shared, energy, 1.0), 0.0)

    if cables is None:
        every_column = range(len(signals))
        best = [np.min([misfits_of(i, cable) for i in every_column], axis=0) for cable in range(lengths.shape[1])]
    else:
        best = [misfits_of(i, cable) for i, cable in enumerate(cables)]
    misfits = np.asarray(np.mean(best, axis=0))
    lags = correlation_lags(len(of_tracker), len(of_log))
    reach = round(TRAVEL_WINDOW / interval) + 1
    # The grids begin at the first times.
    begin = float(times[0] - log_time[0])
    return [begin + lags[index] * interval for index in lowest_valleys(misfits, MAX_COARSE_MISFIT, reach)], interval
