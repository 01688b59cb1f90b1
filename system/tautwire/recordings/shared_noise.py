"""Noise that two recordings have in common: one was resampled, delayed or shifted from the other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from .recording import Recording
from .white_noise_estimate import NORMAL_ABSOLUTE_MEDIAN, white_noise_deviation

Array = NDArray[np.float64]

# Points of the common grid in an interval of the slower recording: a coarse grid tells copies at lower rates, a fine
# one those that lie between samples.
GRIDS = (1, 4)
SMOOTHING_INTERVALS, SMOOTHING_ORDER, MAX_SIGMAS = 9, 3, 3.0
MAX_MOTION_RATIO = 2.0
MIN_COMMON_INTERVALS, MIN_COMMON_SHARE, MAX_POINTS = 100, 0.6, 2**18


def noise_correlation(recording: Recording, other: Recording) -> float:
    """The largest correlation of what is faster than the motion, at any shift in time, as the median over outputs.

    Outputs less their local polynomials (Savitzky and Golay, 1964), clipped at three deviations so that jolts do not
    count. Noises of two recordings leave 0.3 at most, a resampled copy 0.75 or more.
    """
    return max(_correlation(recording, other, points) for points in GRIDS)


def _correlation(recording: Recording, other: Recording, points: int) -> float:
    interval = max(float(np.median(np.diff(each.time))) for each in (recording, other)) / points
    grids = [np.arange(each.time[0], each.time[-1], interval)[:MAX_POINTS] for each in (recording, other)]
    least = max(points * MIN_COMMON_INTERVALS, int(MIN_COMMON_SHARE * min(map(len, grids))))
    if min(map(len, grids)) < least:
        return 0.0
    window = points * SMOOTHING_INTERVALS | 1
    length = 1 << int(np.ceil(np.log2(sum(map(len, grids)))))
    overlap = _products(np.ones_like(grids[0]), np.ones_like(grids[1]), length)
    by_output = []
    for columns in zip(*(_outputs(each).T for each in (recording, other)), strict=True):
        mine, others = (
            _noise(each.time, column, grid, window)
            for each, column, grid in zip((recording, other), columns, grids, strict=True)
        )
        scale = float(np.sqrt(np.mean(mine**2) * np.mean(others**2)))
        noise = max(white_noise_deviation(column[:, None]) for column in columns)
        # Of a sensor that shows faster motion than the smoothing leaves out, two runs are alike.
        if scale > 0.0 and max(np.std(mine), np.std(others)) <= MAX_MOTION_RATIO * noise:
            by_output.append(_products(mine, others, length) / (np.maximum(overlap, least) * scale))
    if not by_output:
        return 0.0
    return float(np.max(np.median(by_output, axis=0)[overlap >= least], initial=0.0))


def _outputs(recording: Recording) -> Array:
    return np.hstack((recording.measured(), recording.orientation))


def _products(first: Array, second: Array, length: int) -> Array:
    """Sums of products at every circular shift, by the fast Fourier transform."""
    return np.asarray(np.fft.irfft(np.conj(np.fft.rfft(first, length)) * np.fft.rfft(second, length), length))


def _noise(time: Array, column: Array, grid: Array, window: int) -> Array:
    """What is faster than the motion on a grid, clipped; zeros of a column that is coarse or not measured."""
    is_measured = np.isfinite(column)
    if np.count_nonzero(is_measured) <= MIN_COMMON_INTERVALS:
        return np.zeros_like(grid)
    values = np.interp(grid, time[is_measured], column[is_measured])
    rest = values - savgol_filter(values, window, SMOOTHING_ORDER)
    deviation = float(np.median(np.abs(rest))) / NORMAL_ABSOLUTE_MEDIAN
    if not deviation > 0.0:
        return np.zeros_like(grid)
    return np.asarray(np.clip(rest, -MAX_SIGMAS * deviation, MAX_SIGMAS * deviation))
