"""Normal equations of whitened innovations, reduced to a few rows that least squares cannot tell from all of them.

With innovations ``e``, slopes ``J``, the norms ``D`` of its columns, and ``J' J = D V L V' D``: rows ``L^(1/2) V' D``
with residuals ``L^(-1/2) V' D^-1 J' e``, and one row without slope that makes up the sum of squares. Cost, gradient and
curvature are those of all rows; memory does not grow with a recording's length.

Source: Golub and Van Loan (2013), Matrix Computations, sec. 5.3.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .estimation_data import DataSet
from .likelihood import Likelihood

Array = NDArray[np.float64]

# Of the largest eigenvalue: smaller ones are rounding errors.
MIN_EIGENVALUE_RATIO = 1e-13


def compressed_residuals(
    likelihood: Likelihood, values: Array, sample: DataSet, acceleration_noise_density: float
) -> tuple[Array, Array]:
    """Equivalent residuals (p + 1,) and slopes (p + 1, p) of all selected samples; not finite where one of them is not.

    A sample that a sensor delay leaves without a state counts as noise, as in the likelihood's innovations.
    """
    is_noise = likelihood.counted_as_noise(sample.recording, values)
    count = len(values)
    fisher_information, score, sum_of_squares = np.zeros((count, count)), np.zeros(count), 0.0
    next_row = 0
    for segment in likelihood.segments(sample.recording, values, acceleration_noise_density, keeps_covariances=False):
        segment_rows = slice(next_row, next_row + int(np.sum(segment.is_recorded)))
        next_row = segment_rows.stop
        rows = sample.rows[segment_rows, None]
        is_observed = segment.columns[1].T[segment.is_recorded] > 0.0
        is_selected = is_observed & rows
        residuals, slopes = (
            segment.results.values[segment.is_recorded][is_selected],
            segment.results.sensitivities[segment.is_recorded][is_selected],
        )
        fisher_information += slopes.T @ slopes
        score += slopes.T @ residuals
        sum_of_squares += float(residuals @ residuals) + float(np.sum(is_noise[segment_rows] & rows))
    return _equivalent_rows(fisher_information, score, sum_of_squares)


def _equivalent_rows(fisher_information: Array, score: Array, sum_of_squares: float) -> tuple[Array, Array]:
    count = len(score)
    if not (np.isfinite(sum_of_squares) and np.all(np.isfinite(fisher_information)) and np.all(np.isfinite(score))):
        return np.full(count + 1, np.nan), np.zeros((count + 1, count))
    scale = np.sqrt(np.maximum(np.diag(fisher_information), np.finfo(float).tiny))
    eigenvalues, eigenvectors = np.linalg.eigh(fisher_information / np.outer(scale, scale))
    eigenvalues = np.where(
        eigenvalues > MIN_EIGENVALUE_RATIO * max(float(eigenvalues[-1]), np.finfo(float).tiny), eigenvalues, 0.0
    )
    root = np.sqrt(eigenvalues)
    projected = np.divide(eigenvectors.T @ (score / scale), root, out=np.zeros(count), where=root > 0.0)
    unexplained = np.sqrt(max(sum_of_squares - float(projected @ projected), 0.0))
    slopes = root[:, None] * eigenvectors.T * scale
    return np.append(projected, unexplained), np.vstack([slopes, np.zeros((1, count))])


class NothingToGainError(Exception):
    """Steps that were rejected tell that there is no better point between: a fit ends at its best one."""


class StoppingRule:
    """Stopping rule for least squares of residuals (m,) whose slopes (m, p) need not be their exact derivatives.

    The slopes of innovations hold the filter's gain, so where they vanish is not quite where the cost is least. A
    trust-region method then rejects step after step, each a quarter as long, until they are as short as numbers go.
    ``residuals`` raise NothingToGainError where a parabola through the last two of these falls by no more than
    ``cost_tolerance``, a share of the cost. ``best_point`` (p,) is the one of least cost, at first the start.
    """

    def __init__(self, evaluate: Callable[[Array], tuple[Array, Array]], start: Array, cost_tolerance: float) -> None:
        self._evaluate, self._cost_tolerance = evaluate, cost_tolerance
        self._evaluated_at, self._evaluated = start.copy(), evaluate(start)
        self.best_point, self._best = self._evaluated_at, self._evaluated
        self._accepted_cost, self._last_rise = np.inf, np.nan

    @property
    def has_finite_start(self) -> bool:
        """Whether a fit can begin at its start."""
        return bool(np.all(np.isfinite(self._best[0])))

    @property
    def cost(self) -> float:
        """Least half sum of squares that has been seen."""
        return _cost(self._best[0])

    @property
    def best_jacobian(self) -> Array:
        """Slopes at the best point (m, p)."""
        return self._best[1]

    def residuals(self, point: Array) -> Array:
        """Residuals at the next step's end (m,)."""
        residuals, _ = self._at(point)
        cost = _cost(residuals)
        if cost < self.cost:
            self.best_point, self._best = self._evaluated_at, self._evaluated
        if cost < self._accepted_cost:
            self._accepted_cost, self._last_rise = cost, np.nan
            return residuals
        rise = cost - self._accepted_cost
        if _fall_between(self._last_rise, rise) <= self._cost_tolerance * self._accepted_cost:
            raise NothingToGainError
        self._last_rise = rise
        return residuals

    def jacobian(self, point: Array) -> Array:
        """Slopes at a point (m, p)."""
        return self._at(point)[1]

    def _at(self, point: Array) -> tuple[Array, Array]:
        if not np.array_equal(self._evaluated_at, point):
            self._evaluated_at, self._evaluated = point.copy(), self._evaluate(point)
        return self._evaluated


def _cost(residuals: Array) -> float:
    return 0.5 * float(residuals @ residuals)


def _fall_between(far_rise: float, near_rise: float) -> float:
    """How far a parabola falls below its start that has risen at a distance, and at a quarter of that.

    Infinite where that tells nothing: it is no valley, or one of them is no number.
    """
    slope, bend = (16.0 * near_rise - far_rise) / 3.0, 8.0 / 3.0 * (far_rise - 4.0 * near_rise)
    if not (np.isfinite(far_rise) and bend > 0.0):
        return np.inf
    return float(min(slope, 0.0) ** 2 / (2.0 * bend))
