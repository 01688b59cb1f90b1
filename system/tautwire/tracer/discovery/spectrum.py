"""The spectrum of what a model leaves: frequencies at which something happens that it does not have."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from ..likelihood import Innovations

Array = NDArray[np.float64]

# Zeros beside the samples, so that a line between two frequencies is not missed.
PADDING = 4
# A line stands out where it has so many times the power of the frequencies about it.
STANDS_OUT = 12.0
NEIGHBOURS = 80
MOST_RHYTHMS = 4


def rhythms(time: Array, innovations: Innovations, rows: NDArray[np.bool_]) -> list[float]:
    """Angular frequencies (rad/s) of the strongest lines in the innovations, strongest first."""
    frequency, power = _power(time[rows], innovations.values[rows], innovations.seen[rows])
    floor = np.array([np.median(power[max(0, k - NEIGHBOURS) : k + NEIGHBOURS]) for k in range(len(power))])
    ratio = power / np.maximum(floor, np.finfo(float).tiny)
    places, _ = find_peaks(ratio, height=STANDS_OUT, distance=2 * PADDING)
    strongest = sorted(places, key=lambda place: -power[place])[:MOST_RHYTHMS]
    return [2.0 * np.pi * float(frequency[place]) for place in strongest]


def _power(time: Array, values: Array, seen: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Frequencies (Hz) and power summed over the outputs, of samples taken as evenly spaced."""
    step = float(np.median(np.diff(time)))
    known = np.where(seen, np.nan_to_num(values), 0.0)
    windowed = (known - np.mean(known, axis=0)) * np.hanning(len(known))[:, None]
    power: Array = np.sum(np.abs(np.fft.rfft(windowed, PADDING * len(known), axis=0)) ** 2, axis=1)
    frequency: Array = np.asarray(np.fft.rfftfreq(PADDING * len(known), step), dtype=float)
    return frequency, power
