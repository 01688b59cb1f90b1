"""95 % intervals by profile likelihood, where the surface about a fit is not round.

A value ``t`` of one parameter is inside while the others, at their best beside it, leave little more than the fit does:

    min over the others of S(t, others) - S(fit) <= 1.96^2

with ``S`` the sum of squares of the whitened innovations. Where ``S`` is a parabola the ends are 1.96 standard
deviations away. It is not where a parameter ends, and where it hardly shows: a relaxation's time, a drum's radius.

Source: Venzon and Moolgavkar (1988), A method for computing profile-likelihood-based confidence intervals, Applied
Statistics 37(1), 87-94.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, least_squares

from .data import Sample
from .fit import NORMAL_95, Fit, Fitter, bounds_of
from .hypotheses import Hypothesis
from .likelihood import Likelihood
from .preparation.compression import compressed

Array = NDArray[np.float64]

WITHIN = NORMAL_95**2
# Relative difference of the rise at both ends from that of a parabola, up to which the surface counts as round.
ROUND = 0.1
# Of the distance from the fit to an end.
PRECISION = 1e-3
# How often the distance is doubled in search of an end.
MOST_DOUBLINGS = 20
EVALUATIONS = 15


def intervals(fitter: Fitter, fit: Fit, chosen: Sequence[Hypothesis], sample: Sample) -> list[tuple[float, float]]:
    """Low and high end for each free parameter of the fit, which was made with ``chosen`` on the sample.

    An end is where the parameter's range ends if nothing tells before; infinite where neither does.
    """
    likelihood, _ = fitter.likelihood(fit.robot, chosen, sample)
    lower, upper = bounds_of(fit.robot, fit.free)
    surface = _Surface(likelihood, fit, sample, lower, upper, fitter.between)
    ends = []
    for index in range(len(fit.free)):
        low, high = (surface.end(index, side) for side in (-1.0, 1.0))
        ends.append((low, high))
    return ends


class _Surface:
    """Sum of squares about a fit, with one parameter held and the others at their best."""

    def __init__(
        self,
        likelihood: Likelihood,
        fit: Fit,
        sample: Sample,
        lower: Array,
        upper: Array,
        between: Callable[[], None],
    ) -> None:
        self._likelihood, self._fit, self._sample, self._between = likelihood, fit, sample, between
        self._lower, self._upper = lower, upper
        self._least = self._sum(fit.values)

    def end(self, index: int, side: float) -> float:
        """Where the interval of one parameter ends, below (-1) or above (1)."""
        middle, deviation = float(self._fit.values[index]), float(self._fit.deviations[index])
        bound = float((self._lower if side < 0.0 else self._upper)[index])
        reach = NORMAL_95 * deviation
        if not 0.0 < reach < np.inf:
            return middle
        inside, rise = 0.0, -WITHIN
        for _ in range(MOST_DOUBLINGS):
            reach = min(reach, abs(bound - middle))
            rise = self._rise(index, middle + side * reach) - WITHIN
            first = inside == 0.0 and reach == NORMAL_95 * deviation
            if first and abs(rise) < ROUND * WITHIN:
                return middle + side * reach
            if rise > 0.0:
                break
            if reach == abs(bound - middle):
                return bound
            inside, reach = reach, 2.0 * reach
        else:
            return side * np.inf

        def excess(distance: float) -> float:
            return self._rise(index, middle + side * distance) - WITHIN if distance > 0.0 else -WITHIN

        return middle + side * float(brentq(excess, inside, reach, xtol=PRECISION * reach, rtol=PRECISION))

    def _rise(self, index: int, value: float) -> float:
        """How much more is left with one parameter at a value; much, where the model has no finite output."""
        others = np.arange(len(self._fit.values)) != index
        if not np.any(others):
            return self._finite(self._sum(np.array([value])) - self._least)
        begun, deviations = self._beside(index, value), self._fit.deviations[others]
        deviations = np.where(deviations > 0.0, deviations, 1.0)
        residual = _Beside(self._rows, index, value, begun, deviations)
        start = np.zeros(len(begun))
        if not np.all(np.isfinite(residual.values(start))):
            return self._finite(np.inf)
        solution = least_squares(
            residual.values,
            start,
            jac=residual.slopes,
            bounds=((self._lower[others] - begun) / deviations, (self._upper[others] - begun) / deviations),
            max_nfev=EVALUATIONS,
        )
        return self._finite(2.0 * float(solution.cost) - self._least)

    def _beside(self, index: int, value: float) -> Array:
        """Where the others would be if the surface were round, within their ranges."""
        fit = self._fit
        moved = fit.values + fit.covariance[:, index] / fit.covariance[index, index] * (value - fit.values[index])
        return np.delete(np.clip(moved, self._lower, self._upper), index)

    def _sum(self, values: Array) -> float:
        residuals, _ = self._rows(values)
        return float(residuals @ residuals)

    def _rows(self, values: Array) -> tuple[Array, Array]:
        self._between()
        return compressed(self._likelihood, values, self._sample, 0.0)

    def _finite(self, rise: float) -> float:
        """Numbers that a root finder can work with."""
        return rise if np.isfinite(rise) else 1e3 * WITHIN


class _Beside:
    """Rows and their slopes by the other parameters, which count deviations from where they begin."""

    def __init__(
        self,
        rows: Callable[[Array], tuple[Array, Array]],
        index: int,
        held: float,
        begun: Array,
        deviations: Array,
    ) -> None:
        self._rows, self._index, self._held, self._begun, self._deviations = rows, index, held, begun, deviations
        self._at: Array | None = None
        self._found: tuple[Array, Array] = (np.zeros(0), np.zeros((0, 0)))

    def values(self, moved: Array) -> Array:
        return self._evaluate(moved)[0]

    def slopes(self, moved: Array) -> Array:
        return self._evaluate(moved)[1]

    def _evaluate(self, moved: Array) -> tuple[Array, Array]:
        if self._at is None or not np.array_equal(self._at, moved):
            residuals, slopes = self._rows(np.insert(self._begun + moved * self._deviations, self._index, self._held))
            self._found = residuals, np.delete(slopes, self._index, axis=1) * self._deviations
            self._at = moved.copy()
        return self._found
