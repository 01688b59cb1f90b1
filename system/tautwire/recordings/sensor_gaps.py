"""Rows between the samples of a sensor slower than the log, and gaps of the sensor itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Rows without a number between samples of a slow sensor are no gap; more of its own intervals are.
MAX_INTERVALS = 5.0
# A sensor is slower than the log, and not interrupted, where at least the first share of rows is without a sample and
# of spans of so many samples at least the last share are equally long, to a row.
MIN_SHARE_BETWEEN, SPAN, MIN_EVEN_SHARE = 0.05, 20, 0.9


def bridge_short_gaps(time: Array, values: Array) -> Array:
    """Values (N,), or (N, k), on the lines through measured ones, NaN over more than five median intervals of these.

    For figures and means of a sensor slower than the log, whose samples have no measured neighbours.
    """
    if values.ndim > 1:
        return np.column_stack([bridge_short_gaps(time, column) for column in values.T])
    known = np.flatnonzero(np.isfinite(values))
    if known.size in (0, 1, values.size):
        return values
    intervals = np.diff(time[known])
    is_short = np.concatenate([[False], intervals <= MAX_INTERVALS * np.median(intervals), [False]])
    is_between = is_short[np.searchsorted(known, np.arange(values.size))]
    on_line = np.interp(time, time[known], values[known])
    return np.where(np.isfinite(values), values, np.where(is_between, on_line, np.nan))


def slower_rate(time: Array, values: Array) -> float | None:
    """Sampling rate in Hz of a sensor that is evenly slower than the log whose rows its values (N,) are on, else None.

    Over gaps longer than five of its own intervals no samples are expected.
    """
    known = np.flatnonzero(np.isfinite(values))
    if known.size <= SPAN:
        return None
    intervals = np.diff(time[known])
    is_short = intervals <= MAX_INTERVALS * np.median(intervals)
    rows = np.diff(known)
    spans = (known[SPAN:] - known[:-SPAN])[np.convolve(is_short, np.ones(SPAN), "valid") == SPAN]
    if not spans.size or 1.0 - np.count_nonzero(is_short) / rows[is_short].sum() < MIN_SHARE_BETWEEN:
        return None
    if np.mean(np.abs(spans - np.median(spans)) <= 1.0) < MIN_EVEN_SHARE:
        return None
    return float(np.count_nonzero(is_short) / intervals[is_short].sum())
