"""Scoring of the candidates of a search round: predicted, fitted to estimation data, judged on validation data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf, isfinite
from operator import itemgetter

from ..robot.schema import Robot
from .candidate_fits import (
    coarse_validation_likelihood,
    finite_log_likelihood,
    fit_at_another_optimum,
    fit_candidates,
    leaves_noise,
    maximised_validation_likelihood,
)
from .candidate_proposals import FitTask, SearchRound, shortlist, starting_robots
from .candidate_scores import CandidateScore, misfitted_rival, most_parsimonious, simpler_rival, unfitted_score
from .disturbance_posterior import disturbance_prior
from .estimation_data import DataSplit
from .explained_shares import missed_on_validation
from .grid_search import grid_search, misleading_predictions
from .hypotheses import Hypothesis, with_hypothesis
from .identification_context import IdentificationContext
from .score_test import PredictedGain, ScoreRun, score_tests_in_workers
from .speed_versions import split_with_other_interpolation
from .time_limit import OutOfTimeError

Predictions = dict[Hypothesis, PredictedGain]
Starts = Mapping[Hypothesis, tuple[Robot, ...]]


def score_candidates(context: IdentificationContext, search_round: SearchRound) -> tuple[list[CandidateScore], bool]:
    """Score every hypothesis of a round, and tell whether all of the shortlist were fitted.

    Those with a large enough predicted gain are fitted; with a rival only what comes near it to all samples.
    """
    policy, robot, accepted = context.policy, search_round.robot, search_round.accepted
    label = f"round {search_round.number}"
    context.progress(f"{label}: score test", 0.0)
    predictions, rough_predictions = _predict_gains(context, search_round)
    shortlisted = shortlist(predictions, rough_predictions, policy.score_test, context.fitter.has_disturbance)
    if search_round.is_ranking:
        coarse_data = context.split.estimation.first(policy.selection.coarse_samples)
        predictions |= grid_search(context, robot, accepted, coarse_data, {h: predictions[h] for h in shortlisted})
    starts = {
        h: starting_robots(robot, h, [p[h] for p in (predictions, rough_predictions) if h in p]) for h in shortlisted
    }
    score = _scores_beside_disturbance if context.fitter.has_disturbance else _scores_beside_noise
    scores = score(context, label, search_round, starts)
    context.progress(f"{label}: done", 1.0)
    unfitted = [unfitted_score(robot, h, predictions[h]) for h in predictions if h not in scores]
    return [*scores.values(), *unfitted], not search_round.stops_at_first or scores.keys() >= set(shortlisted)


def likelier_interpolation(context: IdentificationContext, scores: Sequence[CandidateScore]) -> DataSplit | None:
    """The data with winch speeds interpolated otherwise, where the best effects of a first round are likelier so.

    None beside a disturbance, which is judged anew later, and where the best one leaves no more than white noise: an
    error of interpolation passes for an effect, or hides which one it is.
    """
    if context.fitter.has_disturbance:
        return None
    policy, best_of_effects = context.policy.selection, dict[str, CandidateScore]()
    for score in sorted((s for s in scores if isfinite(s.mean_square)), key=lambda score: -score.evidence):
        best_of_effects.setdefault(score.hypothesis.effect.name, score)
    ranked = list(best_of_effects.values())[: policy.fits_with_other_interpolation]
    value_count = context.split.validation.value_count(context.robot.platform.is_rigid_body)
    largest_by_chance = 1.0 + policy.max_chance_deviations * (2.0 / max(value_count, 1)) ** 0.5
    if not ranked or ranked[0].mean_square <= largest_by_chance:
        return None
    split = split_with_other_interpolation(context.split)
    if split is None:
        return None
    baseline = context.fitter.log_likelihood(context.robot, (), context.split.validation)
    tolerance = context.policy.fit.coarse_cost_tolerance
    tasks = {s.hypothesis: FitTask((s.hypothesis,), (s.fit.robot,), -inf, tolerance) for s in ranked}
    label = "winch speeds interpolated otherwise"
    others = fit_candidates(replace(context, split=split), label, tasks, split.estimation, baseline)
    gain = max((score.evidence for score in others.values()), default=-inf) - ranked[0].evidence
    misfit = 0.5 * (ranked[0].mean_square - 1.0) * value_count
    return split if gain >= context.policy.preprocessing.decisive_gain(misfit) else None


def _scores_beside_noise(
    context: IdentificationContext, label: str, search_round: SearchRound, starts: Starts
) -> dict[Hypothesis, CandidateScore]:
    """Scores of a round whose model has no disturbance; far from noise candidates are ranked on a part of the data."""
    policy, estimation = context.policy, context.split.estimation
    robot, accepted = search_round.robot, search_round.accepted
    is_exact, data = search_round.is_white, estimation
    if not is_exact:
        data = estimation.first(policy.selection.coarse_samples) if search_round.rival else context.head
    min_log_likelihood = context.fitter.log_likelihood(robot, accepted, data)
    tasks = search_round.tasks(starts, min_log_likelihood, policy.fit)
    baseline = maximised_validation_likelihood(context, robot, accepted, -inf if is_exact else inf)
    scores = fit_candidates(context, label, tasks, data, baseline, search_round.stops_at_first)
    if is_exact:
        return scores
    try:
        context.time_limit.check()
        if search_round.rival is None and not any(leaves_noise(context, score) for score in scores.values()):
            tasks = search_round.tasks(search_round.larger_models(), min_log_likelihood, policy.fit)
            scores |= fit_candidates(context, label, tasks, data, baseline)
        tasks = search_round.refits(scores.values(), list(starts), policy.selection, policy.fit.fine_cost_tolerance)
        return scores | fit_candidates(context, f"{label}, all samples", tasks, estimation, baseline)
    except OutOfTimeError:
        return _below_exact_baseline(context, baseline, scores)


def _scores_beside_disturbance(
    context: IdentificationContext, label: str, search_round: SearchRound, starts: Starts
) -> dict[Hypothesis, CandidateScore]:
    """Scores of a round beside a disturbance; the fit of the baseline takes as long as a candidate's: side by side."""
    split, robot, accepted = context.split, search_round.robot, search_round.accepted
    pending = context.workers.submit(coarse_validation_likelihood, context.fitter, robot, accepted, split.validation)
    min_log_likelihood = context.fitter.log_likelihood(robot, accepted, split.estimation)
    tasks = search_round.tasks(starts, min_log_likelihood, context.policy.fit)
    scores = fit_candidates(context, label, tasks, split.estimation, 0.0)
    with context.time_limit.suspended():
        baseline = pending.result()
    scores = {h: replace(score, evidence=score.evidence - baseline) for h, score in scores.items()}
    scores |= _refitted_beside_own_disturbance(context, label, accepted, scores, baseline)
    if not accepted:
        scores |= _refitted_beside_small_disturbance(context, label, starts, scores, baseline)
        scores |= _refitted_at_other_optima(context, label, starts, scores, baseline)
    try:
        context.time_limit.check()
        return _with_exact_baseline(context, search_round, baseline, scores)
    except OutOfTimeError:
        return _below_exact_baseline(context, baseline, scores)


def _refitted_beside_own_disturbance(
    context: IdentificationContext,
    label: str,
    accepted: Sequence[Hypothesis],
    scores: Mapping[Hypothesis, CandidateScore],
    baseline: float,
) -> dict[Hypothesis, CandidateScore]:
    """Better scores of the candidates that explain FIT best, each beside a disturbance of its own.

    Only where the best of them on FIT is not established, or not the most parsimonious on CHECK, or in the first round
    has a simpler rival: under the disturbance of a model without it, which had to be large, an effect that explains
    nearly all may be fitted badly.
    """
    estimation, tolerance = context.split.estimation, context.policy.fit.coarse_cost_tolerance
    ranked = sorted(scores, key=lambda h: -scores[h].explained)
    best = most_parsimonious(list(scores.values()), context.policy.selection, has_disturbance=True)
    if best and best.hypothesis == ranked[0] and best.evidence >= context.evidence_threshold():
        rival = None if accepted else simpler_rival(best, scores.values(), context.policy.selection)
        if rival is None:
            return {}
        ranked = [best.hypothesis, rival.hypothesis]
    tasks = {
        h: FitTask(tuple(with_hypothesis(accepted, h)), (scores[h].fit.robot,), -inf, tolerance, disturbance_refits=2)
        for h in ranked[: context.policy.selection.always_refitted]
    }
    refits = fit_candidates(context, f"{label}, own disturbance", tasks, estimation, baseline)
    return {h: score for h, score in refits.items() if score.evidence > scores[h].evidence}


def _refitted_beside_small_disturbance(
    context: IdentificationContext,
    label: str,
    starts: Starts,
    scores: Mapping[Hypothesis, CandidateScore],
    baseline: float,
) -> dict[Hypothesis, CandidateScore]:
    """Better scores of the candidates that are likeliest beside a small disturbance, and fitted to FIT beside it first.

    Where none is established in the first round, and much is missed: its disturbance may take up on FIT what an effect
    explains on CHECK, and leads fits to where both explain a part. All drums of a platform on four cables had a radius
    ratio of 1.05, and 1.017 beside errors of position that were as large as what was missed.
    """
    established = [score for score in scores.values() if score.evidence >= context.evidence_threshold()]
    if established or not scores or not _misses_much(context):
        return {}
    policy, estimation = context.policy, context.split.estimation
    small = disturbance_prior(context.robot, context.fitter.noise, policy.fit.disturbance).median
    beside_small = replace(context, fitter=context.fitter.with_disturbance(small))

    def with_log_likelihood(robot: Robot, hypothesis: Hypothesis) -> tuple[float, Robot]:
        return finite_log_likelihood(beside_small.fitter, robot, (hypothesis,), context.head), robot

    likeliest = {h: max((with_log_likelihood(robot, h) for robot in starts[h]), key=itemgetter(0)) for h in scores}
    tasks = {
        h: FitTask((h,), (likeliest[h][1],), -inf, policy.fit.coarse_cost_tolerance, disturbance_refits=2)
        for h in sorted(scores, key=lambda h: -likeliest[h][0])[: policy.selection.always_refitted]
    }
    refits = fit_candidates(beside_small, f"{label}, small disturbance", tasks, estimation, baseline)
    return {
        h: replace(score, explained=scores[h].explained)
        for h, score in refits.items()
        if score.evidence > scores[h].evidence
    }


def _misses_much(context: IdentificationContext) -> bool:
    """Whether the declared robot misses more than a random force that the sensors hardly show."""
    (missed,), _ = missed_on_validation(context, context.robot)
    return missed > context.policy.size.max_size_of_disturbance**2


def _refitted_at_other_optima(
    context: IdentificationContext,
    label: str,
    starts: Starts,
    scores: Mapping[Hypothesis, CandidateScore],
    baseline: float,
) -> dict[Hypothesis, CandidateScore]:
    """Scores of the best candidate and a rival that was fitted at the wrong optimum, if it explains more then.

    For what is nonlinear and large in the first round: its disturbance has to make up for all that is missed.
    """
    policy, estimation, workers = context.policy.selection, context.split.estimation, context.workers
    best = most_parsimonious(list(scores.values()), policy, has_disturbance=True)
    rival = best and misfitted_rival(best, scores.values(), policy)
    if best is None or rival is None:
        return {}
    tolerance = context.policy.fit.coarse_cost_tolerance
    tasks = [FitTask((s.hypothesis,), (s.fit.robot, *starts[s.hypothesis]), -inf, tolerance) for s in (best, rival)]
    calls = [(context.fitter, task, estimation, policy) for task in tasks]
    try:
        robots = dict(workers.map_unordered(fit_at_another_optimum, calls))
    except OutOfTimeError:
        context.leave_untried(f"other optima of {rival.hypothesis.label(context.robot)} ({label})")
        return {}
    if robots[1] is None:
        return {}
    refit_tasks = {
        task.chosen[-1]: replace(task, starts=(robots[number] or task.starts[0],), disturbance_refits=2)
        for number, task in enumerate(tasks)
    }
    refits = fit_candidates(context, f"{label}, other optima", refit_tasks, estimation, baseline)
    strongest = most_parsimonious(list(refits.values()), policy)
    return refits if strongest and strongest.hypothesis == rival.hypothesis else {}


def _with_exact_baseline(
    context: IdentificationContext,
    search_round: SearchRound,
    baseline: float,
    scores: dict[Hypothesis, CandidateScore],
) -> dict[Hypothesis, CandidateScore]:
    """The scores against the exact maximum of the model without them, where a coarse one does not decide."""
    margin = max((score.evidence for score in scores.values()), default=0.0) - context.evidence_threshold()
    if not 0.0 < margin < context.policy.selection.coarse_tie(baseline):
        return scores
    exact = maximised_validation_likelihood(context, search_round.robot, search_round.accepted, -inf)
    return {h: replace(score, evidence=score.evidence - (exact - baseline)) for h, score in scores.items()}


def _below_exact_baseline(
    context: IdentificationContext, baseline: float, scores: Mapping[Hypothesis, CandidateScore]
) -> dict[Hypothesis, CandidateScore]:
    """The scores less what a coarse baseline may be too low by: there is no time for an exact one."""
    margin = context.policy.selection.coarse_tie(baseline)
    return {h: replace(score, evidence=score.evidence - margin) for h, score in scores.items()}


def _predict_gains(context: IdentificationContext, search_round: SearchRound) -> tuple[Predictions, Predictions]:
    """Predicted gains of a round's candidates, and others where these may miss a large effect.

    Those are with process noise where the model is far from noise, and under a small disturbance where it has one: the
    fitted one may have taken up what is slow.
    """
    robot, accepted, fitter = search_round.robot, search_round.accepted, context.fitter
    candidates = search_round.candidates(context.robot)
    # A model far from noise shows it in a part of the recording; a model near noise needs all of it.
    data = context.split.estimation if search_round.is_white else context.head
    runs = [ScoreRun(fitter, data)]
    if fitter.has_disturbance:
        prior = disturbance_prior(robot, fitter.noise, context.policy.fit.disturbance)
        runs.append(ScoreRun(fitter.with_disturbance(prior.median), context.head))
    elif not search_round.is_white:
        runs.append(ScoreRun(fitter, data, context.policy.score_test.rough_noise_density))
    predictions, *by_other_run = score_tests_in_workers(context, robot, accepted, candidates, runs)
    misleading = misleading_predictions(predictions, robot.cable_numbers)
    predictions |= grid_search(context, robot, accepted, data, misleading)
    if not fitter.has_disturbance:
        return predictions, by_other_run[0] if by_other_run else {}
    under_median = replace(context, fitter=runs[1].fitter)
    misleading = misleading_predictions(by_other_run[0], robot.cable_numbers)
    return predictions, by_other_run[0] | grid_search(under_median, robot, accepted, context.head, misleading)
