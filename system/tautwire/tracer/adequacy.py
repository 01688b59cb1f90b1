"""Is what is left noise: variance and whiteness of the innovations, with a floor below which nothing matters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .likelihood import Innovations

Array = NDArray[np.float64]

SIGMAS = 4.0
MATERIAL = 0.03
LAGS = 20
FEWEST = 100


def is_noise(innovations: Innovations, rows: NDArray[np.bool_]) -> bool:
    """True where the innovations are neither larger nor more alike than independent noise would be.

    Of N innovations, per output and of all together: mean square at most ``1 + 4 sqrt(2 / N) + 0.03``. Mean square
    of the autocorrelations at lags 1 to 20 of m outputs of N samples: at most ``(1 + 4 sqrt(2 / 20 m)) / N + 0.03^2``.
    Significance alone is not asked for: with many samples everything is significant; hence the last terms. An
    innovation that is not finite is not noise.
    """
    values, seen = innovations.values[rows], innovations.seen[rows]
    if not np.all(np.isfinite(values[seen])):
        return False
    used = np.sum(seen, axis=0) > LAGS
    counts = np.append(np.sum(seen, axis=0)[used], np.sum(seen))
    squares = np.where(seen, np.nan_to_num(values) ** 2, 0.0)
    sums = np.append(np.sum(squares, axis=0)[used], np.sum(squares))
    if np.any(sums / np.maximum(counts, 1) > 1.0 + SIGMAS * np.sqrt(2.0 / np.maximum(counts, 1)) + MATERIAL):
        return False
    correlated = [autocorrelation(np.where(s, v, 0.0)) for v, s in zip(values.T[used], seen.T[used], strict=True)]
    if not correlated:
        return True
    average = float(np.mean(np.square(correlated)))
    chance = (1.0 + SIGMAS * np.sqrt(2.0 / (LAGS * len(correlated)))) / float(np.min(counts))
    return average <= chance + MATERIAL**2


def largest_autocorrelations(innovations: Innovations, rows: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Of each output the largest correlation with itself at lags 1 to 20, whatever its sign, and that of noise.

    Of N independent samples all 20 stay below ``3 / sqrt(N)`` nineteen times of twenty. Shapes (m,), NaN where too
    little is seen.
    """
    values, seen = innovations.values[rows], innovations.seen[rows]
    counts = np.sum(seen, axis=0)
    largest = [
        np.max(np.abs(autocorrelation(np.where(s, v, 0.0)))) if count > LAGS else np.nan
        for v, s, count in zip(values.T, seen.T, counts, strict=True)
    ]
    of_noise = np.where(counts > LAGS, 3.0 / np.sqrt(np.maximum(counts, 1)), np.nan)
    return np.array(largest), of_noise


def enough_samples(innovations: Innovations, rows: NDArray[np.bool_]) -> bool:
    """Whether there is enough to tell noise from more: at least 100 rows with something measured."""
    return int(np.sum(np.any(innovations.seen[rows], axis=1))) >= FEWEST


def autocorrelation(values: Array) -> Array:
    """Correlation of a series, shape (N,), with itself at lags 1 to 20."""
    power = max(float(values @ values), np.finfo(float).tiny)
    return np.array([values[lag:] @ values[:-lag] / power for lag in range(1, LAGS + 1)])
