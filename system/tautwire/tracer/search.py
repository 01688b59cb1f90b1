"""Which effects earn a place: fitted on some samples, judged on others.

The likelihood ratio of a fitted hypothesis on samples that did not fit it is an e-value: where nothing is to be
found its mean is at most one, so it exceeds ``n / alpha`` for any of n hypotheses with probability at most alpha.

Source: Wasserman, Ramdas and Balakrishnan (2020), Universal inference, PNAS 117(29), 16880-16890.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import log

import numpy as np

from ..errors import UnreachableError
from ..robot import EffectSetting, Robot
from .adequacy import is_noise
from .data import Evidence
from .fit import Fit, Fitter
from .hypotheses import Hypothesis, hypotheses
from .screen import Prospect, screen
from .verdict import Candidate

Progress = Callable[[str, float], None]

ROUNDS = 3
ALIKE = 5.0
# A gain on FIT below this many nats is what chance gives one hypothesis in a hundred.
HOPELESS = 3.3


@dataclass(frozen=True)
class Found:
    """What a search accepted: the hypotheses in the order found, their joint fit, evidence of each, and the rest."""

    accepted: tuple[Hypothesis, ...]
    evidence: tuple[float, ...]
    fit: Fit
    candidates: tuple[Candidate, ...]
    alike: tuple[tuple[str, ...], ...]


def search(robot: Robot, fitter: Fitter, evidence: Evidence, alpha: float, progress: Progress) -> Found:
    """Add the best hypothesis while one is significant, then drop those that the others made needless."""
    threshold = log(len(hypotheses(robot)) / alpha)
    accepted: list[Hypothesis] = []
    present = fitter.fit(robot, evidence.fit)
    tried: list[Candidate] = []
    alike: list[tuple[str, ...]] = []
    for number in range(1, ROUNDS + 1):
        fits = _try_all(number, present.robot, accepted, fitter, evidence, progress)
        if not fits:
            break
        best = max(fits, key=lambda trial: trial.evidence)
        significant = best.evidence > threshold
        tried += [trial.candidate(number, significant and trial is best) for trial in fits]
        if not significant:
            break
        rivals = {t.hypothesis.effect.name for t in fits if best.evidence - t.evidence < ALIKE and t is not best}
        rivals -= {best.hypothesis.effect.name}
        alike += [(best.hypothesis.effect.name, rival) for rival in sorted(rivals)]
        accepted.append(best.hypothesis)
        present = best.fit
    return _without_needless(robot, accepted, present, tried, alike, fitter, evidence, threshold)


@dataclass(frozen=True)
class _Trial:
    hypothesis: Hypothesis
    fit: Fit
    evidence: float
    mean_square: float

    def candidate(self, number: int, accepted: bool) -> Candidate:
        setting = next(
            s
            for s in self.fit.robot.effects
            if s.name == self.hypothesis.effect.name and s.cables == self.hypothesis.cables
        )
        return Candidate(
            round=number,
            name=setting.name,
            cables=setting.cables,
            values=setting.values,
            evidence=self.evidence,
            mean_square=self.mean_square,
            accepted=accepted,
        )


def _try_all(
    number: int, robot: Robot, accepted: list[Hypothesis], fitter: Fitter, evidence: Evidence, progress: Progress
) -> list[_Trial]:
    judge = evidence.judge
    plain = fitter.innovations(robot, judge)
    without = plain.log_likelihood(judge.rows)
    open_ones = [h for h in hypotheses(robot) if not any(h.effect is a.effect for a in accepted)]
    prospects: dict[Hypothesis, Prospect] = {}
    if is_noise(plain, judge.rows) and is_noise(fitter.innovations(robot, evidence.fit), evidence.fit.rows):
        progress(f"round {number}: screening", 0.0)
        prospects = screen(robot, open_ones, fitter, evidence)
    trials = []
    for index, hypothesis in enumerate(open_ones):
        progress(f"round {number}: {hypothesis.label(robot)}", index / len(open_ones))
        prospect = prospects.get(hypothesis)
        if prospect is not None and prospect.fit_gain < HOPELESS:
            trials.append(_screened(robot, hypothesis, prospect))
            continue
        try:
            fit = fitter.fit(robot.with_effect(hypothesis.setting(robot)), evidence.fit)
            innovations = fitter.innovations(fit.robot, judge)
        except UnreachableError:
            continue
        gain = innovations.log_likelihood(judge.rows) - without
        if np.isfinite(gain):
            square = float(np.nanmean(innovations.mean_square(judge.rows)))
            trials.append(_Trial(hypothesis, fit, gain, square))
    progress(f"round {number}: done", 1.0)
    return trials


def _screened(robot: Robot, hypothesis: Hypothesis, prospect: Prospect) -> _Trial:
    names = (parameter.name for parameter in hypothesis.effect.parameters)
    values = dict(zip(names, prospect.values, strict=True))
    promised = robot.with_effect(EffectSetting(hypothesis.effect.name, values, hypothesis.cables))
    empty = np.zeros(0)
    # Chance may promise more on the judging samples than the threshold; only a fit may pass it.
    return _Trial(hypothesis, Fit(promised, empty, empty), min(prospect.judge_gain, 0.0), prospect.mean_square)


def _without_needless(
    robot: Robot,
    accepted: list[Hypothesis],
    present: Fit,
    tried: list[Candidate],
    alike: list[tuple[str, ...]],
    fitter: Fitter,
    evidence: Evidence,
    threshold: float,
) -> Found:
    judge = evidence.judge
    gains: list[float] = []
    while accepted:
        whole = fitter.innovations(present.robot, judge).log_likelihood(judge.rows)
        rest = [_fit_of(robot, [a for a in accepted if a is not left_out], fitter, evidence) for left_out in accepted]
        gains = [whole - fitter.innovations(f.robot, judge).log_likelihood(judge.rows) for f in rest]
        weakest = int(np.argmin(gains))
        if gains[weakest] > threshold:
            break
        accepted = [a for index, a in enumerate(accepted) if index != weakest]
        present = rest[weakest]
        gains = []
    return Found(tuple(accepted), tuple(gains), present, tuple(tried), tuple(alike))


def _fit_of(robot: Robot, chosen: list[Hypothesis], fitter: Fitter, evidence: Evidence) -> Fit:
    trial = replace(robot)
    for hypothesis in chosen:
        trial = trial.with_effect(hypothesis.setting(robot))
    return fitter.fit(trial, evidence.fit)
