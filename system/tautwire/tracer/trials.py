"""What a search tries: hypotheses with their fits and evidence, and which of them are worth more work."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..robots.robot import EffectSetting, Robot
from .fit import Fit
from .hypotheses import Hypothesis
from .screen import Prospect
from .verdict import Candidate

ALIKE = 5.0
# A gain on FIT below this many nats is what chance gives some of the hypotheses.
HOPELESS = 4.0
# Only so many of the best prospects are fitted, and those that promise this share of the best.
MOST_FITTED, MOST_BESIDE = 8, 3
MOST_OF_AN_EFFECT = 3
PROMISING = 0.02


@dataclass(frozen=True)
class Trial:
    """A hypothesis fitted beside the accepted ones.

    ``evidence`` is its log-likelihood on the judging samples over that of the model without it at its best there,
    ``mean_square`` that of the innovations there.
    """

    hypothesis: Hypothesis
    fit: Fit
    evidence: float
    mean_square: float

    @property
    def parameter_count(self) -> int:
        return len(self.hypothesis.form)

    def rivalled_by(self, other: Trial) -> bool:
        """Whether the other explains as much with no more parameters."""
        close = self.evidence - other.evidence < ALIKE
        return close and other.parameter_count <= self.parameter_count

    def candidate(self, number: int, accepted: bool) -> Candidate:
        return Candidate(
            round=number,
            name=self.hypothesis.effect.name,
            cables=self.hypothesis.cables,
            values=setting_of(self.fit.robot, self.hypothesis).values,
            evidence=self.evidence,
            mean_square=self.mean_square,
            accepted=accepted,
        )


def setting_of(robot: Robot, hypothesis: Hypothesis) -> EffectSetting:
    """The setting of a robot that a hypothesis put there."""
    wanted = (hypothesis.effect.name, hypothesis.cables)
    return next(setting for setting in robot.effects if (setting.name, setting.cables) == wanted)


def worth_fitting(
    prospects: Mapping[Hypothesis, Prospect], beside: Mapping[Hypothesis, Prospect] | None = None
) -> list[Hypothesis]:
    """The best prospects, best first, few of each effect; then the best ``beside`` them, in place of the last.

    Those are promised by another look at the same hypotheses.
    """
    ranked, others = _ranked(prospects), _ranked(beside or {})
    sure = ranked[: MOST_FITTED - MOST_BESIDE]
    new = [hypothesis for hypothesis in others[:MOST_BESIDE] if hypothesis not in sure]
    kept = [hypothesis for hypothesis in ranked if hypothesis not in new]
    return [*kept[: MOST_FITTED - len(new)], *new]


def _ranked(prospects: Mapping[Hypothesis, Prospect]) -> list[Hypothesis]:
    ranked: list[Hypothesis] = []
    for hypothesis in sorted(prospects, key=lambda hypothesis: -prospects[hypothesis].gain):
        if sum(hypothesis.effect is other.effect for other in ranked) < MOST_OF_AN_EFFECT:
            ranked.append(hypothesis)
    least = max(HOPELESS, PROMISING * prospects[ranked[0]].gain) if ranked else HOPELESS
    return [hypothesis for hypothesis in ranked[:MOST_FITTED] if prospects[hypothesis].gain >= least]


def simplest(trials: Sequence[Trial]) -> Trial | None:
    """Of the trials that the evidence does not tell from the best, the one with fewest parameters, then the best."""
    top = max((trial.evidence for trial in trials), default=0.0)
    near = [trial for trial in trials if top - trial.evidence < ALIKE]
    return min(near, key=lambda trial: (trial.parameter_count, -trial.evidence), default=None)


def screened(robot: Robot, hypothesis: Hypothesis, prospect: Prospect) -> Trial:
    """A hypothesis that is not worth a fit; only a fit may pass the threshold."""
    values = {**hypothesis.setting(robot).values, **prospect.values}
    promised = robot.with_effect(EffectSetting(hypothesis.effect.name, values, hypothesis.cables))
    return Trial(hypothesis, Fit(promised, (), np.zeros(0), np.zeros((0, 0))), 0.0, float("nan"))
