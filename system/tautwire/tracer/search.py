"""Which effects earn a place: fitted on some samples, judged on others.

The likelihood ratio on samples that did not fit a hypothesis, against the present model at its best on those same
samples, is an e-value: where nothing is to be found its mean is at most one, so it exceeds ``n / alpha`` for any of n
hypotheses with probability at most alpha.

Source: Wasserman, Ramdas and Balakrishnan (2020), Universal inference, PNAS 117(29), 16880-16890.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from ..errors import UnreachableError
from ..robot import EffectSetting, Robot
from .adequacy import is_noise
from .data import Evidence
from .fit import Fit, Fitter
from .hypotheses import Hypothesis, hypotheses, joined
from .screen import Prospect, screen
from .verdict import Candidate

Progress = Callable[[str, float], None]

ROUNDS = 4
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


@dataclass(frozen=True)
class _Trial:
    hypothesis: Hypothesis
    fit: Fit
    evidence: float
    mean_square: float

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


class Search:
    """Adds the best hypothesis while one is significant, then drops those that the others made needless.

    What the robot file declares, effects included, stays as it is until a hypothesis replaces it.
    """

    def __init__(self, robot: Robot, fitter: Fitter, evidence: Evidence, alpha: float, progress: Progress) -> None:
        self.robot = robot
        self.fitter = fitter
        self.evidence = evidence
        self.progress = progress
        self.threshold = log(len(hypotheses(robot)) / alpha)

    def run(self) -> Found:
        """The whole search."""
        accepted: list[Hypothesis] = []
        present = self._fit(accepted)
        tried: list[Candidate] = []
        alike: list[tuple[str, ...]] = []
        for number in range(1, ROUNDS + 1):
            trials = self._try_all(number, present.robot, accepted)
            best = max(trials, key=lambda trial: trial.evidence, default=None)
            significant = best is not None and best.evidence > self.threshold
            tried += [trial.candidate(number, significant and trial is best) for trial in trials]
            if best is None or not significant:
                break
            rivals = {t.hypothesis.effect.name for t in trials if best.evidence - t.evidence < ALIKE}
            alike += [(best.hypothesis.effect.name, r) for r in sorted(rivals - {best.hypothesis.effect.name})]
            accepted = joined(accepted, best.hypothesis)
            present = best.fit
        return self._without_needless(accepted, present, tuple(tried), tuple(alike))

    def _fit(self, chosen: Sequence[Hypothesis]) -> Fit:
        robot = self.robot
        for hypothesis in chosen:
            robot = robot.with_effect(hypothesis.setting(self.robot))
        return self.fitter.fit(robot, chosen, self.evidence.fit)

    def _best_on_judge(self, robot: Robot, chosen: Sequence[Hypothesis]) -> float:
        """Log-likelihood of the judging samples under a model at its best there, as an e-value's rival must be."""
        judge = self.evidence.judge
        best = self.fitter.fit(robot, chosen, judge) if chosen else None
        found = self.fitter.innovations(robot if best is None else best.robot, judge)
        return found.log_likelihood(judge.rows)

    def _try_all(self, number: int, robot: Robot, accepted: list[Hypothesis]) -> list[_Trial]:
        judge, fit = self.evidence.judge, self.evidence.fit
        open_ones = [h for h in hypotheses(self.robot) if not any(a.overlaps(h) for a in accepted)]
        prospects: dict[Hypothesis, Prospect] = {}
        adequate = all(is_noise(self.fitter.innovations(robot, sample), sample.rows) for sample in (judge, fit))
        if adequate and open_ones:
            self.progress(f"round {number}: screening", 0.0)
            prospects = screen(robot, accepted, open_ones, self.fitter, self.evidence)
        if not adequate:
            open_ones += _divided(accepted)
        without = self._best_on_judge(robot, accepted)
        trials = []
        for index, hypothesis in enumerate(open_ones):
            self.progress(f"round {number}: {hypothesis.label(self.robot)}", index / len(open_ones))
            prospect = prospects.get(hypothesis)
            if prospect is not None and prospect.fit_gain < HOPELESS:
                trials.append(_screened(robot, hypothesis, prospect))
            else:
                trials += self._tried(robot, joined(accepted, hypothesis), without)
        self.progress(f"round {number}: done", 1.0)
        return trials

    def _tried(self, robot: Robot, chosen: list[Hypothesis], without: float) -> list[_Trial]:
        """The last of the chosen hypotheses fitted with the others; nothing where the cables cannot hold that."""
        judge = self.evidence.judge
        try:
            fit = self.fitter.fit(robot.with_effect(chosen[-1].setting(robot)), chosen, self.evidence.fit)
            innovations = self.fitter.innovations(fit.robot, judge)
        except UnreachableError:
            return []
        gain = innovations.log_likelihood(judge.rows) - without
        square = float(np.nanmean(innovations.mean_square(judge.rows)))
        return [_Trial(chosen[-1], fit, gain, square)] if np.isfinite(gain) else []

    def _without_needless(
        self,
        accepted: list[Hypothesis],
        present: Fit,
        tried: tuple[Candidate, ...],
        alike: tuple[tuple[str, ...], ...],
    ) -> Found:
        judge = self.evidence.judge
        gains: list[float] = []
        while accepted:
            whole = self.fitter.innovations(present.robot, judge).log_likelihood(judge.rows)
            rests = [[a for a in accepted if a is not left_out] for left_out in accepted]
            fits = [self._fit(rest) for rest in rests]
            pairs = zip(fits, rests, strict=True)
            gains = [whole - self._best_on_judge(fit.robot, rest) for fit, rest in pairs]
            weakest = int(np.argmin(gains))
            if gains[weakest] > self.threshold:
                break
            accepted, present, gains = rests[weakest], fits[weakest], []
        return Found(tuple(accepted), tuple(gains), present, tried, alike)


def _divided(accepted: Sequence[Hypothesis]) -> list[Hypothesis]:
    """One cable less: each cable that shares its value with others gets one of its own."""
    return [Hypothesis(a.effect, (cable,)) for a in accepted if len(a.cables) > 1 for cable in a.cables]


def search(robot: Robot, fitter: Fitter, evidence: Evidence, alpha: float, progress: Progress) -> Found:
    """See :class:`Search`."""
    return Search(robot, fitter, evidence, alpha, progress).run()


def _screened(robot: Robot, hypothesis: Hypothesis, prospect: Prospect) -> _Trial:
    names = (parameter.name for parameter in hypothesis.effect.parameters)
    values = dict(zip(names, prospect.values, strict=True))
    promised = robot.with_effect(EffectSetting(hypothesis.effect.name, values, hypothesis.cables))
    empty = np.zeros(0)
    # Chance may promise more on the judging samples than the threshold; only a fit may pass it.
    return _Trial(hypothesis, Fit(promised, (), empty, empty), min(prospect.judge_gain, 0.0), prospect.mean_square)
