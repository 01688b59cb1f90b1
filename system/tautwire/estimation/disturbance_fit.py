"""Fit of a disturbance: maximum likelihood of its numbers under weak priors, by Fisher scoring.

With whitened innovations v and their variances s, of a model whose parameters are held, and x the logs of the numbers,

    dL/dx = -sum (v v' + l' / 2)        l = log s
    E[-d2L/dx2] = sum (v' + v l' / 2)(v' + v l' / 2)^T + l' l'^T / 2

Uncertain parameters and disturbance are fitted in turn: given the former a filter has far fewer states. That leaves the
maximum's neighbourhood; where some nats matter, ascent under the likelihood itself follows.

Source: Gupta and Mehra (1974), IEEE Transactions on Automatic Control 19(6), 774-783.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from math import log

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import Robot
from .disturbance import Disturbance, OrnsteinUhlenbeck
from .estimation_data import DataSet
from .hypotheses import Hypothesis
from .kalman_filter import Noise
from .likelihood import Likelihood
from .parameter_fit import Fitter
from .policy import DEFAULT_POLICY, DisturbancePolicy

Array = NDArray[np.float64]

CONCURRENT_EVALUATIONS = 2
# Indices of the processes' bandwidths among the logs of a disturbance's numbers.
BANDWIDTHS = [1, 3, 5]


@dataclass(frozen=True)
class DisturbancePrior:
    """Weak prior of a disturbance: its median, and standard deviations of the logs of its numbers (8,)."""

    median: Disturbance
    log_deviations: tuple[float, ...]

    def penalty(self, logs: Array) -> Array:
        """Deviations from the median in standard deviations (8,)."""
        deviations: Array = (logs - logs_of(self.median)) / np.array(self.log_deviations)
        return deviations


def logs_of(disturbance: Disturbance) -> Array:
    """Logs of a disturbance's numbers (8,)."""
    pairs = [(each.rms, each.bandwidth) for each in (disturbance.force, disturbance.position, disturbance.tension)]
    numbers = [number for pair in pairs for number in pair]
    return np.log([*numbers, disturbance.position_noise, disturbance.tension_noise])


def disturbance_of(logs: Array) -> Disturbance:
    """The disturbance whose numbers have these logs (8,)."""
    numbers = np.exp(logs).tolist()
    force, position, tension = (OrnsteinUhlenbeck(*numbers[k : k + 2]) for k in (0, 2, 4))
    return Disturbance(force, position, tension, numbers[6], numbers[7])


def disturbance_prior(
    robot: Robot, noise: Noise, policy: DisturbancePolicy = DEFAULT_POLICY.fit.disturbance
) -> DisturbancePrior:
    """Prior of a robot with these sensors: a force in proportion to its weight, and half of the noise coloured."""
    share, weight = policy.coloured_noise_share, robot.platform.mass * max(robot.gravity, 1.0)
    white = (1.0 - share**2) ** 0.5
    median = Disturbance(
        OrnsteinUhlenbeck(policy.force_to_weight * weight, policy.bandwidth),
        OrnsteinUhlenbeck(share * noise.position, policy.bandwidth),
        OrnsteinUhlenbeck(share * noise.tension, policy.bandwidth),
        white * noise.position,
        white * noise.tension,
    )
    size, bandwidth, sensor = (log(f) for f in (policy.size_factor, policy.bandwidth_factor, policy.noise_factor))
    return DisturbancePrior(median, (*[size, bandwidth] * 3, sensor, sensor))


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
    value_count = int(np.count_nonzero(np.isfinite(data.recording.measured()[data.rows])))
    return fitter.log_likelihood(robot, chosen, data) - 0.5 * len(numbers) * log(max(value_count, 1))


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
    posterior = Posterior(likelihood, values, data, prior)
    return fitter.with_disturbance(fit_disturbance(posterior, policy, effort, other))


def fit_disturbance(
    posterior: Posterior,
    policy: DisturbancePolicy = DEFAULT_POLICY.fit.disturbance,
    effort: Effort | None = None,
    other: Disturbance | None = None,
) -> Disturbance:
    """Maximise the posterior density over the disturbance; by default exactly.

    Begins at the likelihood's own disturbance, or at the ``other`` where that is more probable; and at the prior's
    median, or a larger one, where the effort is to search.
    """
    effort = effort or Effort(policy.max_iterations, is_exact=True)
    own, median = posterior.likelihood.noise.disturbance, posterior.prior.median
    known = [logs_of(each) for each in (own, other) if each not in (None, median)]
    fresh = _fresh_starts(posterior.prior, policy) if effort.searches or not known else []
    best = [max(posterior.evaluations(starts), key=_value) for starts in (known, fresh) if starts]
    return disturbance_of(max((_maximised(posterior, start, policy, effort) for start in best), key=_value).logs)


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
        current = _ascended(posterior, current, policy, effort.max_iterations)
    return current


def _alternated(posterior: Posterior, current: Evaluation, policy: DisturbancePolicy) -> Evaluation:
    """Evaluation at the disturbance that is most probable given the uncertain parameters as they are."""
    conditional = posterior.given_constants(current.constants)
    coarse = replace(policy, min_gain=policy.min_coarse_gain)
    return posterior.evaluation(
        _ascended(conditional, conditional.evaluation(current.logs), coarse, policy.max_iterations).logs
    )


def _ascended(posterior: Posterior, start: Evaluation, policy: DisturbancePolicy, max_iterations: int) -> Evaluation:
    """The end of an ascent; Levenberg's damping lets no step descend."""
    current, damping = start, policy.first_damping
    for _ in range(max_iterations):
        gradient, information = posterior.score(current)
        # At its bound, and pushed beyond it: such a log stays, and the others move as if it were no number.
        is_held = (current.logs <= posterior.least_logs) & (gradient < 0.0)
        gradient, information = np.where(is_held, 0.0, gradient), np.where(is_held[:, None] | is_held, 0.0, information)
        information[is_held, is_held] = 1.0
        while damping < policy.max_damping:
            scaled = information + damping * np.diag(np.diag(information))
            step = np.clip(np.linalg.solve(scaled, gradient), -policy.max_log_step, policy.max_log_step)
            trial = posterior.evaluation(current.logs + step)
            if trial.value > current.value:
                break
            damping *= 10.0
        else:
            break
        gain, current, damping = trial.value - current.value, trial, 0.1 * damping
        if gain < policy.min_gain:
            break
    return current


def _fresh_starts(prior: DisturbancePrior, policy: DisturbancePolicy) -> list[Array]:
    """Logs of the prior's median, and of larger ones, which follow a model far off."""
    starts = [logs_of(prior.median)]
    for factor in policy.start_factors:
        logs = starts[0].copy()
        logs[[0, 2, 4]] += log(factor)
        starts.append(logs)
    return starts


@dataclass(frozen=True)
class Evaluation:
    """Posterior log-density at some logs, with what it is made of: whitened innovations and logs of variances.

    ``constants`` (c) are the uncertain parameters there, in standard deviations.
    """

    logs: Array
    value: float
    innovations: Array
    log_variances: Array
    constants: Array


def _value(evaluation: Evaluation) -> float:
    return evaluation.value


@dataclass(frozen=True)
class Posterior:
    """Posterior density of a disturbance under some data, with the free parameters held at their ``values``."""

    likelihood: Likelihood
    values: Sequence[float]
    data: DataSet
    prior: DisturbancePrior

    def given_constants(self, constants: Array) -> Posterior:
        """The posterior density given the uncertain parameters."""
        return replace(self, likelihood=self.likelihood.given_constants(constants))

    @cached_property
    def least_logs(self) -> Array:
        """Least logs (8,): what hardly changes while a recording lasts is no disturbance, but an offset or a weight."""
        least = np.full(len(self.prior.log_deviations), -np.inf)
        time = self.data.recording.time
        least[BANDWIDTHS] = -log(float(time[-1] - time[0]))
        return least

    def evaluation(self, logs: Array) -> Evaluation:
        """Its evaluation at some logs (8,), or at the least ones where these are less."""
        logs = np.maximum(logs, self.least_logs)
        likelihood = self.likelihood.with_disturbance(disturbance_of(logs))
        innovations = likelihood.innovations(self.data.recording, self.values)
        mask = innovations.observed & self.data.rows[:, None]
        value = innovations.log_likelihood(self.data.rows) - 0.5 * float(np.sum(self.prior.penalty(logs) ** 2))
        value = value if np.isfinite(value) else -np.inf
        return Evaluation(logs, value, innovations.values[mask], innovations.log_variances[mask], innovations.constants)

    def evaluations(self, points: Iterable[Array]) -> list[Evaluation]:
        """Evaluations at several logs, two at once: a compiled filter runs without Python's lock."""
        with ThreadPoolExecutor(CONCURRENT_EVALUATIONS) as threads:
            return list(threads.map(self.evaluation, points))

    def score(self, evaluation: Evaluation) -> tuple[Array, Array]:
        """Gradient (8,) and Fisher information (8, 8), by finite differences of the innovations."""
        step = 1e-3
        moved = self.evaluations(evaluation.logs + step * np.eye(len(evaluation.logs)))
        values_by_number = np.array([each.innovations - evaluation.innovations for each in moved]) / step
        logs_by_number = np.array([each.log_variances - evaluation.log_variances for each in moved]) / step
        gradient = -values_by_number @ evaluation.innovations - 0.5 * np.sum(logs_by_number, axis=1)
        unscaled = values_by_number + 0.5 * evaluation.innovations * logs_by_number
        deviations = np.array(self.prior.log_deviations)
        information = unscaled @ unscaled.T + 0.5 * logs_by_number @ logs_by_number.T + np.diag(deviations**-2)
        return gradient - self.prior.penalty(evaluation.logs) / deviations, information
