"""How much white noise lies on a smooth signal, told from the signal itself."""

from __future__ import annotations

from math import comb, sqrt

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

DIFFERENCES = 6
NORMAL_MEDIAN = 0.6745
# Files carry some seven digits: nothing is known better than that.
RESOLUTION = 1e-7


def roughness(samples: Array) -> float:
    """Standard deviation of white noise on smooth signals, shape (N, k); the mean over columns, 1 where unseen.

    The median of ``|D^6 y|`` over ``0.6745 sqrt(C(12, 6))``: differencing six times takes away what is smooth
    from one sample to the next, and the median passes over outliers.
    """
    differences = (_differences(column) for column in samples.T)
    deviations = [
        float(np.median(column)) / (NORMAL_MEDIAN * sqrt(comb(2 * DIFFERENCES, DIFFERENCES)))
        for column in differences
        if len(column)
    ]
    if not deviations:
        return 1.0
    return max(float(np.sqrt(np.mean(np.square(deviations)))), RESOLUTION * float(np.nanmax(np.abs(samples))))


def _differences(column: Array) -> Array:
    """Magnitudes of those that are seen; of a sensor that shows less often, from one seen sample to the next."""
    whole = np.abs(np.diff(column, DIFFERENCES))
    seen: Array = whole[np.isfinite(whole)]
    return seen if len(seen) else np.abs(np.diff(column[np.isfinite(column)], DIFFERENCES))
