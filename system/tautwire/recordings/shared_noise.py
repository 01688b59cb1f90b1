"""Noise that two recordings have in common: one was resampled, delayed or shifted from the other.

Source: Knapp and Carter (1976), IEEE Transactions on Acoustics, Speech, and Signal Processing 24(4), 320-327.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from .recording import Recording
from .white_noise_estimate import NORMAL_ABSOLUTE_MEDIAN

Array = NDArray[np.float64]

# Points of the common grid in an interval of the slower recording: a coarse grid tells copies at lower rates, a fine
# one those that lie between samples.
GRIDS = (1, 4)
SMOOTHING_INTERVALS, SMOOTHING_ORDER = 9, 3
# In cycles per interval of the slower recording: faster than what the smoothing leaves of a motion, slower than what an
# interpolation leaves of noise.
BAND = (0.12, 0.45)
# Jolts, which two runs of one program have in common, are all frequencies: they are clipped.
JOLT_SIGMAS = 3.0
MIN_COMMON_INTERVALS, MIN_COMMON_SHARE, MAX_POINTS = 100, 0.6, 2**18


def noise_correlation(recording: Recording, other: Recording) -> float:
    """The generalised cross-correlation with phase transform, the largest at any shift, as the median over outputs.

    Of outputs less their local polynomials (Savitzky and Golay, 1964), all frequencies counting alike: 1 for the same
    noise. A vibration that both recordings show is a few frequencies and counts little, though it be all of the power.
    Of 24 pairs of recordings two runs gave 0.10 at most, resampled copies 0.79 or more.
    """
    return max(_correlation(recording, other, points) for points in GRIDS)


def _correlation(recording: Recording, other: Recording, points: int) -> float:
    interval = max(float(np.median(np.diff(each.time))) for each in (recording, other)) / points
    grids = [np.arange(each.time[0], each.time[-1], interval)[:MAX_POINTS] for each in (recording, other)]
    least = max(points * MIN_COMMON_INTERVALS, int(MIN_COMMON_SHARE * min(map(len, grids))))
    if min(map(len, grids)) < least:
        return 0.0
    length = 1 << int(np.ceil(np.log2(sum(map(len, grids)))))
    spectra = [
        [_phases(each.time, column, grid, points, length) for column in _outputs(each).T]
        for each, grid in zip((recording, other), grids, strict=True)
    ]
    by_output = [
        np.fft.irfft(np.conj(mine) * others, length) * length / (2.0 * np.count_nonzero(mine))
        for mine, others in zip(*spectra, strict=True)
        if mine.any() and others.any()
    ]
    if not by_output:
        return 0.0
    ones = [np.fft.rfft(np.ones_like(grid), length) for grid in grids]
    overlap = np.fft.irfft(np.conj(ones[0]) * ones[1], length)
    return float(np.max(np.median(by_output, axis=0)[overlap >= least], initial=0.0))


def _outputs(recording: Recording) -> Array:
    return np.hstack((recording.measured(), recording.orientation))


def _phases(time: Array, column: Array, grid: Array, points: int, length: int) -> NDArray[np.complex128]:
    """Spectrum on a grid of what is faster than the motion, of modulus 1 in the band; zeros of one hardly measured."""
    is_measured = np.isfinite(column)
    if np.count_nonzero(is_measured) <= MIN_COMMON_INTERVALS:
        return np.zeros(length // 2 + 1, dtype=complex)
    values = np.interp(grid, time[is_measured], column[is_measured])
    noise = values - savgol_filter(values, points * SMOOTHING_INTERVALS | 1, SMOOTHING_ORDER)
    limit = JOLT_SIGMAS * float(np.median(np.abs(noise))) / NORMAL_ABSOLUTE_MEDIAN
    noise = np.clip(noise, -limit, limit) if limit > 0.0 else noise
    spectrum, frequency = np.fft.rfft(noise, length), np.fft.rfftfreq(length, 1.0 / points)
    size = np.where((frequency > BAND[0]) & (frequency < BAND[1]), np.abs(spectrum), 0.0)
    return np.divide(spectrum, size, out=np.zeros_like(spectrum), where=size > 0.0)
