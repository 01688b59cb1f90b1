"""Fits of a selection's candidates, in worker processes, and their validation on other data."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import reduce
from math import inf, isfinite, nan

import numpy as np

from ..errors import UnreachableError
from ..robot.schema import Robot
from .candidate_proposals import FitTask
from .candidate_scores import CandidateScore, setting_of
from .disturbance_fit import joint_fit, marginal_log_likelihood, with_fitted_disturbance, with_improved_disturbance
from .disturbance_posterior import disturbance_prior
from .estimation_data import DataSet
from .grid_search import starts_by_shape
from .hypotheses import Hypothesis
from .identification_context import IdentificationContext
from .parameter_fit import Fit, Fitter, NoFitError
from .policy import SelectionPolicy
from .time_limit import OutOfTimeError


@dataclass(frozen=True)
class ValidatedFit:
    """A fit with its validation: log-likelihood and mean square of the innovations on validation data.

    ``explained`` is the log-likelihood of the estimation data under the fitter's own disturbance, NaN without one.
    """

    fit: Fit
    log_likelihood: float
    mean_square: float
    explained: float


def fit_and_validate(fitter: Fitter, task: FitTask, data: DataSet, validation: DataSet) -> ValidatedFit | None:
    """Fit and validate a task; None where the cables cannot hold the platform, or nothing finite comes out."""
    try:
        fit = fitter.fit_from(task.starts, task.chosen, data, task.min_log_likelihood, task.cost_tolerance)
        explained = fitter.log_likelihood(fit.robot, task.chosen, data) if fitter.has_disturbance else nan
        for _ in range(task.disturbance_refits):
            fitter = with_fitted_disturbance(fitter, fit.robot, task.chosen, data)
            fit = fitter.fit_from([fit.robot], task.chosen, data, -inf, task.cost_tolerance)
        fitter = with_improved_disturbance(fitter, fit.robot, task.chosen, data)
        innovations = fitter.judged(fit.robot, task.chosen, validation)
        log_likelihood = innovations.log_likelihood(validation.rows)
        if fitter.has_disturbance:
            is_coarse = task.disturbance_refits == 0
            marginal = marginal_log_likelihood(fitter, fit.robot, task.chosen, validation, is_coarse)
            log_likelihood = max(log_likelihood, marginal)
    except (UnreachableError, NoFitError, np.linalg.LinAlgError):
        return None
    mean_square = innovations.overall_mean_square(validation.rows)
    return ValidatedFit(fit, log_likelihood, mean_square, explained) if np.isfinite(log_likelihood) else None


def finite_log_likelihood(fitter: Fitter, robot: Robot, chosen: Sequence[Hypothesis], data: DataSet) -> float:
    """Log-likelihood of some data; minus infinity where the cables cannot hold the platform, or it is not finite."""
    try:
        value = fitter.log_likelihood(robot, chosen, data)
    except UnreachableError:
        return -inf
    return value if isfinite(value) else -inf


def fit_at_another_optimum(fitter: Fitter, task: FitTask, data: DataSet, policy: SelectionPolicy) -> Robot | None:
    """The robot at a better local optimum than the task's first start, which was fitted; None where there is none.

    Fits begin at the best of the task's starts and of each shape's grid points, under a small disturbance: that of a
    model without the effect, which had to be large, leads a nonlinear one astray, a hysteresis of 164 N to 46 N. Both
    optima are judged beside disturbances improved for them.
    """
    chosen, fitted = task.chosen, task.starts[0]
    median = disturbance_prior(fitted, fitter.noise, fitter.policy.disturbance).median
    under_median = fitter.with_disturbance(median)

    def improved_log_likelihood(robot: Robot) -> float:
        improved = (with_improved_disturbance(under, robot, chosen, data) for under in (fitter, under_median))
        return max(finite_log_likelihood(under, robot, chosen, data) for under in improved)

    def best_of(robots: Iterable[Robot]) -> Robot:
        return max(robots, key=lambda robot: finite_log_likelihood(under_median, robot, chosen, data))

    optima = []
    for starts in (task.starts, *starts_by_shape(fitted, chosen[-1])):
        with suppress(UnreachableError, NoFitError):
            optima.append(under_median.fit_from([best_of(starts)], chosen, data, -inf, task.cost_tolerance).robot)
    if not optima:
        return None
    best, before = best_of(optima), improved_log_likelihood(fitted)
    return best if improved_log_likelihood(best) - before > policy.coarse_tie(before) else None


def fit_candidates(
    context: IdentificationContext,
    label: str,
    tasks: Mapping[Hypothesis, FitTask],
    data: DataSet,
    baseline: float,
    stop_at_first: bool = False,
) -> dict[Hypothesis, CandidateScore]:
    """Scores of the hypotheses of some tasks, in their order, without those that the cables cannot hold.

    ``baseline`` is the log-likelihood of the validation data without them. With ``stop_at_first`` only until one
    leaves noise, in their order, not as they end. Where time is up, only those that were fitted until then.
    """
    order, scores = list(tasks), {}
    remaining = dict.fromkeys(order)
    calls = [(context.fitter, task, data, context.split.validation) for task in tasks.values()]
    try:
        with closing(context.workers.map_unordered(fit_and_validate, calls)) as attempts:
            for done, (index, validated) in enumerate(attempts, start=1):
                hypothesis = order[index]
                del remaining[hypothesis]
                context.progress(f"{label}: {hypothesis.label(context.robot)}", done / len(order))
                if validated is not None:
                    scores[hypothesis] = _score(hypothesis, validated, baseline)
                enough = _index_that_leaves_noise(context, order, scores, remaining) if stop_at_first else None
                if enough is not None:
                    order = order[: enough + 1]
                    break
    except OutOfTimeError:
        names = ", ".join(hypothesis.label(context.robot) for hypothesis in remaining)
        context.leave_untried(f"fits of {names} ({label})")
    return {hypothesis: scores[hypothesis] for hypothesis in order if hypothesis in scores}


def _score(hypothesis: Hypothesis, validated: ValidatedFit, baseline: float) -> CandidateScore:
    evidence = validated.log_likelihood - baseline
    return CandidateScore(hypothesis, validated.fit, evidence, validated.mean_square, validated.explained)


def _index_that_leaves_noise(
    context: IdentificationContext,
    order: Sequence[Hypothesis],
    scores: Mapping[Hypothesis, CandidateScore],
    remaining: Collection[Hypothesis],
) -> int | None:
    """Index of the first hypothesis that leaves noise, once all before it are fitted."""
    for index, hypothesis in enumerate(order):
        if hypothesis in remaining:
            return None
        if hypothesis in scores and leaves_noise(context, scores[hypothesis]):
            return index
    return None


def leaves_noise(context: IdentificationContext, score: CandidateScore) -> bool:
    """Whether the innovations of a candidate are about as small as noise."""
    return score.mean_square < context.policy.selection.max_noise_mean_square


def fit_model(
    context: IdentificationContext, chosen: Sequence[Hypothesis], start: Robot | None = None, coarse: bool = False
) -> Fit:
    """Fit of the chosen hypotheses, from the values of a robot that has them; coarse on a part of the samples.

    From their default values without such a robot, and where its values give nothing finite.
    """
    starts, policy = [_with_default_values(context.robot, chosen)], context.policy.fit
    if start is not None:
        effects = [setting_of(start, hypothesis) for hypothesis in chosen]
        starts.insert(0, reduce(Robot.with_effect, effects, context.robot))
    data = context.head if coarse else context.split.estimation
    tolerance = policy.coarse_cost_tolerance if coarse else policy.fine_cost_tolerance
    return context.fitter.fit_from(starts, chosen, data, -inf, tolerance)


def _with_default_values(robot: Robot, chosen: Collection[Hypothesis]) -> Robot:
    """The robot with the chosen hypotheses where fits begin."""
    return reduce(lambda changed, hypothesis: changed.with_effect(hypothesis.setting(changed)), chosen, robot)


def coarse_validation_likelihood(
    fitter: Fitter, robot: Robot, chosen: Sequence[Hypothesis], validation: DataSet
) -> float:
    """As :func:`maximised_validation_likelihood`, by coarse fits: some nats below the maximum."""
    return _maximised(fitter, robot, chosen, validation, is_coarse=True)[0]


def maximised_validation_likelihood(
    context: IdentificationContext, robot: Robot, chosen: Sequence[Hypothesis], reference: float
) -> float:
    """Maximised log-likelihood of the validation data, as the denominator of an e-value must be.

    Over the disturbance too, in favour of the model: an effect has to beat the best disturbance, not noise alone.
    Coarse where it stays below ``reference`` by more than the fit's cost tolerance can be wrong.
    """
    fitter, validation, policy = context.fitter, context.split.validation, context.policy
    if not chosen and not fitter.has_disturbance:
        return fitter.log_likelihood(robot, chosen, validation)
    log_likelihood, fitter, robot = _maximised(fitter, robot, chosen, validation, is_coarse=True)
    if reference - log_likelihood > policy.selection.coarse_tie(log_likelihood):
        return log_likelihood
    return _maximised(fitter, robot, chosen, validation, is_coarse=False)[0]


def _maximised(
    fitter: Fitter, robot: Robot, chosen: Sequence[Hypothesis], data: DataSet, is_coarse: bool
) -> tuple[float, Fitter, Robot]:
    """Log-likelihood of some data, maximised over the disturbance and the chosen hypotheses, with both as fitted."""
    fitter = with_fitted_disturbance(fitter, robot, chosen, data, is_coarse)
    tolerance = fitter.policy.coarse_cost_tolerance if is_coarse else fitter.policy.fine_cost_tolerance
    fit = fitter.fit_from([robot, _with_default_values(robot, chosen)], chosen, data, -inf, tolerance)
    if not is_coarse:
        fitter, fit = joint_fit(fitter, fit, chosen, data)
    return fitter.log_likelihood(fit.robot, chosen, data), fitter, fit.robot
