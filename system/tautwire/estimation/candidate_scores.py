"""Scores of candidate effects: their fits and evidence, and which of them are worth more work."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..robot.schema import EffectSetting, Robot
from .hypotheses import Hypothesis
from .parameter_fit import Fit
from .score_test import PredictedGain
from .trace_result import Candidate

TIE_NATS = 5.0
# A gain on estimation data below this many nats is what chance gives some of the hypotheses.
MIN_PREDICTED_GAIN = 4.0
# How many of the best predictions are fitted, and how many of the rough ones; at least this share of the best gain.
MAX_FITS, MAX_ROUGH_FITS = 8, 3
MAX_FITS_PER_EFFECT = 3
MIN_GAIN_SHARE = 0.02


@dataclass(frozen=True)
class CandidateScore:
    """Score of a candidate: a hypothesis fitted beside the accepted ones.

    ``evidence`` is its log-likelihood on validation data over that of the model without it at its best there,
    ``mean_square`` that of the innovations there.
    """

    hypothesis: Hypothesis
    fit: Fit
    evidence: float
    mean_square: float

    @property
    def parameter_count(self) -> int:
        return len(self.hypothesis.form)

    def is_confusable_with(self, other: CandidateScore) -> bool:
        """Whether the other explains as much with no more parameters."""
        close = self.evidence - other.evidence < TIE_NATS
        return close and other.parameter_count <= self.parameter_count

    def candidate(self, round_number: int, accepted: bool) -> Candidate:
        return Candidate(
            round=round_number,
            name=self.hypothesis.effect.name,
            cables=self.hypothesis.cables,
            values=setting_of(self.fit.robot, self.hypothesis).values,
            evidence=self.evidence,
            mean_square=self.mean_square,
            accepted=accepted,
        )


def setting_of(robot: Robot, hypothesis: Hypothesis) -> EffectSetting:
    """The robot's effect setting that belongs to a hypothesis."""
    wanted = (hypothesis.effect.name, hypothesis.cables)
    return next(setting for setting in robot.effects if (setting.name, setting.cables) == wanted)


def shortlist(
    predictions: Mapping[Hypothesis, PredictedGain], rough_predictions: Mapping[Hypothesis, PredictedGain] | None = None
) -> list[Hypothesis]:
    """Shortlist of the best predictions, few of each effect; the best of ``rough_predictions`` replace the last.

    Those are of another score test of the same hypotheses, with process noise.
    """
    ranked, others = _ranked(predictions), _ranked(rough_predictions or {})
    leading = ranked[: MAX_FITS - MAX_ROUGH_FITS]
    added = [hypothesis for hypothesis in others[:MAX_ROUGH_FITS] if hypothesis not in leading]
    remaining = [hypothesis for hypothesis in ranked if hypothesis not in added]
    return [*remaining[: MAX_FITS - len(added)], *added]


def _ranked(predictions: Mapping[Hypothesis, PredictedGain]) -> list[Hypothesis]:
    ranked: list[Hypothesis] = []
    for hypothesis in sorted(predictions, key=lambda hypothesis: -predictions[hypothesis].gain):
        if sum(hypothesis.effect is other.effect for other in ranked) < MAX_FITS_PER_EFFECT:
            ranked.append(hypothesis)
    min_gain = max(MIN_PREDICTED_GAIN, MIN_GAIN_SHARE * predictions[ranked[0]].gain) if ranked else MIN_PREDICTED_GAIN
    return [hypothesis for hypothesis in ranked[:MAX_FITS] if predictions[hypothesis].gain >= min_gain]


def most_parsimonious(scores: Sequence[CandidateScore]) -> CandidateScore | None:
    """Most parsimonious candidate: of those whose evidence ties with the best, the one with fewest parameters."""
    top = max((trial.evidence for trial in scores), default=0.0)
    tied = [trial for trial in scores if top - trial.evidence < TIE_NATS]
    return min(tied, key=lambda trial: (trial.parameter_count, -trial.evidence), default=None)


def unfitted_score(robot: Robot, hypothesis: Hypothesis, prediction: PredictedGain) -> CandidateScore:
    """Score of a hypothesis that is rejected by the score test; only a fit may pass the threshold."""
    values = {**hypothesis.setting(robot).values, **prediction.values}
    predicted_robot = robot.with_effect(EffectSetting(hypothesis.effect.name, values, hypothesis.cables))
    return CandidateScore(hypothesis, Fit(predicted_robot, (), np.zeros(0), np.zeros((0, 0))), 0.0, float("nan"))
