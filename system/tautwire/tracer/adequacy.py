"""Is what is left noise: variance and whiteness of the innovations, with a floor below which nothing matters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .likelihood import Innovations

Array = NDArray[np.float64]

SIGMAS = 5.0
MATERIAL = 0.05
LAGS = 20


def is_noise(innovations: Innovations, rows: NDArray[np.bool_]) -> bool:
    """True where no output's innovations are larger or more alike than independent noise would be.

    Mean square at most ``1 + 5 sqrt(2 / N) + 0.05``; autocorrelation at lags 1 to 20 at most
    ``5 / sqrt(N) + 0.05``, per output. Significance alone is not asked for: with many samples everything is
    significant; hence the second term.
    """
    squares = innovations.mean_square(rows)
    counts = np.sum(innovations.seen[rows], axis=0)
    for output in np.flatnonzero(counts > LAGS):
        count = float(counts[output])
        if squares[output] > 1.0 + SIGMAS * np.sqrt(2.0 / count) + MATERIAL:
            return False
        values = np.where(innovations.seen[rows, output], innovations.values[rows, output], 0.0)
        if np.max(np.abs(autocorrelation(values))) > SIGMAS / np.sqrt(count) + MATERIAL:
            return False
    return True


def autocorrelation(values: Array) -> Array:
    """Correlation of a series, shape (N,), with itself at lags 1 to 20."""
    power = max(float(values @ values), np.finfo(float).tiny)
    return np.array([values[lag:] @ values[:-lag] / power for lag in range(1, LAGS + 1)])
