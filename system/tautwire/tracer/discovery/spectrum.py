"""Spectrum of the innovations: lines at frequencies that the model does not explain."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from ..likelihood import Innovations

Array = NDArray[np.float64]

# Zero padding, so that a line between two frequencies is not missed.
ZERO_PADDING_FACTOR = 4
# Least power of a line over the median of the frequencies about it.
MIN_LINE_POWER_RATIO = 12.0
FLOOR_HALF_WINDOW = 80
MAX_LINES = 4


def spectral_lines(time: Array, innovations: Innovations, rows: NDArray[np.bool_]) -> list[float]:
    """Angular frequencies (rad/s) of the strongest lines in the innovations, strongest first."""
    frequency, power = _power_spectrum(time[rows], innovations.values[rows], innovations.observed[rows])
    floor = np.array(
        [np.median(power[max(0, k - FLOOR_HALF_WINDOW) : k + FLOOR_HALF_WINDOW]) for k in range(len(power))]
    )
    ratio = power / np.maximum(floor, np.finfo(float).tiny)
    peaks, _ = find_peaks(ratio, height=MIN_LINE_POWER_RATIO, distance=2 * ZERO_PADDING_FACTOR)
    strongest = sorted(peaks, key=lambda place: -power[place])[:MAX_LINES]
    return [2.0 * np.pi * float(frequency[place]) for place in strongest]


def _power_spectrum(time: Array, values: Array, seen: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Frequencies (Hz) and power summed over the outputs, of samples taken as evenly spaced."""
    step = float(np.median(np.diff(time)))
    filled = np.where(seen, np.nan_to_num(values), 0.0)
    windowed = (filled - np.mean(filled, axis=0)) * np.hanning(len(filled))[:, None]
    power: Array = np.sum(np.abs(np.fft.rfft(windowed, ZERO_PADDING_FACTOR * len(filled), axis=0)) ** 2, axis=1)
    frequency: Array = np.asarray(np.fft.rfftfreq(ZERO_PADDING_FACTOR * len(filled), step), dtype=float)
    return frequency, power
