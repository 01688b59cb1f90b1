"""Rows between the samples of a sensor slower than the log, and gaps of the sensor itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Rows without a number between samples of a slow sensor are no gap; more of its own intervals are.
MAX_INTERVALS = 5.0


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
