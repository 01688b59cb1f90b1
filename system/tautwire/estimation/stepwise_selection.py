"""Stepwise selection of effects: fitted on estimation data, accepted on validation data.

The likelihood ratio on samples that did not fit a hypothesis, against the present model at its best on those same
samples, is an e-value: where nothing is to be found its mean is at most one, so it exceeds ``n / alpha`` for any of n
hypotheses with probability at most alpha.

Source: Wasserman, Ramdas and Balakrishnan (2020), Universal inference, PNAS 117(29), 16880-16890.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import inf

from ..robot.schema import Robot
from .candidate_fits import (
    coarse_validation_likelihood,
    fit_candidates,
    fit_model,
    leaves_noise,
    maximised_validation_likelihood,
)
from .candidate_proposals import FitTask, SearchRound, shortlist, starting_robots
from .candidate_scores import CandidateScore, most_parsimonious, unfitted_score
from .disturbance import Disturbance
from .disturbance_fit import marginal_log_likelihood, with_fitted_disturbance
from .grid_search import grid_search, zero_slope_predictions
from .hypotheses import Hypothesis, with_hypothesis
from .identification_context import IdentificationContext
from .parameter_fit import Fit
from .residual_analysis import residuals_are_white
from .score_test import PredictedGain, score_test_in_workers
from .time_limit import OutOfTimeError
from .trace_result import Candidate

Predictions = dict[Hypothesis, PredictedGain]


@dataclass(frozen=True)
class SelectionResult:
    """Result of a selection: the accepted hypotheses in order, evidence of each, their joint fit, all candidates.

    ``disturbance`` is the one beside them, None where none was assumed.
    """

    accepted: tuple[Hypothesis, ...]
    evidence: tuple[float, ...]
    fit: Fit
    candidates: tuple[Candidate, ...]
    confusable: tuple[tuple[str, ...], ...]
    disturbance: Disturbance | None = None


def nothing_selected(robot: Robot) -> SelectionResult:
    """The selection before any search: the robot as it is."""
    return SelectionResult((), (), Fit.without_parameters(robot), (), ())


def select_effects(context: IdentificationContext) -> SelectionResult:
    """Select the effects that a model lacks: forward while one is significant, then backward.

    What the robot file declares, effects included, stays as it is until a hypothesis replaces it. Where time is up, it
    is what was selected until then.
    """
    selection = _StepwiseSelection(context, Fit.without_parameters(context.robot))
    try:
        selection.add()
        selection.eliminate()
    except OutOfTimeError:
        context.leave_untried("effects beyond those found, and alternatives to them")
    return selection.result()


def with_disturbance_beside(
    context: IdentificationContext, accepted: Sequence[Hypothesis], fit: Fit
) -> tuple[IdentificationContext, Fit]:
    """The context with the disturbance fitted beside the accepted hypotheses, and their fit under it."""
    if not context.fitter.has_disturbance:
        return context, fit
    fitter = with_fitted_disturbance(context.fitter, fit.robot, accepted, context.split.estimation)
    context = replace(context, fitter=fitter)
    return context, fit_model(context, accepted, fit.robot)


def _search_round(
    context: IdentificationContext,
    number: int,
    robot: Robot,
    accepted: Sequence[Hypothesis],
    rival: CandidateScore | None = None,
) -> SearchRound:
    has_disturbance = context.fitter.has_disturbance
    # A disturbance takes up what is not white.
    is_white = has_disturbance or all(
        residuals_are_white(context.fitter.innovations(robot, data), data.rows, context.policy.residual_analysis)
        for data in (context.split.validation, context.split.estimation)
    )
    return SearchRound(number, robot, tuple(accepted), rival, is_white, has_disturbance or not is_white)


def score_candidates(context: IdentificationContext, search_round: SearchRound) -> tuple[list[CandidateScore], bool]:
    """Score every hypothesis of a round, and tell whether all of the shortlist were fitted.

    Those with a large enough predicted gain are fitted; with a rival only what comes near it to all samples.
    """
    policy, robot, accepted = context.policy, search_round.robot, search_round.accepted
    label = f"round {search_round.number}"
    context.progress(f"{label}: score test", 0.0)
    predictions, rough_predictions = _predict_gains(context, search_round)
    shortlisted = shortlist(predictions, rough_predictions, policy.score_test)
    data = context.split.estimation
    if not search_round.is_white:
        coarse_data = data.first(policy.selection.coarse_samples)
        predictions |= grid_search(context, robot, accepted, coarse_data, {h: predictions[h] for h in shortlisted})
        data = coarse_data if search_round.rival else context.head
    starts = {
        h: starting_robots(robot, h, [p[h] for p in (predictions, rough_predictions) if h in p]) for h in shortlisted
    }
    min_log_likelihood = context.fitter.log_likelihood(robot, accepted, data)
    tasks = search_round.tasks(starts, min_log_likelihood, policy.fit)
    # Far from noise the candidates need only be ranked against each other.
    is_exact = search_round.is_white and not context.fitter.has_disturbance
    if context.fitter.has_disturbance:
        baseline, scores = _fitted_beside_baseline(context, label, search_round, tasks)
    else:
        baseline = maximised_validation_likelihood(context, robot, accepted, -inf if is_exact else inf)
        scores = fit_candidates(context, label, tasks, data, baseline, search_round.stops_at_first)
    try:
        context.time_limit.check()
        if not search_round.is_white:
            if search_round.rival is None and not any(leaves_noise(context, score) for score in scores.values()):
                tasks = search_round.tasks(search_round.larger_models(), min_log_likelihood, policy.fit)
                scores |= fit_candidates(context, label, tasks, data, baseline)
            tasks = search_round.refits(scores.values(), shortlisted, policy.selection, policy.fit.fine_cost_tolerance)
            scores |= fit_candidates(context, f"{label}, all samples", tasks, context.split.estimation, baseline)
        if context.fitter.has_disturbance:
            scores = _with_exact_baseline(context, search_round, baseline, scores)
    except OutOfTimeError:
        scores = scores if is_exact else _below_exact_baseline(context, baseline, scores)
    context.progress(f"{label}: done", 1.0)
    unfitted = [unfitted_score(robot, h, predictions[h]) for h in predictions if h not in scores]
    return [*scores.values(), *unfitted], not search_round.stops_at_first or scores.keys() >= set(shortlisted)


def _fitted_beside_baseline(
    context: IdentificationContext, label: str, search_round: SearchRound, tasks: Mapping[Hypothesis, FitTask]
) -> tuple[float, dict[Hypothesis, CandidateScore]]:
    """Baseline and scores of a round beside a disturbance, whose fit takes as long as a candidate's: side by side."""
    split, robot, accepted = context.split, search_round.robot, search_round.accepted
    pending = context.workers.submit(coarse_validation_likelihood, context.fitter, robot, accepted, split.validation)
    scores = fit_candidates(context, label, tasks, split.estimation, 0.0)
    with context.time_limit.suspended():
        baseline = pending.result()
    scores = {h: replace(score, evidence=score.evidence - baseline) for h, score in scores.items()}
    return baseline, scores | _refitted_beside_own_disturbance(context, label, accepted, scores, baseline)


def _refitted_beside_own_disturbance(
    context: IdentificationContext,
    label: str,
    accepted: Sequence[Hypothesis],
    scores: Mapping[Hypothesis, CandidateScore],
    baseline: float,
) -> dict[Hypothesis, CandidateScore]:
    """Better scores of the candidates that explain FIT best, each beside a disturbance of its own.

    Only where the best of them is not established: under the disturbance of a model without it, which had to be large,
    an effect that explains nearly all may be fitted badly.
    """
    estimation, tolerance = context.split.estimation, context.policy.fit.coarse_cost_tolerance
    models = {h: tuple(with_hypothesis(accepted, h)) for h in scores}
    explained = {h: context.fitter.log_likelihood(scores[h].fit.robot, models[h], estimation) for h in scores}
    ranked = sorted(scores, key=lambda h: -explained[h])
    required = max((context.evidence_threshold(), *(score.evidence for score in scores.values())))
    if not ranked or scores[ranked[0]].evidence >= required:
        return {}
    tasks = {
        h: FitTask(models[h], (scores[h].fit.robot,), -inf, tolerance, disturbance_refits=2)
        for h in ranked[: context.policy.selection.always_refitted]
    }
    refits = fit_candidates(context, f"{label}, own disturbance", tasks, estimation, baseline)
    return {h: score for h, score in refits.items() if score.evidence > scores[h].evidence}


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
    """Predicted gains of a round's candidates, and with process noise, where the model is far from noise."""
    robot, accepted = search_round.robot, search_round.accepted
    candidates = search_round.candidates(context.robot)
    # A model far from noise shows it in a part of the recording; a model near noise needs all of it.
    data = context.split.estimation if search_round.is_white else context.head
    predictions = score_test_in_workers(context, robot, accepted, candidates, data)
    predictions |= grid_search(context, robot, accepted, data, zero_slope_predictions(predictions))
    if search_round.is_white:
        return predictions, {}
    density = context.policy.score_test.rough_noise_density
    return predictions, score_test_in_workers(context, robot, accepted, candidates, data, density)


@dataclass
class _StepwiseSelection:
    """A selection in progress; at any time its accepted hypotheses and their fit belong together.

    ``evidences`` are those of the hypotheses that passed the backward elimination, ``forward_evidences`` those with
    which they were accepted.
    """

    context: IdentificationContext
    current: Fit
    accepted: list[Hypothesis] = field(default_factory=list)
    candidates: list[Candidate] = field(default_factory=list)
    complete_rounds: dict[tuple[Hypothesis, ...], list[CandidateScore]] = field(default_factory=dict)
    forward_evidences: dict[Hypothesis, float] = field(default_factory=dict)
    confusable: dict[Hypothesis, list[str]] = field(default_factory=dict)
    evidences: dict[Hypothesis, float] = field(default_factory=dict)
    swaps: int = 0

    def add(self) -> None:
        """Forward selection: the best hypothesis of each round, while it is significant."""
        self.current = fit_model(self.context, self.accepted)
        for number in range(1, self.context.policy.selection.max_rounds + 1):
            search_round = _search_round(self.context, number, self.current.robot, self.accepted)
            scores, is_complete = score_candidates(self.context, search_round)
            if is_complete:
                self.complete_rounds[tuple(self.accepted)] = scores
            policy, has_disturbance = self.context.policy.selection, self.context.fitter.has_disturbance
            best = most_parsimonious(scores, policy, has_disturbance)
            first_evidence = next(iter(self.forward_evidences.values()), 0.0)
            threshold = self.context.evidence_threshold()
            required_evidence = policy.required_evidence(threshold, first_evidence, has_disturbance)
            significant = best is not None and best.evidence > required_evidence
            self.candidates += [trial.candidate(number, significant and trial is best) for trial in scores]
            if best is None or not significant:
                break
            self.accepted, self.current = with_hypothesis(self.accepted, best.hypothesis), best.fit
            # One that loses cables to another keeps its evidence.
            last = {h: e for h in self.accepted for old, e in self.forward_evidences.items() if h.overlaps(old)}
            self.forward_evidences |= {**last, best.hypothesis: best.evidence}
            self.context, self.current = with_disturbance_beside(self.context, self.accepted, best.fit)

    def eliminate(self) -> None:
        """Backward elimination: each accepted hypothesis against its best alternatives, and against its absence.

        It is dropped where it is not needed, and replaced by an alternative that explains more, or as much with fewer
        parameters.
        """
        policy = self.context.policy.selection
        pending = list(self.accepted)
        reported = set(self.complete_rounds)
        while pending:
            tested = pending.pop(0)
            others = [a for a in self.accepted if a is not tested]
            without = fit_model(self.context, others, self.current.robot, coarse=True)
            score = CandidateScore(tested, self.current, self._evidence(without, others), float("nan"))
            if score.evidence < self.context.evidence_threshold():
                self.accepted, self.current = others, fit_model(self.context, others, without.robot)
                self.context, self.current = with_disturbance_beside(self.context, others, self.current)
                pending = list(others)
                continue
            number = policy.max_rounds + 1 + len(self.evidences) + self.swaps
            alternatives = self._alternatives(number, without.robot, others, score)
            contender = self._comparable(score, others)
            best = most_parsimonious([contender, *alternatives], policy, self.context.fitter.has_disturbance)
            if tuple(others) not in reported:
                self.candidates += [t.candidate(number, t is best) for t in alternatives]
            reported.add(tuple(others))
            if best is not None and best is not contender and self.swaps < policy.max_swaps:
                self.accepted, self.current = with_hypothesis(others, best.hypothesis), best.fit
                pending = [a for a in self.accepted if a is not self.accepted[-1]]
                tested, score, self.swaps = self.accepted[-1], best, self.swaps + 1
            self.evidences[tested] = score.evidence
            names = {t.hypothesis.effect.name for t in alternatives if score.is_confusable_with(t, policy)}
            self.confusable[tested] = sorted(names - {tested.effect.name})

    def result(self) -> SelectionResult:
        """What is selected so far."""
        evidences = self.forward_evidences | self.evidences
        return SelectionResult(
            tuple(self.accepted),
            tuple(evidences[a] for a in self.accepted),
            self.current,
            tuple(self.candidates),
            tuple((a.effect.name, other) for a in self.accepted for other in self.confusable.get(a, ())),
            self.context.fitter.noise.disturbance,
        )

    def _comparable(self, score: CandidateScore, others: Sequence[Hypothesis]) -> CandidateScore:
        """The score to hold against alternatives: beside a disturbance that of the round in which these were scored.

        The disturbance has been fitted anew beside the accepted hypotheses since.
        """
        known = self.complete_rounds.get(tuple(others), []) if self.context.fitter.has_disturbance else []
        return next((each for each in known if each.hypothesis == score.hypothesis), score)

    def _alternatives(
        self, number: int, robot: Robot, others: Sequence[Hypothesis], tested: CandidateScore
    ) -> list[CandidateScore]:
        """Scores of the alternatives to one hypothesis beside the others."""
        known = self.complete_rounds.get(tuple(others))
        if known is not None:
            return [score for score in known if not score.hypothesis.overlaps(tested.hypothesis)]
        scores, _ = score_candidates(self.context, _search_round(self.context, number, robot, others, tested))
        self.complete_rounds[tuple(others)] = scores
        return scores

    def _evidence(self, without: Fit, others: Sequence[Hypothesis]) -> float:
        """Log-likelihood ratio on validation data of all accepted hypotheses against the others at their best there."""
        validation = self.context.split.validation
        fitter, robot = self.context.fitter, self.current.robot
        log_likelihood = fitter.log_likelihood(robot, self.accepted, validation)
        if fitter.has_disturbance:
            log_likelihood = max(log_likelihood, marginal_log_likelihood(fitter, robot, self.accepted, validation))
        return log_likelihood - maximised_validation_likelihood(
            self.context, without.robot, others, log_likelihood - self.context.evidence_threshold()
        )
