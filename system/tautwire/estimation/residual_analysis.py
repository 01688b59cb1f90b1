"""Residual analysis: variance and whiteness of the innovations, with a floor below which nothing matters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .likelihood import Innovations

Array = NDArray[np.float64]

WHITENESS_TEST_SIGMAS = 4.0
NEGLIGIBLE_DEVIATION = 0.03
AUTOCORRELATION_LAGS = 20
MIN_SAMPLES = 100


def residuals_are_white(innovations: Innovations, rows: NDArray[np.bool_]) -> bool:
    """Whether the residual is white noise: innovations no larger and no more correlated than independent noise.

    Of N innovations, per output and of all together: mean square at most ``1 + 4 sqrt(2 / N) + 0.03``. Mean square
    of the autocorrelations at lags 1 to 20 of m outputs of N samples: at most ``(1 + 4 sqrt(2 / 20 m)) / N + 0.03^2``.
    Significance alone is not enough: with many samples everything is significant; hence the last terms. An
    innovation that is not finite is not noise.
    """
    values, observed = innovations.values[rows], innovations.observed[rows]
    if not np.all(np.isfinite(values[observed])):
        return False
    testable = np.sum(observed, axis=0) > AUTOCORRELATION_LAGS
    counts = np.append(np.sum(observed, axis=0)[testable], np.sum(observed))
    squared = np.where(observed, np.nan_to_num(values) ** 2, 0.0)
    square_sums = np.append(np.sum(squared, axis=0)[testable], np.sum(squared))
    if np.any(
        square_sums / np.maximum(counts, 1)
        > 1.0 + WHITENESS_TEST_SIGMAS * np.sqrt(2.0 / np.maximum(counts, 1)) + NEGLIGIBLE_DEVIATION
    ):
        return False
    autocorrelations = [
        autocorrelation(np.where(s, v, 0.0)) for v, s in zip(values.T[testable], observed.T[testable], strict=True)
    ]
    if not autocorrelations:
        return True
    mean_square = float(np.mean(np.square(autocorrelations)))
    chance_limit = (
        1.0 + WHITENESS_TEST_SIGMAS * np.sqrt(2.0 / (AUTOCORRELATION_LAGS * len(autocorrelations)))
    ) / float(np.min(counts))
    return mean_square <= chance_limit + NEGLIGIBLE_DEVIATION**2


def largest_autocorrelations(innovations: Innovations, rows: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Largest absolute autocorrelation of each output at lags 1 to 20, and the limit for white noise.

    Of N independent samples all 20 stay below ``3 / sqrt(N)`` nineteen times of twenty. Shapes (m,), NaN where too
    little is measured.
    """
    values, observed = innovations.values[rows], innovations.observed[rows]
    counts = np.sum(observed, axis=0)
    largest = [
        np.max(np.abs(autocorrelation(np.where(s, v, 0.0)))) if count > AUTOCORRELATION_LAGS else np.nan
        for v, s, count in zip(values.T, observed.T, counts, strict=True)
    ]
    noise_limit = np.where(counts > AUTOCORRELATION_LAGS, 3.0 / np.sqrt(np.maximum(counts, 1)), np.nan)
    return np.array(largest), noise_limit


def has_enough_samples(innovations: Innovations, rows: NDArray[np.bool_]) -> bool:
    """Whether there are enough samples for a residual analysis: at least 100 rows with something measured."""
    return int(np.sum(np.any(innovations.observed[rows], axis=1))) >= MIN_SAMPLES


def autocorrelation(values: Array) -> Array:
    """Autocorrelation of a series, shape (N,), at lags 1 to 20."""
    power = max(float(values @ values), np.finfo(float).tiny)
    return np.array([values[lag:] @ values[:-lag] / power for lag in range(1, AUTOCORRELATION_LAGS + 1)])
