"""Columns of a filter's inputs: samples of a recording, with gaps in time filled and outputs of late sensors aligned.

What was measured late is moved to the sample whose state it shows.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..memoisation import memoised
from ..recordings.recording import Recording
from ..recordings.speed_interpolation import bent_by, speed_bends

Array = NDArray[np.float64]

# In medians of the sample interval.
MAX_STEP_TO_MEDIAN = 1.5


def align_delayed_outputs(time: Array, measured: Array, lags: Array) -> tuple[Array, Array]:
    """Align the outputs of sensors that lag with the state at each time: the sample nearest to time plus lag.

    Returns the values, NaN where there is none, and by how many seconds later than the state they were shown.
    """
    values, shift = measured.copy(), np.zeros_like(measured)
    half_interval = 0.5 * float(np.median(np.diff(time)))
    for column in np.flatnonzero(lags > half_interval):
        shown_at = time + lags[column]
        following = np.clip(np.searchsorted(time, shown_at), 1, len(time) - 1)
        nearest = np.where(shown_at - time[following - 1] < time[following] - shown_at, following - 1, following)
        is_near = np.abs(time[nearest] - shown_at) <= 2.0 * half_interval
        values[:, column] = np.where(is_near, measured[nearest, column], np.nan)
        shift[:, column] = np.where(is_near, time[nearest] - time, 0.0)
    return values, shift


def unaligned_samples(is_recorded: NDArray[np.bool_], is_aligned: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """As many cells (N, m) as recorded samples are aligned with no state: the last without one in their column."""
    unaligned = np.zeros_like(is_recorded)
    lost_counts = is_recorded.sum(axis=0) - is_aligned.sum(axis=0)
    for column in np.flatnonzero(lost_counts > 0):
        free_rows = np.flatnonzero(is_recorded[:, column] & ~is_aligned[:, column])
        unaligned[free_rows[-lost_counts[column] :], column] = True
    return unaligned


def filter_columns(
    recording: Recording, measured: Array, shift: Array, rotation_columns: int = 0
) -> tuple[tuple[Array, ...], NDArray[np.bool_]]:
    """The filter's inputs, a column a sample, and whether each is one of the recording's samples.

    The last ``rotation_columns`` of what was measured are rotation vectors, from which what is measured is zero. A gap
    in time is filled with samples without measurements, so that no step is longer than usual.
    """
    rows, interval_columns, is_recorded = _interval_columns(recording)
    measured_columns = np.zeros((measured.shape[1], len(is_recorded)), order="F")
    observed_columns, shift_columns = np.zeros_like(measured_columns), np.zeros_like(measured_columns)
    observed = np.isfinite(measured)
    measured_columns[:, rows] = np.where(observed, measured, 0.0).T
    observed_columns[:, rows] = observed.T
    shift_columns[:, rows] = shift.T
    rotation = np.asfortranarray(_without_gaps(measured_columns, observed_columns, rotation_columns))
    return (measured_columns, observed_columns, shift_columns, *interval_columns, rotation), is_recorded


# A fit runs over the same few recordings thousands of times.
@memoised(max_results=4)
def _interval_columns(recording: Recording) -> tuple[NDArray[np.int64], tuple[Array, ...], NDArray[np.bool_]]:
    """Which columns are samples of a recording, those of its winch speeds and times, and whether each is a sample."""
    steps = np.diff(recording.time)
    step_counts = np.maximum(np.ceil(steps / (MAX_STEP_TO_MEDIAN * np.median(steps))), 1).astype(int)
    rows = np.append(0, np.cumsum(step_counts))
    time = np.interp(np.arange(rows[-1] + 1), rows, recording.time)
    speed, bends = _speeds_in_parts(recording, step_counts)
    step = np.append(np.diff(time), 0.0)
    drift = step * np.append(np.repeat(steps, step_counts), 0.0)
    is_recorded = np.zeros(len(time), dtype=bool)
    is_recorded[rows] = True
    columns = (speed, np.hstack([speed[:, 1:], speed[:, -1:]]), bends, step[None, :], drift[None, :])
    return rows, tuple(np.asfortranarray(column) for column in columns), is_recorded


def _speeds_in_parts(recording: Recording, part_counts: NDArray[np.int64]) -> tuple[Array, Array]:
    """Winch speeds (n, K) where each step is divided into equal parts, and both bends (2n, K) of the parts.

    A polynomial's second derivative in a step is ``-4 b_0 - 2 b_1`` at its begin and ``2 b_0 + 4 b_1`` at its end, over
    the step squared, and linear between; a part of the fraction f bends by f^2 of that.
    """
    part, count = np.repeat(np.arange(len(part_counts)), part_counts), np.repeat(part_counts, part_counts)[:, None]
    first = np.concatenate([[0], np.cumsum(part_counts)[:-1]])
    fraction = (np.arange(len(part)) - first[part])[:, None] / count
    (begin, end), speed = speed_bends(recording), recording.winch_speed
    start, change = speed[:-1][part], np.diff(speed, axis=0)[part]
    begin, end = begin[part], end[part]
    speeds = start + fraction * change + bent_by(fraction, begin, end)

    def curvature(at: Array) -> Array:
        return -(4.0 - 6.0 * at) * begin - (2.0 - 6.0 * at) * end

    here, there = curvature(fraction), curvature(fraction + 1.0 / count)
    scale = 1.0 / (6.0 * count**2)
    bends = np.hstack([-scale * (2.0 * here + there), scale * (here + 2.0 * there)])
    return np.vstack([speeds, speed[-1:]]).T, np.vstack([bends, np.zeros_like(bends[:1])]).T


def _without_gaps(measured: Array, observed: Array, count: int) -> Array:
    """The last ``count`` rows (count, K) of what was measured, interpolated in gaps, and zero there from now on."""
    first = len(measured) - count
    rotation, samples = measured[first:].copy(), np.arange(measured.shape[1])
    measured[first:] = 0.0
    for row, is_observed in zip(rotation, observed[first:] > 0.0, strict=True):
        if np.any(is_observed):
            row[:] = np.interp(samples, samples[is_observed], row[is_observed])
    return rotation
