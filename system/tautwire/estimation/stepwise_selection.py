"""Stepwise selection of effects: fitted on estimation data, accepted on validation data.

The likelihood ratio on samples that did not fit a hypothesis, against the present model at its best on those same
samples, is an e-value: where nothing is to be found its mean is at most one, so it exceeds ``n / alpha`` for any of n
hypotheses with probability at most alpha.

Source: Wasserman, Ramdas and Balakrishnan (2020), Universal inference, PNAS 117(29), 16880-16890.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import UnreachableError
from ..robot.schema import Robot
from .candidate_fits import fit_model, maximised_validation_likelihood
from .candidate_proposals import SearchRound
from .candidate_scores import (
    CandidateScore,
    load_before_offsets,
    most_parsimonious,
    without_fast_relaxations,
)
from .candidate_scoring import likelier_interpolation, score_candidates
from .disturbance_fit import marginal_log_likelihood
from .estimation_data import DataSplit
from .explained_shares import missed_on_validation, missed_without_effects
from .hypotheses import Hypothesis, with_hypothesis
from .identification_context import IdentificationContext
from .parameter_fit import Fit, Fitter, NoFitError
from .residual_analysis import residuals_are_white
from .selection_result import SelectionResult, with_disturbance_beside
from .time_limit import OutOfTimeError
from .trace_result import Candidate


def select_effects(context: IdentificationContext) -> SelectionResult:
    """Select the effects that a model lacks: forward while one is significant, then backward.

    Beside a disturbance backward whenever one was added to others, too.

    What the robot file declares, effects included, stays as it is until a hypothesis replaces it. Where time is up, it
    is what was selected until then.
    """
    selection = _StepwiseSelection(context, Fit.without_parameters(context.robot), context.fitter)
    try:
        selection.add()
        selection.eliminate()
    except OutOfTimeError:
        context.leave_untried("effects beyond those found, and alternatives to them")
    except (NoFitError, UnreachableError) as error:
        context.time_limit.leave_untried(f"The search for effects ended early: {error}.")
    return selection.result()


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
    return SearchRound(number, robot, tuple(accepted), rival, is_white, has_disturbance)


@dataclass
class _StepwiseSelection:
    """A selection in progress; at any time its accepted hypotheses and their fit belong together.

    ``evidences`` are those of the hypotheses that passed the backward elimination, ``forward_evidences`` those with
    which they were accepted; ``survivors`` are the hypotheses that it left last. ``complete_rounds`` are by hypotheses
    beside which a round was scored, and the one that it was to replace; ``without_effects`` fits the robot as it is.
    """

    context: IdentificationContext
    current: Fit
    without_effects: Fitter
    accepted: list[Hypothesis] = field(default_factory=list)
    candidates: list[Candidate] = field(default_factory=list)
    complete_rounds: dict[tuple[tuple[Hypothesis, ...], Hypothesis | None], list[CandidateScore]] = field(
        default_factory=dict
    )
    forward_evidences: dict[Hypothesis, float] = field(default_factory=dict)
    confusable: dict[Hypothesis, list[str]] = field(default_factory=dict)
    evidences: dict[Hypothesis, float] = field(default_factory=dict)
    survivors: list[Hypothesis] = field(default_factory=list)
    split: DataSplit | None = None
    has_tried_each: bool = False

    def add(self) -> None:
        """Forward selection: the best hypothesis of each round, while it is significant."""
        self.current = fit_model(self.context, self.accepted)
        scores: list[CandidateScore] = []
        for _ in range(self.context.policy.selection.max_rounds):
            if self.accepted and self.context.fitter.has_disturbance and self._leaves_little(scores):
                break
            number = self._next_number()
            search_round = _search_round(self.context, number, self.current.robot, self.accepted)
            scores, is_complete = score_candidates(self.context, search_round)
            if not self.accepted:
                scores, is_complete = self._likelier_scores(number, scores, is_complete)
                self.has_tried_each = not self.context.time_limit.untried
            if is_complete:
                self.complete_rounds[tuple(self.accepted), None] = scores
            best = self._best_candidate(scores, self.current.robot)
            significant = best is not None and self._is_significant(best, self.accepted, self.current.robot)
            required = self._required_evidence(self.accepted)
            self.candidates += [trial.candidate(number, significant and trial is best, required) for trial in scores]
            if best is None or not significant:
                break
            before = list(self.accepted)
            self._accept_beside(before, best)
            if before and self.context.fitter.has_disturbance:
                # What came first stood for the second as well: another may come nearer beside it.
                self.eliminate()
            if self.accepted == before:
                break

    def _likelier_scores(
        self, number: int, scores: list[CandidateScore], is_complete: bool
    ) -> tuple[list[CandidateScore], bool]:
        """Scores of a first round with the likelier interpolation of winch speeds; as they are where time ends."""
        untried = self.context.time_limit.untried
        try:
            split = likelier_interpolation(self.context, scores)
            if split is None:
                return scores, is_complete
            context = replace(self.context, split=split)
            others = score_candidates(context, _search_round(context, number, self.current.robot, ()))
        except OutOfTimeError:
            self.context.leave_untried("winch speeds interpolated otherwise")
            return scores, is_complete
        if context.time_limit.untried != untried:
            return scores, is_complete
        self.context, self.split = context, split
        self.complete_rounds.clear()
        return others

    def _next_number(self) -> int:
        """Number of the round that follows those with candidates."""
        return 1 + max((candidate.round for candidate in self.candidates), default=0)

    def _is_significant(self, score: CandidateScore, others: Sequence[Hypothesis], without: Robot) -> bool:
        """Whether a hypothesis is established beside others, which the robot ``without`` it has.

        What acts in another component, and explains a good share of what is missed, is nothing that their forms leave:
        it has to be more than chance.
        """
        if score.evidence > self._required_evidence(others):
            return True
        components = {other.effect.component for other in others}
        if score.evidence <= self.context.evidence_threshold() or score.hypothesis.effect.component in components:
            return False
        # The fits are there: time that is up must not lose them.
        with self.context.time_limit.suspended():
            (left_without, left), floor = missed_on_validation(self.context, without, score.fit.robot)
            validation = self.context.split.validation
            missed = missed_without_effects(self.context, self.without_effects, validation, floor)
        return left_without - left >= self.context.policy.size.min_share_elsewhere * missed

    def _required_evidence(self, others: Sequence[Hypothesis]) -> float:
        """Evidence that a hypothesis needs beside the others."""
        first_evidence = next(iter(self.forward_evidences.values()), 0.0) if others else 0.0
        threshold, fitter = self.context.evidence_threshold(), self.context.fitter
        return self.context.policy.selection.required_evidence(threshold, first_evidence, fitter.has_disturbance)

    def _leaves_little(self, scores: Sequence[CandidateScore]) -> bool:
        """Whether the accepted hypotheses leave little, or nothing explains much of what a small random force may be.

        Neither they nor any other that the last round, with these ``scores``, established.
        """
        policy, validation = self.context.policy.size, self.context.split.validation
        (left,), floor = missed_on_validation(self.context, self.current.robot)
        missed = missed_without_effects(self.context, self.without_effects, validation, floor)
        if left < policy.max_left_share * missed:
            return True
        established = [score.fit.robot for score in scores if score.evidence > self.context.evidence_threshold()]
        enough = (1.0 - policy.min_explained_share) * missed
        return missed < policy.max_size_of_disturbance**2 and not (
            left <= enough or any(missed_on_validation(self.context, robot)[0][0] <= enough for robot in established)
        )

    def _best_candidate(self, scores: Sequence[CandidateScore], without: Robot) -> CandidateScore | None:
        """Best candidate of a round; beside a disturbance the likelier one of two that samples hardly tell apart."""
        if not self.context.fitter.has_disturbance:
            return self._best_or_simpler(scores, without)
        sample_interval = float(np.median(np.diff(self.context.split.estimation.recording.time)))
        scores = without_fast_relaxations(scores, without, sample_interval, self.context.policy.selection)
        best = self._best_or_simpler(scores, without)
        return best and load_before_offsets(best, scores, self.context.evidence_threshold())

    def _best_or_simpler(self, scores: Sequence[CandidateScore], without: Robot) -> CandidateScore | None:
        """Best candidate of a round, or a simpler one that ties with it and explains nearly as much.

        Beside a disturbance candidates tie within what their forms may leave; the simpler one is taken where it leaves
        no more than that of what the best explains. ``without`` is the robot without any of them.
        """
        best = most_parsimonious(scores, self.context.policy.selection)
        simplest = most_parsimonious(scores, self.context.policy.selection, self.context.fitter.has_disturbance)
        if best is None or simplest is None or simplest is best:
            return best
        # The fits are there: time that is up must not lose them.
        with self.context.time_limit.suspended():
            (missed, left, least), _ = missed_on_validation(self.context, without, simplest.fit.robot, best.fit.robot)
        return simplest if left - least <= self.context.policy.size.max_left_share_of_form * (missed - least) else best

    def eliminate(self) -> None:
        """Backward elimination: each accepted hypothesis against its best alternatives, and against its absence.

        It is dropped where it is not needed, and replaced by an alternative that explains more, or as much with fewer
        parameters.
        """
        if self.accepted == self.survivors:
            return
        policy, pending, swaps = self.context.policy.selection, list(self.accepted), 0
        dropped: list[Hypothesis] = []
        while pending:
            tested = pending.pop(0)
            others = [a for a in self.accepted if a is not tested]
            without = fit_model(self.context, others, self.current.robot, coarse=True)
            score = CandidateScore(tested, self.current, self._evidence(without, others), float("nan"))
            if not self._is_significant(score, others, without.robot):
                self._accept(others, fit_model(self.context, others, without.robot))
                pending, dropped = list(others), [*dropped, tested]
                continue
            known_scores, number = self._known_scores(others, tested), self._next_number()
            scores = known_scores
            if scores is None:
                search_round = _search_round(self.context, number, without.robot, others, score)
                scores, _ = score_candidates(self.context, search_round)
                self.complete_rounds[tuple(others), tested] = scores
            alternatives = [trial for trial in scores if not trial.hypothesis.overlaps(tested)]
            contender = self._comparable(score, others)
            compared = [contender, *alternatives]
            # One that was not needed beside this one does not come back in its place.
            allowed = [t for t in alternatives if not any(t.hypothesis.overlaps(each) for each in dropped)]
            best, required = self._best_candidate([contender, *allowed], without.robot), self._required_evidence(others)
            may_replace = best is not None and best is not contender and swaps < policy.max_swaps
            is_replaced = best is not None and may_replace and self._replace_by(best, tested, others)
            if known_scores is None:
                self.candidates += [t.candidate(number, is_replaced and t is best, required) for t in alternatives]
            if best is not None and is_replaced:
                pending = [a for a in self.accepted if a is not self.accepted[-1]]
                tested, swaps = self.accepted[-1], swaps + 1
                score = contender = best
            self.evidences[tested] = score.evidence
            names = {t.hypothesis.effect.name for t in compared if contender.is_confusable_with(t, policy)}
            self.confusable[tested] = sorted(names - {tested.effect.name})
        self.survivors = list(self.accepted)

    def _known_scores(self, others: Sequence[Hypothesis], rival: Hypothesis) -> list[CandidateScore] | None:
        """Scores of what may stand beside others in place of a rival, where there was such a round."""
        return self.complete_rounds.get((tuple(others), None), self.complete_rounds.get((tuple(others), rival)))

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
            self.split,
            self.has_tried_each,
        )

    def _accept_beside(self, others: Sequence[Hypothesis], best: CandidateScore) -> None:
        """Take the best hypothesis and others in place of those accepted so far."""
        hypotheses = with_hypothesis(others, best.hypothesis)
        # One that loses cables to another keeps its evidence.
        last = {h: e for h in hypotheses for old, e in self.forward_evidences.items() if h.overlaps(old)}
        self.forward_evidences |= {**last, best.hypothesis: best.evidence}
        self.evidences.pop(best.hypothesis, None)
        self._accept(hypotheses, best.fit)

    def _accept(self, hypotheses: list[Hypothesis], fit: Fit) -> None:
        """Take hypotheses with their fit in place of those accepted so far, then fit the disturbance beside them.

        They stand as they are where time ends meanwhile.
        """
        self.accepted, self.current = hypotheses, fit
        self.context, self.current = with_disturbance_beside(self.context, hypotheses, fit)

    def _replace_by(self, best: CandidateScore, tested: Hypothesis, others: Sequence[Hypothesis]) -> bool:
        """Replace a tested hypothesis by the best one, unless that explains less; tells whether it is replaced.

        Its score may be of a round whose disturbance had to make up for both; here each has its own. One with fewer
        parameters may explain less by what the tested one's form may leave.
        """
        before = self.context, self.accepted, self.current, dict(self.evidences), dict(self.forward_evidences)
        has_disturbance = self.context.fitter.has_disturbance
        log_likelihood = self._validation_log_likelihood() if has_disturbance else -np.inf
        max_loss = self.context.policy.selection.tie(best.evidence, best.parameter_count < len(tested.form))
        is_replaced = False
        try:
            self._accept_beside(others, best)
            is_replaced = not has_disturbance or log_likelihood - self._validation_log_likelihood() <= max_loss
        finally:
            # Where time ends too: what was not compared does not replace what was.
            if not is_replaced:
                self.context, self.accepted, self.current, self.evidences, self.forward_evidences = before
        return is_replaced

    def _comparable(self, score: CandidateScore, others: Sequence[Hypothesis]) -> CandidateScore:
        """The score to hold against alternatives; beside a disturbance with the evidence of their round."""
        known = self.complete_rounds.get((tuple(others), None), []) if self.context.fitter.has_disturbance else []
        return next((replace(each, fit=score.fit) for each in known if each.hypothesis == score.hypothesis), score)

    def _evidence(self, without: Fit, others: Sequence[Hypothesis]) -> float:
        """Log-likelihood ratio on validation data of all accepted hypotheses against the others at their best there."""
        log_likelihood = self._validation_log_likelihood()
        return log_likelihood - maximised_validation_likelihood(
            self.context, without.robot, others, log_likelihood - self.context.evidence_threshold()
        )

    def _validation_log_likelihood(self) -> float:
        """Log-likelihood of validation data under all accepted hypotheses; whichever disturbance serves them better."""
        fitter, robot, validation = self.context.fitter, self.current.robot, self.context.split.validation
        log_likelihood = fitter.log_likelihood(robot, self.accepted, validation)
        if fitter.has_disturbance:
            log_likelihood = max(log_likelihood, marginal_log_likelihood(fitter, robot, self.accepted, validation))
        return log_likelihood
