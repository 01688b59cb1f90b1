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
from ..robot import Robot
from .data import Evidence
from .fit import Fit, Fitter
from .hypotheses import Hypothesis, hypotheses
from .verdict import Candidate

Progress = Callable[[str, float], None]

ROUNDS = 3
ALIKE = 5.0


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
    number: int,
    robot: Robot,
    accepted: list[Hypothesis],
    fitter: Fitter,
    evidence: Evidence,
    progress: Progress,
) -> list[_Trial]:
    judge = evidence.judge
    without = fitter.innovations(robot, judge).log_likelihood(judge.rows)
    trials = []
    open_ones = [h for h in hypotheses(robot) if not any(h.effect is a.effect for a in accepted)]
    for index, hypothesis in enumerate(open_ones):
        progress(f"round {number}: {hypothesis.label(robot)}", index / len(open_ones))
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
