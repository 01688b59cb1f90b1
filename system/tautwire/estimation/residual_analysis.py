"""Residual analysis: variance and whiteness of the innovations, with a floor below which nothing matters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .innovations import Innovations
from .policy import DEFAULT_POLICY, ResidualAnalysisPolicy

Array = NDArray[np.float64]

DEFAULT = DEFAULT_POLICY.residual_analysis


def residuals_are_white(
    innovations: Innovations, rows: NDArray[np.bool_], policy: ResidualAnalysisPolicy = DEFAULT
) -> bool:
    """Whether the residual is white noise: innovations no larger and no more correlated than independent noise.

    Of N innovations, per output and of all together: mean square at most ``1 + 4 sqrt(2 / N) + 0.03``. Mean square
    of the autocorrelations at lags 1 to 20 of m outputs of N samples: at most ``(1 + 4 sqrt(2 / 20 m)) / N + 0.03^2``.
    Significance alone is not enough: with many samples everything is significant; hence the last terms. An
    innovation that is not finite is not noise.
    """
    values, observed = innovations.values[rows], innovations.observed[rows]
    if not np.all(np.isfinite(values[observed])):
        return False
    lags = policy.autocorrelation_lags
    testable = np.sum(observed, axis=0) > lags
    counts = np.append(np.sum(observed, axis=0)[testable], np.sum(observed))
    squared = np.where(observed, np.nan_to_num(values) ** 2, 0.0)
    square_sums = np.append(np.sum(squared, axis=0)[testable], np.sum(squared))
    if np.any(
        square_sums / np.maximum(counts, 1)
        > 1.0 + policy.whiteness_sigmas * np.sqrt(2.0 / np.maximum(counts, 1)) + policy.negligible_deviation
    ):
        return False
    autocorrelations = [
        _autocorrelation(np.where(s, v, 0.0), lags)
        for v, s in zip(values.T[testable], observed.T[testable], strict=True)
    ]
    if not autocorrelations:
        return True
    mean_square = float(np.mean(np.square(autocorrelations)))
    chance_limit = (1.0 + policy.whiteness_sigmas * np.sqrt(2.0 / (lags * len(autocorrelations)))) / float(
        np.min(counts)
    )
    return mean_square <= chance_limit + policy.negligible_deviation**2


def largest_autocorrelations(
    innovations: Innovations, rows: NDArray[np.bool_], policy: ResidualAnalysisPolicy = DEFAULT
) -> tuple[Array, Array]:
    """Largest absolute autocorrelation of each output at lags 1 to 20, and the limit for white noise.

    Of N independent samples all 20 stay below ``3 / sqrt(N)`` nineteen times of twenty. Shapes (m,), NaN where too
    little is measured.
    """
    values, observed = innovations.values[rows], innovations.observed[rows]
    counts, lags = np.sum(observed, axis=0), policy.autocorrelation_lags
    largest = [
        np.max(np.abs(_autocorrelation(np.where(s, v, 0.0), lags))) if count > lags else np.nan
        for v, s, count in zip(values.T, observed.T, counts, strict=True)
    ]
    noise_limit = np.where(counts > lags, 3.0 / np.sqrt(np.maximum(counts, 1)), np.nan)
    return np.array(largest), noise_limit


def has_enough_samples(
    innovations: Innovations, rows: NDArray[np.bool_], policy: ResidualAnalysisPolicy = DEFAULT
) -> bool:
    """Whether there are enough samples for a residual analysis: at least 100 rows with something measured."""
    return int(np.sum(np.any(innovations.observed[rows], axis=1))) >= policy.min_samples


def _autocorrelation(values: Array, lags: int) -> Array:
    """Autocorrelation of a series, shape (N,), at the first lags."""
    power = max(float(values @ values), np.finfo(float).tiny)
    return np.array([values[lag:] @ values[:-lag] / power for lag in range(1, lags + 1)])
