"""Scores of candidate effects: their fits and evidence, and which of them tie."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from tautwire_fmu.laws.effects import DAMPING, HANGING_LOAD, PAYLOAD, RELAXATION, UNLISTED

from ..robot.schema import EffectSetting, Robot
from .hypotheses import Hypothesis
from .parameter_fit import Fit
from .policy import SelectionPolicy
from .score_test import PredictedGain
from .trace_result import Candidate

LOADS = (PAYLOAD, HANGING_LOAD)


@dataclass(frozen=True)
class CandidateScore:
    """Score of a candidate: a hypothesis fitted beside the accepted ones.

    ``evidence`` is its log-likelihood on validation data over that of the model without it at its best there,
    ``mean_square`` that of the innovations there. ``explained`` is the log-likelihood of the estimation data under the
    round's disturbance, NaN without one.
    """

    hypothesis: Hypothesis
    fit: Fit
    evidence: float
    mean_square: float
    explained: float = math.nan

    @property
    def parameter_count(self) -> int:
        return len(self.hypothesis.form)

    def is_confusable_with(self, other: CandidateScore, policy: SelectionPolicy) -> bool:
        """Whether the other explains as much with no more parameters, or more with more of them."""
        gain = other.evidence - self.evidence
        return gain > (-policy.tie_nats if other.parameter_count <= self.parameter_count else policy.tie_nats)

    def candidate(self, round_number: int, accepted: bool, required_evidence: float | None = None) -> Candidate:
        return Candidate(
            round=round_number,
            name=self.hypothesis.effect.name,
            cables=self.hypothesis.cables,
            values=setting_of(self.fit.robot, self.hypothesis).values,
            evidence=self.evidence,
            mean_square=self.mean_square,
            accepted=accepted,
            form=self.hypothesis.form,
            required_evidence=required_evidence,
        )


def setting_of(robot: Robot, hypothesis: Hypothesis) -> EffectSetting:
    """The robot's effect setting that belongs to a hypothesis."""
    wanted = (hypothesis.effect.name, hypothesis.cables)
    return next(setting for setting in robot.effects if (setting.name, setting.cables) == wanted)


def most_parsimonious(
    scores: Sequence[CandidateScore], policy: SelectionPolicy, has_disturbance: bool = False
) -> CandidateScore | None:
    """Most parsimonious candidate: of those whose evidence ties with the best, the one with fewest parameters.

    Of several one that is on the list of effects comes first.
    """
    top = max((trial.evidence for trial in scores), default=0.0)
    tied = [trial for trial in scores if top - trial.evidence < policy.tie(top, has_disturbance)]
    return min(tied, key=_complexity, default=None)


def misfitted_rival(
    best: CandidateScore, scores: Collection[CandidateScore], policy: SelectionPolicy
) -> CandidateScore | None:
    """Strongest candidate of another effect whose fit may be at the wrong optimum, if it comes near the best one."""
    others = [
        score
        for score in scores
        if score.hypothesis.effect is not best.hypothesis.effect
        and any(parameter.grid_values for parameter in score.hypothesis.parameters)
    ]
    rival = max(others, key=lambda score: score.evidence, default=None)
    return rival if rival and rival.evidence >= policy.min_rival_evidence_ratio * best.evidence else None


def simpler_rival(
    best: CandidateScore, scores: Collection[CandidateScore], policy: SelectionPolicy
) -> CandidateScore | None:
    """Strongest candidate with fewer parameters than the best one, if its evidence comes near."""
    simpler = [score for score in scores if score.parameter_count < best.parameter_count]
    rival = max(simpler, key=lambda score: score.evidence, default=None)
    return rival if rival and rival.evidence >= policy.min_simpler_evidence_ratio * best.evidence else None


def _complexity(trial: CandidateScore) -> tuple[int, bool, float]:
    return trial.parameter_count, trial.hypothesis.effect in UNLISTED, -trial.evidence


def load_before_offsets(best: CandidateScore, scores: Sequence[CandidateScore], threshold: float) -> CandidateScore:
    """The best candidate, or a load on the platform in place of one offset of several load cells.

    One forgotten load is far likelier than cells that are all off alike: they have to explain more than it by the
    ``threshold`` (nats) by which an effect has to explain more than none.
    """
    if "tension_offset" not in best.hypothesis.form or len(best.hypothesis.cables) < 2:
        return best
    least = max(threshold, best.evidence - threshold)
    loads = [trial for trial in scores if trial.hypothesis.effect in LOADS and trial.evidence > least]
    return max(loads, key=lambda trial: trial.evidence, default=best)


def without_fast_relaxations(
    scores: Sequence[CandidateScore], robot: Robot, sample_interval: float, policy: SelectionPolicy
) -> list[CandidateScore]:
    """The scores without relaxations within a sample (s) for which damping stands: the robot's, or a candidate.

    To what is slower, nearly all that the samples show, a branch of modulus E and time ``tau`` is damping:

        E tau s / (1 + tau s)  ->  E tau s
    """

    def is_damping(trial: CandidateScore) -> bool:
        hypothesis, cables = trial.hypothesis, trial.hypothesis.cables
        if hypothesis.effect is not RELAXATION or trial.parameter_count > 2 or not math.isfinite(trial.mean_square):
            return False
        settings = [each for each in trial.fit.robot.effects if (each.name, each.cables) == (RELAXATION.name, cables)]
        if not settings or settings[0].values["time"] >= sample_interval:
            return False
        limits = [t.evidence for t in scores if t.hypothesis.effect is DAMPING and t.hypothesis.cables == cables]
        is_present = any((each.name, each.cables) == (DAMPING.name, cables) for each in robot.effects)
        return is_present or max(limits, default=-math.inf) > policy.min_limit_evidence_ratio * trial.evidence

    return [trial for trial in scores if not is_damping(trial)]


def unfitted_score(robot: Robot, hypothesis: Hypothesis, prediction: PredictedGain) -> CandidateScore:
    """Score of a hypothesis that is rejected by the score test; only a fit may pass the threshold."""
    values = {**hypothesis.setting(robot).values, **prediction.values}
    predicted_robot = robot.with_effect(EffectSetting(hypothesis.effect.name, values, hypothesis.cables))
    return CandidateScore(hypothesis, Fit.without_parameters(predicted_robot), 0.0, float("nan"))
