"""Estimates white noise on a smooth signal, and the step in which it was recorded, from its differences."""

from __future__ import annotations

from math import comb, sqrt

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

DIFFERENCE_ORDER = 6
NORMAL_ABSOLUTE_MEDIAN = 0.6745
# Files carry about seven digits, which bounds the noise from below.
RELATIVE_RESOLUTION = 1e-7
# Of third differences: the quantile that is a step, as bridged gaps have fractions of it, and the share that has to be
# whole steps within a fraction. Of differences of any size two in five would be; smaller ones are rounding errors.
SMALLEST_DIFFERENCE = 1e-9
STEP_QUANTILE, MIN_WHOLE_SHARE, MAX_FRACTION = 0.05, 0.9, 0.2
# One event leaves up to four of them, multiples of its size.
MIN_DIFFERENCES = 20


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


def quantization_step(signal: Array) -> float:
    """Quantization step of a signal (N,), as of counts or of too few digits; 0 where noise is larger, or there is none.

    The number of which third differences are whole multiples: first differences of a steady motion, and second ones of
    a steady acceleration, are multiples of their own size. Rounding has a standard deviation of step / sqrt(12).
    """
    differences = np.abs(np.diff(signal[np.isfinite(signal)], 3))
    differences = differences[differences > SMALLEST_DIFFERENCE]
    if len(differences) < MIN_DIFFERENCES:
        return 0.0
    step = float(np.quantile(differences, STEP_QUANTILE))
    multiples = differences / step
    is_whole = np.abs(multiples - np.round(multiples)) <= MAX_FRACTION
    return step if np.mean(is_whole) >= MIN_WHOLE_SHARE else 0.0
