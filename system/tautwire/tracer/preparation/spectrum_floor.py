"""White noise floor of a sensor: the level of the upper part of its spectrum, and whether that is flat."""

from __future__ import annotations

from collections.abc import Sequence
from math import log

import numpy as np
from numpy.typing import NDArray
from scipy.signal import spectrogram

Array = NDArray[np.float64]

SEGMENT_SAMPLES, MIN_SPECTRUM_SAMPLES = 64, 300
# Bands from this share of the sampling rate to half of it, and their largest ratio for white noise.
MIN_FREQUENCY_RATIO, BAND_COUNT = 0.19, 5
MAX_BAND_RATIO = 1.7
# A low quantile over segments: in the louder ones the robot may jolt.
QUIET_SEGMENT_QUANTILE = 0.3


def noise_levels(signal: Array) -> Array | None:
    """Variances (5,) of white noise with the spectral level of a signal in five bands; the signal (N,) is equidistant.

    The signal is NaN where not measured. None where fewer than 300 samples are, or all are the same. Spectra of second
    differences, over ``(2 sin(pi f))^4``: slow motion does not leak into them. Of segments (Welch, 1967) the 0.3
    quantile, over that of an exponential distribution, ``-ln(0.7)``.
    """
    finite = signal[np.isfinite(signal)]
    if len(finite) < MIN_SPECTRUM_SAMPLES or not np.any(np.diff(finite)):
        return None
    frequency, _, segments = spectrogram(
        np.diff(finite, 2), window="hann", nperseg=SEGMENT_SAMPLES, noverlap=SEGMENT_SAMPLES // 2
    )
    density = np.quantile(segments, QUIET_SEGMENT_QUANTILE, axis=1) / -log(1.0 - QUIET_SEGMENT_QUANTILE)
    high = frequency >= MIN_FREQUENCY_RATIO
    level = density[high] / (2.0 * np.sin(np.pi * frequency[high])) ** 4
    # The last line (Nyquist) of a one-sided spectrum is not doubled.
    level[-1] *= 2.0
    bands = np.array([0.5 * float(np.mean(band)) for band in np.array_split(level, BAND_COUNT)])
    return bands if np.all(bands > 0.0) else None


def is_flat(levels: Sequence[Array]) -> bool:
    """Whether several spectra, each over its own mean, are flat in all bands on average."""
    shape = np.mean([level / np.mean(level) for level in levels], axis=0)
    return bool(np.max(shape) <= MAX_BAND_RATIO * np.min(shape))
