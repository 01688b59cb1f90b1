"""The sum of squares about a fit, with one parameter held and the others at their best."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ..errors import TautwireError
from .data import Sample
from .fit import Fit, sizes_of
from .likelihood import Likelihood
from .preparation.compression import compressed

Array = NDArray[np.float64]

# What counts as much, where the model has no finite output.
MUCH = 1e4
# A fall below the fit that its stop does not explain.
LOWER = 0.1
# Runs over the sample, in all and in one fit of the others; and the least distance from bounds, in deviations.
MOST_RUNS, RUNS_OF_A_FIT, INSIDE = 300, 15, 1e-6


class LowerError(TautwireError):
    """Other values leave less than the fit does; carries them."""

    def __init__(self, values: Array) -> None:
        self.values = values
        super().__init__(f"the fit is not the best: {values.tolist()} leaves less")


class TooManyRunsError(TautwireError):
    """The surface has been looked at more often than it is worth; carries how often."""

    def __init__(self, runs: int) -> None:
        self.runs = runs
        super().__init__(f"{runs} runs have not found where an interval ends")


class Surface:
    """Sums of squares of the whitened innovations about a fit of ``values``, which stay within ``lower`` and ``upper``.

    ``sizes`` (p,) are what the parameters are measured by; ``deviations`` (p,) are zero where the curvature tells none.
    """

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
        self.values = fit.values
        self.sizes = sizes_of(fit.robot, fit.free)
        variances = np.diag(fit.covariance)
        self.deviations = np.sqrt(np.where(np.isfinite(variances), np.maximum(variances, 0.0), 0.0))
        self._units = np.where(self.deviations > 0.0, self.deviations, self.sizes)
        self._runs = 0
        self._least = float(np.sum(self._rows(fit.values)[0] ** 2))

    def about(self, values: Array) -> Surface:
        """The same about other values."""
        moved = replace(self._fit, values=values)
        return Surface(self._likelihood, moved, self._sample, self._lower, self._upper, self._between)

    def rise(self, index: int, value: float) -> float:
        """How much more is left with one parameter at a value; much, where the model has no finite output.

        Raises LowerError, TooManyRunsError.
        """
        others = np.arange(len(self.values)) != index
        if not np.any(others):
            return self._told(float(np.sum(self._rows(np.array([value]))[0] ** 2)), np.array([value]))
        for begun in (self._on_the_line(index, value), self.values):
            found = self._fitted(index, value, begun[others], others)
            if found is not None:
                return found
        return MUCH

    def _fitted(self, index: int, value: float, begun: Array, others: NDArray[np.bool_]) -> float | None:
        units = self._units[others]
        low, high = (self._lower[others] - begun) / units, (self._upper[others] - begun) / units
        start = np.clip(np.zeros(len(begun)), np.minimum(low + INSIDE, 0.5 * (low + high)), high)
        start = np.clip(start, low, np.maximum(high - INSIDE, 0.5 * (low + high)))
        residual = _Held(self._rows, index, value, begun, units)
        if not np.all(np.isfinite(residual.values(start))):
            return None
        solution = least_squares(
            residual.values,
            start,
            jac=residual.slopes,
            bounds=(low, high),
            x_scale="jac",
            ftol=1e-6,
            max_nfev=RUNS_OF_A_FIT,
        )
        return self._told(2.0 * float(solution.cost), np.insert(begun + solution.x * units, index, value))

    def _told(self, found: float, values: Array) -> float:
        rise = found - self._least
        if rise < -LOWER:
            raise LowerError(values)
        return rise if np.isfinite(rise) else MUCH

    def _on_the_line(self, index: int, value: float) -> Array:
        """Where the others would be if the surface were round, within their ranges."""
        variance = self._fit.covariance[index, index]
        slopes = self._fit.covariance[:, index] / variance if variance > 0.0 else np.zeros(len(self.values))
        moved = self.values + np.where(np.isfinite(slopes), slopes, 0.0) * (value - self.values[index])
        return np.clip(moved, self._lower, self._upper)

    def _rows(self, values: Array) -> tuple[Array, Array]:
        self._between()
        self._runs += 1
        if self._runs > MOST_RUNS:
            raise TooManyRunsError(MOST_RUNS)
        return compressed(self._likelihood, values, self._sample, 0.0)


class _Held:
    """Rows and their slopes by the other parameters, which count units from where they begin."""

    def __init__(
        self,
        rows: Callable[[Array], tuple[Array, Array]],
        index: int,
        held: float,
        begun: Array,
        units: Array,
    ) -> None:
        self._rows, self._index, self._held, self._begun, self._units = rows, index, held, begun, units
        self._at: Array | None = None
        self._found: tuple[Array, Array] = (np.zeros(0), np.zeros((0, 0)))

    def values(self, moved: Array) -> Array:
        return self._evaluate(moved)[0]

    def slopes(self, moved: Array) -> Array:
        return self._evaluate(moved)[1]

    def _evaluate(self, moved: Array) -> tuple[Array, Array]:
        if self._at is None or not np.array_equal(self._at, moved):
            residuals, slopes = self._rows(np.insert(self._begun + moved * self._units, self._index, self._held))
            self._found = residuals, np.delete(slopes, self._index, axis=1) * self._units
            self._at = moved.copy()
        return self._found
