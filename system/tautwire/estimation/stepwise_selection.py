"""Stepwise selection of effects: fitted on estimation data, accepted on validation data.

The likelihood ratio on samples that did not fit a hypothesis, against the present model at its best on those same
samples, is an e-value: where nothing is to be found its mean is at most one, so it exceeds ``n / alpha`` for any of n
hypotheses with probability at most alpha.

Source: Wasserman, Ramdas and Balakrishnan (2020), Universal inference, PNAS 117(29), 16880-16890.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from math import inf, log

from ..robot.schema import EffectSetting, Robot
from .candidate_scores import CandidateScore, most_parsimonious, setting_of, shortlist, unfitted_score
from .estimation_data import DataSet, DataSplit
from .grid_search import grid_search, zero_slope_predictions
from .hypotheses import Hypothesis, hypotheses, split_by_cable, with_hypothesis, with_larger_forms
from .parameter_fit import (
    FINE_COST_TOLERANCE,
    Fit,
    FitTask,
    Fitter,
    ValidatedFit,
    fit_and_validate,
    fit_and_validate_in_worker,
)
from .residual_analysis import residuals_are_white
from .score_test import PredictedGain, score_test_in_workers
from .trace_result import Candidate
from .worker_pool import WorkerPool

Progress = Callable[[str, float], None]

MAX_ROUNDS = 4
# Fits to a part of the data count as tied within this many nats plus this share of the log-likelihood.
COARSE_TIE_NATS, COARSE_TIE_SHARE = 50.0, 1e-3
# Relative change of the cost at which fits to a part of the data stop.
COARSE_COST_TOLERANCE = 1e-4
# Acceleration noise density (m/s^2 per root hertz) of a second score test where the model is far from noise.
SCREENING_NOISE_DENSITY = 0.1
# How many of the best predictions are always fitted to all samples.
ALWAYS_REFITTED = 2
# Mean square of innovations below which a model needs no larger form of the same effects.
MAX_NOISE_MEAN_SQUARE = 1.1
MAX_SWAPS = 4
# Samples by which starting values are ranked, and alternatives that deserve a fit to all samples.
COARSE_SAMPLES = 600


@dataclass(frozen=True)
class SelectionResult:
    """Result of a selection: the accepted hypotheses in order, evidence of each, their joint fit, all candidates."""

    accepted: tuple[Hypothesis, ...]
    evidence: tuple[float, ...]
    fit: Fit
    candidates: tuple[Candidate, ...]
    confusable: tuple[tuple[str, ...], ...]


class StepwiseSelection:
    """Forward selection while a hypothesis is significant, then backward elimination of those made needless.

    What the robot file declares, effects included, stays as it is until a hypothesis replaces it.
    """

    def __init__(
        self,
        robot: Robot,
        fitter: Fitter,
        split: DataSplit,
        alpha: float,
        progress: Progress,
        workers: WorkerPool | None = None,
    ) -> None:
        self.robot = robot
        self.fitter = fitter
        self.split = split
        self.progress = progress
        self.workers = workers or WorkerPool(1, fitter.poll_interrupts)
        self.threshold = log(len(hypotheses(robot)) / alpha)
        self._scores: dict[tuple[Hypothesis, ...], list[CandidateScore]] = {}

    def run(self) -> SelectionResult:
        """The whole search."""
        accepted: list[Hypothesis] = []
        current = self._fit(accepted)
        candidates: list[Candidate] = []
        for round_number in range(1, MAX_ROUNDS + 1):
            scores = self._score_candidates(round_number, current.robot, accepted)
            best = most_parsimonious(scores)
            significant = best is not None and best.evidence > self.threshold
            candidates += [trial.candidate(round_number, significant and trial is best) for trial in scores]
            if best is None or not significant:
                break
            accepted = with_hypothesis(accepted, best.hypothesis)
            current = best.fit
        return self._backward_elimination(accepted, current, candidates)

    def _fit(self, chosen: Sequence[Hypothesis], start: Robot | None = None, coarse: bool = False) -> Fit:
        """Fit of the chosen hypotheses, from the values of a robot that has them; coarse on a part of the samples."""
        robot = self.robot
        for hypothesis in chosen:
            robot = robot.with_effect(setting_of(start, hypothesis) if start else hypothesis.setting(robot))
        data = self.split.estimation.head if coarse else self.split.estimation
        return self.fitter.fit_from(
            [robot], chosen, data, -inf, COARSE_COST_TOLERANCE if coarse else FINE_COST_TOLERANCE
        )

    def _maximised_validation_likelihood(self, robot: Robot, chosen: Sequence[Hypothesis], reference: float) -> float:
        """Maximised log-likelihood of the validation data, as the denominator of an e-value must be.

        Coarse where it stays below ``reference`` by more than the fit's cost tolerance can be wrong.
        """
        validation = self.split.validation
        if not chosen:
            return self._log_likelihood(robot, chosen, validation)
        for stop in (COARSE_COST_TOLERANCE, FINE_COST_TOLERANCE):
            robot = self.fitter.fit_from([robot], chosen, validation, -inf, stop).robot
            log_likelihood = self._log_likelihood(robot, chosen, validation)
            if reference - log_likelihood > COARSE_TIE_NATS + COARSE_TIE_SHARE * abs(log_likelihood):
                break
        return log_likelihood

    def _log_likelihood(self, robot: Robot, chosen: Sequence[Hypothesis], data: DataSet) -> float:
        return self.fitter.judged(robot, chosen, data).log_likelihood(data.rows)

    def _alternatives(
        self, round_number: int, robot: Robot, accepted: list[Hypothesis], score: CandidateScore
    ) -> list[CandidateScore]:
        """Scores of the alternatives to one hypothesis beside the accepted ones."""
        scores = self._scores.get(tuple(accepted))
        if scores is not None:
            return [trial for trial in scores if not trial.hypothesis.overlaps(score.hypothesis)]
        return self._score_candidates(round_number, robot, accepted, score)

    def _score_candidates(
        self, round_number: int, robot: Robot, accepted: list[Hypothesis], rival: CandidateScore | None = None
    ) -> list[CandidateScore]:
        """Score every hypothesis beside the accepted ones; those with a large enough predicted gain are fitted.

        With a ``rival`` only what comes near it is fitted to all samples. Without one, and beside others, the first
        that leaves noise is enough: alternatives to all accepted ones are tried later.
        """
        validation, estimation = self.split.validation, self.split.estimation
        excluded = [*accepted, rival.hypothesis] if rival else accepted
        candidates = [h for h in hypotheses(self.robot) if not any(a.overlaps(h) for a in excluded)]
        adequate = all(
            residuals_are_white(self.fitter.innovations(robot, sample), sample.rows)
            for sample in (validation, estimation)
        )
        # A model far from noise shows it in a part of the recording; a model near noise needs all of it.
        screening_data = estimation if adequate else estimation.head
        sample = screening_data if adequate or rival is None else estimation.first(COARSE_SAMPLES)
        self.progress(f"round {round_number}: screening", 0.0)
        predictions = score_test_in_workers(robot, accepted, candidates, self.fitter, screening_data, self.workers)
        predictions |= grid_search(
            robot, accepted, self.fitter, screening_data, zero_slope_predictions(predictions), self.workers
        )
        rough_predictions = (
            {}
            if adequate
            else score_test_in_workers(
                robot, accepted, candidates, self.fitter, screening_data, self.workers, SCREENING_NOISE_DENSITY
            )
        )
        shortlisted = shortlist(predictions, rough_predictions)
        if not adequate:
            coarse_data, shortlisted_predictions = (
                estimation.first(COARSE_SAMPLES),
                {h: predictions[h] for h in shortlisted},
            )
            predictions |= grid_search(robot, accepted, self.fitter, coarse_data, shortlisted_predictions, self.workers)
        starts = {
            h: self._start_robots(robot, h, [p[h] for p in (predictions, rough_predictions) if h in p])
            for h in shortlisted
        }
        # Far from noise the candidates need only be ranked against each other.
        baseline = self._maximised_validation_likelihood(robot, accepted, -inf if adequate else inf)
        min_log_likelihood = self._log_likelihood(robot, accepted, sample)
        stop_at_first = bool(accepted) and rival is None and not adequate
        scores = self._fit_candidates(
            round_number, accepted, starts, sample, min_log_likelihood, baseline, stop_at_first
        )
        if not adequate and rival is None and not any(trial.mean_square < MAX_NOISE_MEAN_SQUARE for trial in scores):
            larger = [*with_larger_forms(accepted), *split_by_cable(accepted)]
            starts = {h: (robot.with_effect(h.setting(robot)),) for h in larger}
            scores += self._fit_candidates(round_number, accepted, starts, sample, min_log_likelihood, baseline)
        if not adequate:
            scores = self._refit_best(
                round_number, accepted, scores, () if rival else shortlisted[:ALWAYS_REFITTED], baseline, rival
            )
        self.progress(f"round {round_number}: done", 1.0)
        fitted = {trial.hypothesis for trial in scores}
        scores += [unfitted_score(robot, h, predictions[h]) for h in predictions if h not in fitted]
        if not stop_at_first or fitted.issuperset(shortlisted):
            self._scores[tuple(accepted)] = scores
        return scores

    def _fit_candidates(
        self,
        round_number: int,
        accepted: list[Hypothesis],
        starts: Mapping[Hypothesis, tuple[Robot, ...]],
        data: DataSet,
        min_log_likelihood: float,
        baseline: float,
        stop_at_first: bool = False,
    ) -> list[CandidateScore]:
        cost_tolerance = FINE_COST_TOLERANCE if data is self.split.estimation else COARSE_COST_TOLERANCE
        tasks = {
            h: FitTask(tuple(with_hypothesis(accepted, h)), starts[h], min_log_likelihood, cost_tolerance)
            for h in starts
        }
        scores = self._run_fits(f"round {round_number}", tasks, data, baseline, stop_at_first)
        return [scores[hypothesis] for hypothesis in starts if hypothesis in scores]

    def _start_robots(
        self, robot: Robot, hypothesis: Hypothesis, predictions: Sequence[PredictedGain]
    ) -> tuple[Robot, ...]:
        default_setting = hypothesis.setting(robot)
        predicted_settings = [
            EffectSetting(default_setting.name, {**default_setting.values, **p.values}, default_setting.cables)
            for p in predictions
        ]
        return tuple(robot.with_effect(setting) for setting in (*predicted_settings, default_setting))

    def _refit_best(
        self,
        round_number: int,
        accepted: list[Hypothesis],
        scores: list[CandidateScore],
        always_refitted: Sequence[Hypothesis],
        baseline: float,
        rival: CandidateScore | None,
    ) -> list[CandidateScore]:
        """The best candidates refitted to all samples."""
        top = max((trial.evidence for trial in (*scores, *([rival] if rival else []))), default=0.0)
        min_evidence = top - COARSE_TIE_NATS - COARSE_TIE_SHARE * abs(top)
        selected = [trial for trial in scores if trial.evidence >= min_evidence or trial.hypothesis in always_refitted]
        tasks = {
            t.hypothesis: FitTask(
                tuple(with_hypothesis(accepted, t.hypothesis)), (t.fit.robot,), -inf, FINE_COST_TOLERANCE
            )
            for t in selected
        }
        refitted = self._run_fits(f"round {round_number}, all of it", tasks, self.split.estimation, baseline)
        return [refitted.get(trial.hypothesis, trial) for trial in scores]

    def _run_fits(
        self,
        label: str,
        tasks: Mapping[Hypothesis, FitTask],
        data: DataSet,
        baseline: float,
        stop_at_first: bool = False,
    ) -> dict[Hypothesis, CandidateScore]:
        """Scores of the hypotheses of some tasks, without those that the cables cannot hold.

        With ``stop_at_first`` only until one leaves noise.
        """
        order = list(tasks)
        scores = {}
        with closing(self._submit_fits(list(tasks.values()), data)) as attempts:
            for done, (index, validated) in enumerate(attempts, start=1):
                hypothesis = order[index]
                self.progress(f"{label}: {hypothesis.label(self.robot)}", done / len(order))
                if validated is not None:
                    gain = validated.log_likelihood - baseline
                    scores[hypothesis] = CandidateScore(hypothesis, validated.fit, gain, validated.mean_square)
                if stop_at_first and validated is not None and validated.mean_square < MAX_NOISE_MEAN_SQUARE:
                    break
        return scores

    def _submit_fits(self, tasks: list[FitTask], data: DataSet) -> Generator[tuple[int, ValidatedFit | None]]:
        validation = self.split.validation
        if self.workers.processes == 1:
            return self.workers.map_unordered(
                partial(fit_and_validate, self.fitter), [(task, data, validation) for task in tasks]
            )
        return self.workers.map_unordered(
            fit_and_validate_in_worker, [(self.fitter.noise, task, data, validation) for task in tasks]
        )

    def _backward_elimination(
        self, accepted: list[Hypothesis], current: Fit, candidates: list[Candidate]
    ) -> SelectionResult:
        """Backward elimination: each accepted hypothesis against its best alternatives, and against its absence.

        It is dropped where it is not needed, and replaced by an alternative that explains more, or as much with fewer
        parameters.
        """
        confusable: dict[Hypothesis, list[str]] = {}
        evidences: dict[Hypothesis, float] = {}
        pending = list(accepted)
        swaps = 0
        reported = set(self._scores)
        while pending:
            tested = pending.pop(0)
            others = [a for a in accepted if a is not tested]
            without = self._fit(others, current.robot, coarse=True)
            score = CandidateScore(tested, current, self._evidence(current, accepted, without, others), float("nan"))
            if score.evidence < self.threshold:
                accepted, current, pending = others, self._fit(others, without.robot), list(others)
                continue
            round_number = MAX_ROUNDS + 1 + len(evidences) + swaps
            alternatives = self._alternatives(round_number, without.robot, others, score)
            best = most_parsimonious([score, *alternatives])
            candidates += [t.candidate(round_number, t is best) for t in alternatives if tuple(others) not in reported]
            reported.add(tuple(others))
            if best is not None and best is not score and swaps < MAX_SWAPS:
                accepted, current = with_hypothesis(others, best.hypothesis), best.fit
                pending = [a for a in accepted if a is not accepted[-1]]
                tested, score, swaps = accepted[-1], best, swaps + 1
            evidences[tested] = score.evidence
            names = {t.hypothesis.effect.name for t in alternatives if score.is_confusable_with(t)}
            confusable[tested] = sorted(names - {tested.effect.name})
        return SelectionResult(
            tuple(accepted),
            tuple(evidences[a] for a in accepted),
            current,
            tuple(candidates),
            tuple((a.effect.name, other) for a in accepted for other in confusable[a]),
        )

    def _evidence(self, fit: Fit, chosen: Sequence[Hypothesis], without: Fit, others: Sequence[Hypothesis]) -> float:
        """Log-likelihood ratio on validation data of all chosen hypotheses against the others at their best there."""
        log_likelihood = self._log_likelihood(fit.robot, chosen, self.split.validation)
        return log_likelihood - self._maximised_validation_likelihood(
            without.robot, others, log_likelihood - self.threshold
        )


def select_effects(
    robot: Robot,
    fitter: Fitter,
    split: DataSplit,
    alpha: float,
    progress: Progress,
    workers: WorkerPool | None = None,
) -> SelectionResult:
    """Select the effects that a model lacks; see :class:`StepwiseSelection`."""
    return StepwiseSelection(robot, fitter, split, alpha, progress, workers).run()
