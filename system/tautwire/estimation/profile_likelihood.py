"""Profile likelihood: 95 % intervals where the sum of squares about a fit is not a parabola.

A value ``t`` of one parameter is inside while the others, at their best beside it, leave a sum of squares little above
that of the fit:

    min over the others of S(t, others) - S(fit) <= 1.96^2

with ``S`` the sum of squares of the whitened innovations. Where ``S`` is a parabola the ends are 1.96 standard
deviations away. It is not where a parameter ends, and where it hardly shows: a relaxation's time, a drum's radius.

Source: Venzon and Moolgavkar (1988), A method for computing profile-likelihood-based confidence intervals, Applied
Statistics 37(1), 87-94.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, least_squares

from ..errors import TautwireError
from .estimation_data import DataSet
from .hypotheses import Hypothesis
from .likelihood import Likelihood
from .normal_equations import NothingToGainError, StoppingRule, compressed_residuals
from .parameter_fit import NORMAL_QUANTILE_95, Fit, Fitter, parameter_bounds, parameter_scales
from .policy import DEFAULT_POLICY, ProfileLikelihoodPolicy
from .worker_pool import WorkerPool

Array = NDArray[np.float64]

# Rise of the sum of squares where the model has no finite output.
NON_FINITE_RISE = 1e4
# Least distance of starts from bounds, in deviations.
MIN_BOUND_DISTANCE = 1e-6
COST_TOLERANCE = 1e-6
CHI_SQUARED_95 = NORMAL_QUANTILE_95**2


class LowerMinimumError(TautwireError):
    """Other values have a lower sum of squares than the fit; carries them."""

    def __init__(self, values: Array) -> None:
        self.values = values
        super().__init__(f"the fit is not the optimum: {values.tolist()} has a smaller sum of squares")


class TooManyRunsError(TautwireError):
    """The profile has taken more runs than it is worth; carries how many."""

    def __init__(self, runs: int) -> None:
        self.runs = runs
        super().__init__(f"{runs} runs have not found the end of an interval")


class ProfileLikelihood:
    """Profile likelihood about a fit of ``values``, which stay within ``bounds``, lower and upper (p,).

    It is by sums of squares of the whitened innovations. ``scales`` (p,) are the parameters' scales;
    ``standard_deviations`` (p,) are zero where the curvature gives none.
    """

    def __init__(
        self,
        likelihood: Likelihood,
        fit: Fit,
        data: DataSet,
        bounds: tuple[Array, Array],
        poll_interrupts: Callable[[], None],
        policy: ProfileLikelihoodPolicy,
    ) -> None:
        self._likelihood, self._fit, self._sample, self._poll_interrupts = likelihood, fit, data, poll_interrupts
        self._lower, self._upper = bounds
        self.policy = policy
        self.values = fit.values
        self.scales = parameter_scales(fit.robot, fit.free)
        variances = np.diag(fit.covariance)
        self.standard_deviations = np.sqrt(np.where(np.isfinite(variances), np.maximum(variances, 0.0), 0.0))
        self._units = np.where(self.standard_deviations > 0.0, self.standard_deviations, self.scales)
        self._run_count = 0
        self._minimum = float(np.sum(self._residuals(fit.values)[0] ** 2))

    def recentred(self, values: Array) -> ProfileLikelihood:
        """The same profile likelihood about other values."""
        fit, bounds = replace(self._fit, values=values), (self._lower, self._upper)
        return ProfileLikelihood(self._likelihood, fit, self._sample, bounds, self._poll_interrupts, self.policy)

    def rise(self, index: int, value: float) -> float:
        """Rise of the sum of squares with one parameter at a value; 1e4 where the model has no finite output.

        Raises LowerMinimumError, TooManyRunsError.
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

        def evaluate(offset: Array) -> tuple[Array, Array]:
            residuals, jacobian = self._residuals(np.insert(origin + offset * units, index, value))
            return residuals, np.delete(jacobian, index, axis=1) * units

        rule = StoppingRule(evaluate, start, COST_TOLERANCE)
        if not rule.has_finite_start:
            return None
        with suppress(NothingToGainError):
            least_squares(
                rule.residuals,
                start,
                jac=rule.jacobian,
                bounds=(low, high),
                x_scale="jac",
                ftol=COST_TOLERANCE,
                max_nfev=self.policy.max_evaluations,
            )
        return self._checked_rise(2.0 * rule.cost, np.insert(origin + rule.best_point * units, index, value))

    def _checked_rise(self, sum_of_squares: float, values: Array) -> float:
        rise = sum_of_squares - self._minimum
        if rise < -self.policy.significant_fall:
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
        if self._run_count > self.policy.max_runs:
            raise TooManyRunsError(self.policy.max_runs)
        return compressed_residuals(self._likelihood, values, self._sample, 0.0)


def profile_intervals(
    fitter: Fitter,
    fit: Fit,
    chosen: Sequence[Hypothesis],
    data: DataSet,
    workers: WorkerPool,
    policy: ProfileLikelihoodPolicy = DEFAULT_POLICY.profile_likelihood,
) -> list[tuple[float, float]]:
    """Profile-likelihood interval of each free parameter of a fit, which was made with ``chosen`` on ``data``.

    An end is the parameter's bound if the profile does not rise before; infinite where there is none. It is by
    curvature where :class:`ProfileLikelihood` takes too many runs to find it.
    """
    calls = [(fitter, fit, chosen, data, index, policy) for index in range(len(fit.free))]
    return [found for _, found in sorted(workers.map_unordered(profile_interval, calls))]


def profile_interval(
    fitter: Fitter,
    fit: Fit,
    chosen: Sequence[Hypothesis],
    data: DataSet,
    index: int,
    policy: ProfileLikelihoodPolicy,
) -> tuple[float, float]:
    """Profile-likelihood interval of one parameter, about better values where some turn up; its value is inside."""
    likelihood, _ = fitter.likelihood(fit.robot, chosen, data)
    lower, upper = parameter_bounds(fit.robot, fit.free)
    minimum, maximum = float(lower[index]), float(upper[index])
    value, half_width = float(fit.values[index]), NORMAL_QUANTILE_95 * float(fit.standard_deviations[index])
    profile = ProfileLikelihood(likelihood, fit, data, (lower, upper), fitter.poll_interrupts, policy)
    for _ in range(policy.max_recentrings + 1):
        try:
            low, high = _interval_end(profile, index, -1.0, minimum), _interval_end(profile, index, 1.0, maximum)
        except LowerMinimumError as better:  # noqa: PERF203 - a few rounds of many runs each
            profile = profile.recentred(better.values)
        except TooManyRunsError:
            break
        else:
            return max(min(low, value), minimum), min(max(high, value), maximum)
    if half_width > 0.0:
        return max(value - half_width, minimum), min(value + half_width, maximum)
    return minimum, maximum


def _interval_end(profile: ProfileLikelihood, index: int, sign: float, bound: float) -> float:
    estimate, policy = float(profile.values[index]), profile.policy
    half_width = NORMAL_QUANTILE_95 * float(profile.standard_deviations[index])
    first_distance = policy.first_relative_distance * float(profile.scales[index])
    inner = 0.0
    for distance in _search_distances(half_width, first_distance, abs(bound - estimate), policy):
        excess_at_distance = profile.rise(index, estimate + sign * distance) - CHI_SQUARED_95
        if (
            inner == 0.0
            and distance == half_width
            and abs(excess_at_distance) < policy.max_parabola_deviation * CHI_SQUARED_95
        ):
            return estimate + sign * distance
        if excess_at_distance > 0.0:
            break
        inner = distance
    else:
        return bound

    def excess(length: float) -> float:
        return profile.rise(index, estimate + sign * length) - CHI_SQUARED_95 if length > 0.0 else -CHI_SQUARED_95

    return estimate + sign * float(
        brentq(excess, inner, distance, xtol=policy.end_tolerance * distance, rtol=policy.end_tolerance)
    )


def _search_distances(
    by_curvature: float, by_size: float, farthest: float, policy: ProfileLikelihoodPolicy
) -> Iterator[float]:
    """Distances of the search, each twice the last, up to the farthest if that is not infinite."""
    distance = by_curvature if by_curvature > 0.0 else by_size
    for _ in range(policy.max_distance_doublings):
        if distance >= farthest:
            break
        yield distance
        distance = max(2.0 * distance, by_size)
    if 0.0 < farthest < np.inf:
        yield farthest
