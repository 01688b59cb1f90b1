"""Fit of a disturbance: maximum likelihood of its numbers under weak priors, by itself or with a model's parameters.

Uncertain constants and disturbance are fitted in turn: given the former a filter has far fewer states. That leaves the
maximum's neighbourhood; where some nats matter, ascent under the likelihood itself follows.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from math import log

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import Robot
from .disturbance import Disturbance
from .disturbance_posterior import (
    DisturbancePrior,
    Evaluation,
    ParameterBox,
    Posterior,
    ascended,
    disturbance_prior,
    logs_of,
)
from .estimation_data import DataSet
from .hypotheses import Hypothesis, with_values
from .parameter_fit import Fit, Fitter, parameter_bounds, parameter_scales
from .policy import DEFAULT_POLICY
from .preprocessing_policy import DisturbancePolicy

Array = NDArray[np.float64]

# A parameter's unit in an ascent, in its standard deviations: steps are of up to two.
DEVIATIONS_PER_UNIT = 10.0


def with_fitted_disturbance(
    fitter: Fitter, robot: Robot, chosen: Collection[Hypothesis], data: DataSet, coarse: bool = True
) -> Fitter:
    """The fitter under the most probable disturbance of some data; the same fitter where it has none.

    The chosen hypotheses are those that it is compiled for; their parameters stay as the robot has them. A coarse fit
    ends some nats below the maximum, which may serve for a numerator of an e-value, and not for its denominator.
    """
    policy = fitter.policy.disturbance
    first = data.first(policy.coarse_samples)
    of_first = _refitted(fitter, robot, chosen, first, Effort(policy.max_iterations, is_exact=False))
    iterations = policy.coarse_iterations if coarse else policy.max_iterations
    effort = Effort(iterations, is_exact=not coarse, searches=False)
    return _refitted(of_first, robot, chosen, data, effort, other=fitter.noise.disturbance)


def joint_fit(fitter: Fitter, fit: Fit, chosen: Collection[Hypothesis], data: DataSet) -> tuple[Fitter, Fit]:
    """Joint maximum-likelihood fit of a model's parameters and the disturbance, from where both were fitted in turn.

    Each in turn stops short of it where they make up for each other: nats below, and standard deviations away. The
    covariance is then that beside an unknown disturbance. As it is where there is none, or nothing to fit.
    """
    policy, count = fitter.policy.disturbance, len(fit.values)
    if fitter.noise.disturbance is None or count == 0:
        return fitter, fit
    lower, upper = parameter_bounds(fit.robot, fit.free)
    deviations = fit.standard_deviations
    units = DEVIATIONS_PER_UNIT * np.where(deviations > 0.0, deviations, parameter_scales(fit.robot, fit.free))
    likelihood, _ = fitter.likelihood(fit.robot, chosen, data)
    prior = disturbance_prior(fit.robot, fitter.noise, policy)
    posterior = Posterior(likelihood, fit.values, data, prior, ParameterBox(units, lower, upper))
    start = posterior.evaluation(np.append(logs_of(fitter.noise.disturbance), np.zeros(count)))
    best = ascended(posterior, start, policy, policy.max_iterations)
    values = posterior.values_at(best.coordinates)
    _, information = posterior.score(best)
    of_values = slice(prior.number_count, None)
    covariance = np.linalg.pinv(information)[of_values, of_values] * np.outer(units, units)
    robot = with_values(fit.robot, fit.free, dict(zip(fit.free, values.tolist(), strict=True)))
    return fitter.with_disturbance(prior.disturbance_of(best.logs)), Fit(robot, fit.free, values, covariance)


def with_improved_disturbance(fitter: Fitter, robot: Robot, chosen: Collection[Hypothesis], data: DataSet) -> Fitter:
    """As :func:`with_fitted_disturbance`, by a few iterations over the first samples: for candidates to be ranked."""
    policy = fitter.policy.disturbance
    first = data.first(policy.coarse_samples)
    return _refitted(fitter, robot, chosen, first, Effort(policy.ranking_iterations, is_exact=False, searches=False))


def marginal_log_likelihood(
    fitter: Fitter, robot: Robot, chosen: Collection[Hypothesis], data: DataSet, is_coarse: bool = True
) -> float:
    """Log-likelihood of some data that knows no disturbance: over all of them, by Schwarz's approximation.

    With N measured values and k numbers of the disturbance ``max log L - k/2 log N``. A disturbance of other data may
    fit these badly; that must not count against a hypothesis whose rival has the best one. A coarse maximum is from the
    first samples alone.

    Source: Schwarz (1978), Annals of Statistics 6(2), 461-464.
    """
    maximised = with_improved_disturbance if is_coarse else with_fitted_disturbance
    fitter = maximised(fitter, robot, chosen, data)
    numbers = disturbance_prior(robot, fitter.noise, fitter.policy.disturbance).log_deviations
    value_count = max(data.value_count(robot.platform.is_rigid_body), 1)
    return fitter.log_likelihood(robot, chosen, data) - 0.5 * len(numbers) * log(value_count)


def _value(evaluation: Evaluation) -> float:
    return evaluation.value


@dataclass(frozen=True)
class Effort:
    """How far a fit goes: ``max_iterations`` at most, and whether it ends near a maximum or at it.

    One that ``searches`` begins at the prior's median too: what was fitted beside another model may be a maximum here
    that is not the highest, a slow and large force for a load that is accounted for now.
    """

    max_iterations: int
    is_exact: bool
    searches: bool = True


def _refitted(
    fitter: Fitter,
    robot: Robot,
    chosen: Collection[Hypothesis],
    data: DataSet,
    effort: Effort,
    other: Disturbance | None = None,
) -> Fitter:
    """The fitter refitted to some data; ``other`` is a disturbance that it may begin at as well."""
    if not fitter.has_disturbance:
        return fitter
    policy = fitter.policy.disturbance
    prior = disturbance_prior(robot, fitter.noise, policy)
    likelihood, values = fitter.likelihood(robot, chosen, data)
    posterior = Posterior(likelihood, np.array(values), data, prior)
    return fitter.with_disturbance(fit_disturbance(posterior, policy, effort, other))


def fit_disturbance(
    posterior: Posterior,
    policy: DisturbancePolicy = DEFAULT_POLICY.fit.disturbance,
    effort: Effort | None = None,
    other: Disturbance | None = None,
) -> Disturbance:
    """Maximise the posterior density over the disturbance; by default exactly.

    Begins at the likelihood's own disturbance and at the ``other``, unless one is far less probable; and at the prior's
    median, or a larger one, where the effort is to search.
    """
    effort = effort or Effort(policy.max_iterations, is_exact=True)
    own, median = posterior.likelihood.noise.disturbance, posterior.prior.median
    known = [logs_of(each) for each in (own, other) if each not in (None, median)]
    fresh = _fresh_starts(posterior.prior, policy) if effort.searches or not known else []
    starts = _promising(posterior.evaluations(known), policy.max_start_deficit)
    starts += [max(posterior.evaluations(fresh), key=_value)] if fresh else []
    reached = max((_maximised(posterior, start, policy, effort) for start in starts), key=_value)
    return posterior.prior.disturbance_of(reached.logs)


def _promising(evaluations: Sequence[Evaluation], max_deficit: float) -> list[Evaluation]:
    """The best, and those so little below it (nats) that they may lead higher."""
    best = max((each.value for each in evaluations), default=0.0)
    return [each for each in evaluations if each.value >= best - max_deficit]


def _maximised(posterior: Posterior, current: Evaluation, policy: DisturbancePolicy, effort: Effort) -> Evaluation:
    """The maximum, or what is near it, that is reached from an evaluation."""
    is_near = len(current.constants) > 0
    for _ in range(policy.max_alternations if is_near else 0):
        reached = _alternated(posterior, current, policy)
        gain, current = reached.value - current.value, max(current, reached, key=_value)
        # A step that would lead down says that parameters and disturbance cannot be told apart in turn.
        is_near = gain > -policy.min_coarse_gain
        if gain < policy.min_coarse_gain:
            break
    if effort.is_exact or not is_near:
        current = ascended(posterior, current, policy, effort.max_iterations)
    return current


def _alternated(posterior: Posterior, current: Evaluation, policy: DisturbancePolicy) -> Evaluation:
    """Evaluation at the disturbance that is most probable given the uncertain parameters as they are."""
    conditional = posterior.given_constants(current.constants)
    coarse = replace(policy, min_gain=policy.min_coarse_gain)
    start = conditional.evaluation(current.logs, is_scored=True)
    return posterior.evaluation(ascended(conditional, start, coarse, policy.max_iterations).logs)


def _fresh_starts(prior: DisturbancePrior, policy: DisturbancePolicy) -> list[Array]:
    """Logs of the prior's median, and of larger ones, which follow a model far off."""
    starts = [logs_of(prior.median)]
    for factor in policy.start_factors:
        logs = starts[0].copy()
        logs[prior.sizes] += log(factor)
        starts.append(logs)
    return starts
