"""First-order Sobol indices from any independent samples, by a polynomial chaos expansion without interactions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.hermite_e import hermevander
from numpy.typing import NDArray
from scipy.stats import norm

from .campaign_plan import LOGNORMAL, Distribution

Array = NDArray[np.float64]

MAX_DEGREE = 10
# With fewer samples for each term the leverages of single samples are too large for a fit.
SAMPLES_PER_TERM = 4
MAX_TERMS = 100
# A higher degree has to lower the leave-one-out error by this share.
MIN_IMPROVEMENT = 0.01
# Relative error of a fit to rounding, in terms of the variance of the output.
ROUNDING_ERROR = 1e-20
# Points at which polynomials are orthonormal, equally probable.
QUADRATURE_POINTS = 4096


@dataclass(frozen=True)
class FirstOrderIndices:
    """First-order Sobol indices (inputs,) of an output, and half the widths (inputs,) of their confidence intervals."""

    indices: Array
    half_widths: Array


@dataclass(frozen=True)
class _Expansion:
    """Least-squares fit: coefficients (terms,) without the constant, their covariance, residuals, their variance."""

    coefficients: Array
    covariance: Array
    residuals: Array
    residual_variance: float


def first_order_indices(
    distributions: Sequence[Distribution], inputs: Array, output: Array, confidence: float = 0.95
) -> FirstOrderIndices:
    """First-order Sobol indices by polynomial chaos (Sudret 2008), ``S_i = V_i / V`` with the variances V.

    ``y = c_0 + sum_ij c_ij P_ij(x_i) + e`` is fitted to ``inputs`` (samples, inputs) and ``output`` (samples,), with
    polynomials orthonormal under each distribution, and the degree with the smallest leave-one-out error; ``V_i`` is
    the sum over j of ``c_ij^2`` less the variance of their errors, V that of all inputs and of e. Intervals are those
    of linear error propagation, with a covariance that permits any heteroscedastic e, as interactions make it.
    """
    expansion, degree = _best_expansion(distributions, inputs, (output - output.mean()) / output.std())
    count = len(distributions)
    variances, errors = np.zeros(count), np.zeros(count)
    for index in range(count):
        terms = slice(index * degree, (index + 1) * degree)
        coefficients, covariance = expansion.coefficients[terms], expansion.covariance[terms, terms]
        spread = 2.0 * float(np.sum(covariance**2))
        variances[index] = coefficients @ coefficients - np.trace(covariance)
        errors[index] = max(4.0 * float(coefficients @ covariance @ coefficients) - spread, spread)
    total = np.maximum(variances, 0.0).sum() + expansion.residual_variance
    indices = variances / total
    squares = expansion.residuals**2
    other_errors = errors.sum() - errors + squares.var() / squares.size
    deviations = np.sqrt((1.0 - indices) ** 2 * errors + indices**2 * other_errors) / total
    return FirstOrderIndices(indices, float(norm.ppf(0.5 + confidence / 2.0)) * deviations)


def min_sample_count(input_count: int) -> int:
    """The number of samples with which a linear function of so many inputs can be fitted."""
    return SAMPLES_PER_TERM * input_count


def _best_expansion(distributions: Sequence[Distribution], inputs: Array, output: Array) -> tuple[_Expansion, int]:
    """The expansion, and its degree, with the smallest leave-one-out error; the lowest of those about as good."""
    max_terms = min(len(output) // SAMPLES_PER_TERM, MAX_TERMS)
    max_degree = max(1, min(MAX_DEGREE, max_terms // len(distributions)))
    bases = [_orthonormal(each, inputs[:, i], max_degree) for i, each in enumerate(distributions)]
    best, best_degree, least_error = np.zeros((0, 0)), 0, np.inf
    for degree in range(1, max_degree + 1):
        terms = np.column_stack([np.ones(len(output)), *(basis[:, :degree] for basis in bases)])
        error = _leave_one_out_error(terms, output)
        if not best_degree or error < (1.0 - MIN_IMPROVEMENT) * least_error - ROUNDING_ERROR:
            best, best_degree, least_error = terms, degree, error
    return _least_squares(best, output), best_degree


def _orthonormal(distribution: Distribution, values: Array, degree: int) -> Array:
    """Polynomials of degree 1 to ``degree`` at values (N,), shape (N, degree); in the logarithm of a lognormal."""
    points = distribution.quantile((np.arange(QUADRATURE_POINTS) + 0.5) / QUADRATURE_POINTS)
    if distribution.kind == LOGNORMAL:
        points, values = np.log(points), np.log(values)
    mean, deviation = points.mean(), points.std()
    _, triangle = np.linalg.qr(hermevander((points - mean) / deviation, degree) / np.sqrt(QUADRATURE_POINTS))
    return np.asarray(np.linalg.solve(triangle.T, hermevander((values - mean) / deviation, degree).T).T[:, 1:])


def _leave_one_out_error(terms: Array, output: Array) -> float:
    """Mean square error of each sample of ``output`` (N,) by a fit of ``terms`` (N, K) to the others."""
    orthogonal = np.linalg.qr(terms).Q
    residuals = output - orthogonal @ (orthogonal.T @ output)
    return float(np.mean((residuals / _leverage_complement(orthogonal)) ** 2))


def _least_squares(terms: Array, output: Array) -> _Expansion:
    """Fit of ``output`` (N,) by ``terms`` (N, K), the first of which is the constant; covariance HC2."""
    orthogonal, triangle = np.linalg.qr(terms)
    coefficients = np.linalg.solve(triangle, orthogonal.T @ output)
    residuals = output - orthogonal @ (orthogonal.T @ output)
    scores = np.linalg.solve(triangle, orthogonal.T) * (residuals / np.sqrt(_leverage_complement(orthogonal)))
    variance = float(residuals @ residuals) / (len(output) - len(coefficients))
    return _Expansion(coefficients[1:], (scores @ scores.T)[1:, 1:], residuals, variance)


def _leverage_complement(orthogonal: Array) -> Array:
    """One minus the leverage of each sample."""
    return np.asarray(np.maximum(1.0 - np.sum(orthogonal**2, axis=1), 1e-12))
