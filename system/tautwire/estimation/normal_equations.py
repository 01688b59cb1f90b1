"""Normal equations of whitened innovations, reduced to a few rows that least squares cannot tell from all of them.

With innovations ``e``, slopes ``J``, the norms ``D`` of its columns, and ``J' J = D V L V' D``: rows ``L^(1/2) V' D``
with residuals ``L^(-1/2) V' D^-1 J' e``, and one row without slope that makes up the sum of squares. Cost, gradient and
curvature are those of all rows; memory does not grow with a recording's length.

Source: Golub and Van Loan (2013), Matrix Computations, sec. 5.3.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from .estimation_data import DataSet
from .likelihood import Likelihood

Array = NDArray[np.float64]

# Of the largest eigenvalue: smaller ones are rounding errors.
MIN_EIGENVALUE_RATIO = 1e-13
# In succession, each a quarter of the last: a minimum within the last would be a small part of what they rise.
MAX_REJECTED_STEPS = 2


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


class StepsOnlyRiseError(Exception):
    """Each step leads up from the best point, and the last one hardly: there is nothing to gain between."""


class LeastSquares:
    """Least squares of residuals (m,) whose slopes (m, p) need not be their exact derivatives, from a start (p,).

    The slopes of innovations hold the filter's gain, so where they vanish is not quite where the cost is least. A
    trust-region method then rejects step after step until they are as short as numbers go. It ends here where the last
    of some rejected steps costs no more than ``cost_tolerance`` allows, a relative change of the cost.
    """

    def __init__(
        self,
        evaluate: Callable[[Array], tuple[Array, Array]],
        start: Array,
        cost_tolerance: float,
        max_evaluations: int,
    ) -> None:
        self._evaluate, self._cost_tolerance, self._max_evaluations = evaluate, cost_tolerance, max_evaluations
        self._evaluated_at, self._evaluated = start.copy(), evaluate(start)
        self._best_at, self._best = self._evaluated_at, self._evaluated
        self._accepted_cost, self._rejected_steps = np.inf, 0

    @property
    def has_finite_start(self) -> bool:
        """Whether a fit can begin at its start."""
        return bool(np.all(np.isfinite(self._best[0])))

    @property
    def cost(self) -> float:
        """Least half sum of squares that has been seen."""
        return _cost(self._best[0])

    @property
    def jacobian(self) -> Array:
        """Slopes at the best point (m, p)."""
        return self._best[1]

    def minimise(self, bounds: tuple[Array, Array]) -> Array:
        """The best point (p,) within bounds, lower and upper."""
        with suppress(StepsOnlyRiseError):
            least_squares(
                self._residuals_of_step,
                self._best_at,
                jac=self._jacobian_at,
                bounds=bounds,
                x_scale="jac",
                ftol=self._cost_tolerance,
                max_nfev=self._max_evaluations,
            )
        return self._best_at

    def _residuals_of_step(self, point: Array) -> Array:
        residuals, _ = self._at(point)
        cost = _cost(residuals)
        if cost < self.cost:
            self._best_at, self._best = self._evaluated_at, self._evaluated
        if cost < self._accepted_cost:
            self._accepted_cost, self._rejected_steps = cost, 0
            return residuals
        self._rejected_steps += 1
        if self._rejected_steps >= MAX_REJECTED_STEPS and cost - self._accepted_cost <= self._cost_tolerance * cost:
            raise StepsOnlyRiseError
        return residuals

    def _jacobian_at(self, point: Array) -> Array:
        return self._at(point)[1]

    def _at(self, point: Array) -> tuple[Array, Array]:
        if not np.array_equal(self._evaluated_at, point):
            self._evaluated_at, self._evaluated = point.copy(), self._evaluate(point)
        return self._evaluated


def _cost(residuals: Array) -> float:
    return 0.5 * float(residuals @ residuals)
