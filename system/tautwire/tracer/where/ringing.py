"""A narrow peak that a residual force has and the platform's motion has not: something that swings by itself."""

from __future__ import annotations

from math import log

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SEGMENTS = 3
FEWEST, FEWEST_FREQUENCIES = 64, 5
# A peak rises by this factor over both its sides, in power.
PROMINENCE = 30.0
# Of the residual's power, what lies within a quarter of the peak's frequency.
SHARE, WIDTH = 0.3, 0.25


def ringing(time: Array, residual: Array, acceleration: Array, cutoff: float) -> float | None:
    """Frequency (Hz) below ``cutoff`` (rad/s) at which a residual force (N,) rings; None where it does not.

    The ratio of its power spectral density to that of the acceleration (N,) along it is that of a mass squared where
    a weight is wrong, falls steadily for what brakes, and has a peak for a body that swings.
    """
    # Imported here: it takes long to import, and only traces need it.
    from scipy.signal import detrend, find_peaks, peak_prominences, welch

    seen = np.isfinite(residual)
    if np.sum(seen) < FEWEST:
        return None
    step = float(np.median(np.diff(time)))
    even = np.arange(time[seen][0], time[seen][-1], step)
    length = 2 * len(even) // (SEGMENTS + 1)
    spectra = [
        welch(detrend(np.interp(even, time[seen], values[seen])), 1.0 / step, nperseg=length)
        for values in (residual, acceleration)
    ]
    frequency = np.asarray(spectra[0][0], dtype=float)
    below = (frequency > 0.0) & (2.0 * np.pi * frequency < cutoff)
    frequency, (rings, moves) = frequency[below], (np.asarray(power, dtype=float)[below] for _, power in spectra)
    if len(frequency) < FEWEST_FREQUENCIES or not (np.all(rings > 0.0) and np.all(moves > 0.0)):
        return None
    ratio = np.log(rings / moves)
    peaks = find_peaks(ratio, prominence=log(PROMINENCE))[0]
    for peak in peaks[np.argsort(-peak_prominences(ratio, peaks)[0])]:
        near = np.abs(frequency - frequency[peak]) <= max(WIDTH * frequency[peak], 1.5 * frequency[0])
        if np.sum(rings[near]) > SHARE * np.sum(rings):
            return float(np.sum(frequency[near] * rings[near]) / np.sum(rings[near]))
    return None
