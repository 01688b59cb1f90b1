"""Profile likelihood: the sum of squares about a fit, one parameter held and the others at their best."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ..errors import TautwireError
from .data import DataSet
from .fit import Fit, parameter_scales
from .likelihood import Likelihood
from .preparation.compression import compressed_residuals

Array = NDArray[np.float64]

# Rise of the sum of squares where the model has no finite output.
NON_FINITE_RISE = 1e4
# A fall below the fit that the fit's cost tolerance does not explain.
SIGNIFICANT_FALL = 0.1
# Runs over the sample, in all and in one fit of the others; and the least distance from bounds, in deviations.
MAX_PROFILE_RUNS, MAX_PROFILE_EVALUATIONS, MIN_BOUND_DISTANCE = 300, 15, 1e-6


class LowerMinimumError(TautwireError):
    """Other values have a lower sum of squares than the fit; carries them."""

    def __init__(self, values: Array) -> None:
        self.values = values
        super().__init__(f"the fit is not the best: {values.tolist()} leaves less")


class TooManyRunsError(TautwireError):
    """The profile has taken more runs than it is worth; carries how many."""

    def __init__(self, runs: int) -> None:
        self.runs = runs
        super().__init__(f"{runs} runs have not found where an interval ends")


class ProfileLikelihood:
    """Profile likelihood about a fit of ``values``, which stay within ``lower`` and ``upper``.

    It is by sums of squares of the whitened innovations. ``scales`` (p,) are the parameters' scales;
    ``standard_deviations`` (p,) are zero where the curvature gives none.
    """

    def __init__(
        self,
        likelihood: Likelihood,
        fit: Fit,
        data: DataSet,
        lower: Array,
        upper: Array,
        poll_interrupts: Callable[[], None],
    ) -> None:
        self._likelihood, self._fit, self._sample, self._poll_interrupts = likelihood, fit, data, poll_interrupts
        self._lower, self._upper = lower, upper
        self.values = fit.values
        self.scales = parameter_scales(fit.robot, fit.free)
        variances = np.diag(fit.covariance)
        self.standard_deviations = np.sqrt(np.where(np.isfinite(variances), np.maximum(variances, 0.0), 0.0))
        self._units = np.where(self.standard_deviations > 0.0, self.standard_deviations, self.scales)
        self._run_count = 0
        self._minimum = float(np.sum(self._residuals(fit.values)[0] ** 2))

    def recentred(self, values: Array) -> ProfileLikelihood:
        """The same profile likelihood about other values."""
        recentred_fit = replace(self._fit, values=values)
        return ProfileLikelihood(
            self._likelihood, recentred_fit, self._sample, self._lower, self._upper, self._poll_interrupts
        )

    def rise(self, index: int, value: float) -> float:
        """Rise of the sum of squares with one parameter at a value; 1e4 where the model has no finite output.

        Raises LowerError, TooManyRunsError.
        """
        others = np.arange(len(self.values)) != index
        if not np.any(others):
            return self._checked_rise(float(np.sum(self._residuals(np.array([value]))[0] ** 2)), np.array([value]))
        for start in (self._linear_prediction(index, value), self.values):
            profile_rise = self._profile_point(index, value, start[others], others)
            if profile_rise is not None:
                return profile_rise
        return NON_FINITE_RISE

    def _profile_point(self, index: int, value: float, origin: Array, others: NDArray[np.bool_]) -> float | None:
        units = self._units[others]
        low, high = (self._lower[others] - origin) / units, (self._upper[others] - origin) / units
        start = np.clip(np.zeros(len(origin)), np.minimum(low + MIN_BOUND_DISTANCE, 0.5 * (low + high)), high)
        start = np.clip(start, low, np.maximum(high - MIN_BOUND_DISTANCE, 0.5 * (low + high)))
        residual = _ConstrainedResidual(self._residuals, index, value, origin, units)
        if not np.all(np.isfinite(residual.residuals(start))):
            return None
        solution = least_squares(
            residual.residuals,
            start,
            jac=residual.jacobian,
            bounds=(low, high),
            x_scale="jac",
            ftol=1e-6,
            max_nfev=MAX_PROFILE_EVALUATIONS,
        )
        return self._checked_rise(2.0 * float(solution.cost), np.insert(origin + solution.x * units, index, value))

    def _checked_rise(self, sum_of_squares: float, values: Array) -> float:
        rise = sum_of_squares - self._minimum
        if rise < -SIGNIFICANT_FALL:
            raise LowerMinimumError(values)
        return rise if np.isfinite(rise) else NON_FINITE_RISE

    def _linear_prediction(self, index: int, value: float) -> Array:
        """Linear prediction of the others from the fit's covariance, within their bounds."""
        variance = self._fit.covariance[index, index]
        slopes = self._fit.covariance[:, index] / variance if variance > 0.0 else np.zeros(len(self.values))
        predicted = self.values + np.where(np.isfinite(slopes), slopes, 0.0) * (value - self.values[index])
        return np.clip(predicted, self._lower, self._upper)

    def _residuals(self, values: Array) -> tuple[Array, Array]:
        self._poll_interrupts()
        self._run_count += 1
        if self._run_count > MAX_PROFILE_RUNS:
            raise TooManyRunsError(MAX_PROFILE_RUNS)
        return compressed_residuals(self._likelihood, values, self._sample, 0.0)


class _ConstrainedResidual:
    """Residuals with one parameter fixed, and their Jacobian by the others, in units from where they begin."""

    def __init__(
        self,
        residuals: Callable[[Array], tuple[Array, Array]],
        index: int,
        fixed_value: float,
        origin: Array,
        units: Array,
    ) -> None:
        self._residuals, self._index, self._fixed_value, self._origin, self._units = (
            residuals,
            index,
            fixed_value,
            origin,
            units,
        )
        self._evaluated_at: Array | None = None
        self._cached: tuple[Array, Array] = (np.zeros(0), np.zeros((0, 0)))

    def residuals(self, offset: Array) -> Array:
        return self._evaluate(offset)[0]

    def jacobian(self, offset: Array) -> Array:
        return self._evaluate(offset)[1]

    def _evaluate(self, offset: Array) -> tuple[Array, Array]:
        if self._evaluated_at is None or not np.array_equal(self._evaluated_at, offset):
            residuals, jacobian = self._residuals(
                np.insert(self._origin + offset * self._units, self._index, self._fixed_value)
            )
            self._cached = residuals, np.delete(jacobian, self._index, axis=1) * self._units
            self._evaluated_at = offset.copy()
        return self._cached
