"""The white part of what a sensor shows: the upper half of its spectrum, and whether that is a floor."""

from __future__ import annotations

from collections.abc import Sequence
from math import log

import numpy as np
from numpy.typing import NDArray
from scipy.signal import spectrogram

Array = NDArray[np.float64]

SEGMENT, FEWEST = 64, 300
# Bands from this share of the sampling rate to half of it; those of white noise are alike.
LOWEST, BANDS = 0.19, 5
ALIKE = 1.7
# Of the segments, the quieter ones tell: in the others something may jolt.
QUIETER = 0.3


def noise_levels(signal: Array) -> Array | None:
    """Variances (5,) of white noise as high as a signal's spectrum in five bands; the signal (N,) is at even times.

    NaN where nothing was seen. None where fewer than 300 samples are, or most are the same. Spectra of second
    differences, over ``(2 sin(pi f))^4``: what moves slowly does not leak into them. Of segments (Welch, 1967) the 0.3
    quantile, over that of an exponential distribution, ``-ln(0.7)``.
    """
    seen = signal[np.isfinite(signal)]
    if len(seen) < FEWEST or not np.any(np.diff(seen)):
        return None
    frequency, _, segments = spectrogram(np.diff(seen, 2), window="hann", nperseg=SEGMENT, noverlap=SEGMENT // 2)
    density = np.quantile(segments, QUIETER, axis=1) / -log(1.0 - QUIETER)
    high = frequency >= LOWEST
    level = density[high] / (2.0 * np.sin(np.pi * frequency[high])) ** 4
    # The last line of a one-sided spectrum has no twin.
    level[-1] *= 2.0
    bands = np.array([0.5 * float(np.mean(band)) for band in np.array_split(level, BANDS)])
    return bands if np.all(bands > 0.0) else None


def is_flat(levels: Sequence[Array]) -> bool:
    """Whether several spectra, each over its own mean, are a floor: all bands of their mean alike."""
    shape = np.mean([level / np.mean(level) for level in levels], axis=0)
    return bool(np.max(shape) <= ALIKE * np.min(shape))
