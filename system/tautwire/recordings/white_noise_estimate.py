"""Estimates the standard deviation of white noise on a smooth signal from its differences."""

from __future__ import annotations

from math import comb, sqrt

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

DIFFERENCE_ORDER = 6
NORMAL_ABSOLUTE_MEDIAN = 0.6745
# Files carry about seven digits, which bounds the noise from below.
RELATIVE_RESOLUTION = 1e-7


def white_noise_deviation(samples: Array) -> float:
    """Standard deviation of white noise on smooth signals, shape (N, k); the rms over columns, 1 where all are missing.

    The median of ``|D^6 y|`` over ``0.6745 sqrt(C(12, 6))``: sixth differences remove the smooth part of the
    signal, and the median is robust against outliers.
    """
    differences = (_absolute_differences(column) for column in samples.T)
    deviations = [
        float(np.median(column)) / (NORMAL_ABSOLUTE_MEDIAN * sqrt(comb(2 * DIFFERENCE_ORDER, DIFFERENCE_ORDER)))
        for column in differences
        if len(column)
    ]
    if not deviations:
        return 1.0
    return max(float(np.sqrt(np.mean(np.square(deviations)))), RELATIVE_RESOLUTION * float(np.nanmax(np.abs(samples))))


def _absolute_differences(column: Array) -> Array:
    """Finite absolute differences; of a sensor with a lower sample rate, those between its available samples."""
    differences = np.abs(np.diff(column, DIFFERENCE_ORDER))
    finite: Array = differences[np.isfinite(differences)]
    return finite if len(finite) else np.abs(np.diff(column[np.isfinite(column)], DIFFERENCE_ORDER))
