"""Which effects earn a place: fitted on some samples, judged on others.

The likelihood ratio on samples that did not fit a hypothesis, against the present model at its best on those same
samples, is an e-value: where nothing is to be found its mean is at most one, so it exceeds ``n / alpha`` for any of n
hypotheses with probability at most alpha.

Source: Wasserman, Ramdas and Balakrishnan (2020), Universal inference, PNAS 117(29), 16880-16890.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from ..errors import UnreachableError
from ..robot import EffectSetting, Robot
from .adequacy import is_noise
from .data import Evidence, Sample
from .fit import Fit, Fitter, NoFitError
from .hypotheses import Hypothesis, divided, enlarged, hypotheses, joined
from .screen import Prospect, screen
from .verdict import Candidate

Progress = Callable[[str, float], None]

ROUNDS = 4
ALIKE = 5.0
# A gain on FIT below this many nats is what chance gives some of the hypotheses.
HOPELESS = 4.0
# Only so many of the best prospects are fitted, and those that promise this share of the best.
MOST_FITTED = 8
MOST_OF_AN_EFFECT = 3
PROMISING = 0.02
# Fits to a part of FIT are told apart when they differ by more nats than this, and more than this share.
ROUGHLY_ALIKE, SHARE_ALIKE = 50.0, 1e-3
# The best prospects, which are always fitted to all of it.
SURE = 2
# Mean square of innovations below which a model needs no larger form of the same effects.
NEARLY_NOISE = 1.1
MOST_SWAPS = 4


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

    @property
    def parameter_count(self) -> int:
        return len(self.hypothesis.form)

    def rivalled_by(self, other: _Trial) -> bool:
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
        self._known: dict[tuple[Hypothesis, ...], list[_Trial]] = {}

    def run(self) -> Found:
        """The whole search."""
        accepted: list[Hypothesis] = []
        present = self._fit(accepted)
        tried: list[Candidate] = []
        for number in range(1, ROUNDS + 1):
            trials = self._try_all(number, present.robot, accepted)
            best = _simplest(trials)
            significant = best is not None and best.evidence > self.threshold
            tried += [trial.candidate(number, significant and trial is best) for trial in trials]
            if best is None or not significant:
                break
            accepted = joined(accepted, best.hypothesis)
            present = best.fit
        return self._attributed(accepted, present, tried)

    def _fit(self, chosen: Sequence[Hypothesis]) -> Fit:
        robot = self.robot
        for hypothesis in chosen:
            robot = robot.with_effect(hypothesis.setting(self.robot))
        return self.fitter.fit(robot, chosen, self.evidence.fit)

    def _best_on_judge(self, robot: Robot, chosen: Sequence[Hypothesis]) -> float:
        """Log-likelihood of the judging samples under a model at its best there, as an e-value's rival must be."""
        judge = self.evidence.judge
        best = self.fitter.fit_from([robot], robot, chosen, judge) if chosen else None
        found = self.fitter.judged(robot if best is None else best.robot, chosen, judge)
        return found.log_likelihood(judge.rows)

    def _try_all(
        self, number: int, robot: Robot, accepted: list[Hypothesis], but: Hypothesis | None = None
    ) -> list[_Trial]:
        """Every hypothesis but one beside the accepted ones; those that promise something are fitted."""
        known = self._known.get(tuple(accepted))
        if but is not None and known is not None:
            return [trial for trial in known if not trial.hypothesis.overlaps(but)]
        judge, fit = self.evidence.judge, self.evidence.fit
        taken = [*accepted, but] if but else accepted
        open_ones = [h for h in hypotheses(self.robot) if not any(a.overlaps(h) for a in taken)]
        adequate = all(is_noise(self.fitter.innovations(robot, sample), sample.rows) for sample in (judge, fit))
        # What is far from noise shows in a part of the recording; what is near needs all of it.
        sample = fit if adequate else fit.head
        self.progress(f"round {number}: screening", 0.0)
        prospects = screen(robot, accepted, open_ones, self.fitter, sample)
        worth = _worth_fitting(prospects)
        starts = {h: self._starts(robot, h, prospects[h]) for h in worth}
        without = self._best_on_judge(robot, accepted)
        trials = self._fitted(number, robot, accepted, starts, sample, without)
        if not adequate and but is None and not any(trial.mean_square < NEARLY_NOISE for trial in trials):
            others = [*enlarged(accepted), *divided(accepted)]
            starts = {h: [robot.with_effect(h.setting(robot))] for h in others}
            trials += self._fitted(number, robot, accepted, starts, sample, without)
        if not adequate:
            trials = self._polished(number, robot, accepted, trials, worth[:SURE], without)
        self.progress(f"round {number}: done", 1.0)
        trials += [_screened(robot, h, prospects[h]) for h in prospects if h not in worth]
        self._known[tuple(accepted)] = trials
        return trials

    def _fitted(
        self,
        number: int,
        robot: Robot,
        accepted: list[Hypothesis],
        starts: Mapping[Hypothesis, Sequence[Robot]],
        sample: Sample,
        without: float,
    ) -> list[_Trial]:
        trials = []
        for index, hypothesis in enumerate(starts):
            self.progress(f"round {number}: {hypothesis.label(self.robot)}", index / len(starts))
            trials += self._tried(robot, joined(accepted, hypothesis), starts[hypothesis], sample, without)
        return trials

    def _starts(self, robot: Robot, hypothesis: Hypothesis, prospect: Prospect) -> list[Robot]:
        setting = hypothesis.setting(robot)
        promised = EffectSetting(setting.name, {**setting.values, **prospect.values}, setting.cables)
        return [robot.with_effect(promised), robot.with_effect(setting)]

    def _polished(
        self,
        number: int,
        robot: Robot,
        accepted: list[Hypothesis],
        trials: list[_Trial],
        sure: Sequence[Hypothesis],
        without: float,
    ) -> list[_Trial]:
        """The best trials fitted to all samples."""
        top = max((trial.evidence for trial in trials), default=0.0)
        least = top - ROUGHLY_ALIKE - SHARE_ALIKE * abs(top)
        done = []
        for index, trial in enumerate(trials):
            if trial.evidence < least and trial.hypothesis not in sure:
                done.append(trial)
                continue
            self.progress(f"round {number}: {trial.hypothesis.label(self.robot)}, all of it", index / len(trials))
            chosen = joined(accepted, trial.hypothesis)
            done += self._tried(robot, chosen, [trial.fit.robot], self.evidence.fit, without) or [trial]
        return done

    def _tried(
        self, robot: Robot, chosen: list[Hypothesis], starts: Sequence[Robot], sample: Sample, without: float
    ) -> list[_Trial]:
        """The last of the chosen hypotheses fitted with the others; nothing where the cables cannot hold that."""
        judge = self.evidence.judge
        try:
            fit = self.fitter.fit_from(starts, robot, chosen, sample)
            innovations = self.fitter.judged(fit.robot, chosen, judge)
        except (UnreachableError, NoFitError):
            return []
        gain = innovations.log_likelihood(judge.rows) - without
        square = float(np.nanmean(innovations.mean_square(judge.rows)))
        return [_Trial(chosen[-1], fit, gain, square)] if np.isfinite(gain) else []

    def _attributed(self, accepted: list[Hypothesis], present: Fit, tried: list[Candidate]) -> Found:
        """Each accepted hypothesis against its best rivals beside the others, and against nothing in its place.

        It goes where it is not needed, and makes room for a rival that explains more, or as much with fewer parameters.
        """
        alike: dict[Hypothesis, list[str]] = {}
        gains: dict[Hypothesis, float] = {}
        waiting = list(accepted)
        swaps = 0
        seen = set(self._known)
        while waiting:
            mine = waiting.pop()
            rest = [a for a in accepted if a is not mine]
            without = self._fit(rest)
            whole = _Trial(mine, present, self._gain(present, accepted, without, rest), float("nan"))
            if whole.evidence < self.threshold:
                accepted, present, waiting = rest, without, list(rest)
                continue
            number = ROUNDS + 1 + len(gains) + swaps
            rivals = self._try_all(number, without.robot, rest, mine)
            best = _simplest([whole, *rivals])
            tried += [t.candidate(number, t is best) for t in rivals if tuple(rest) not in seen]
            seen.add(tuple(rest))
            if best is not None and best is not whole and swaps < MOST_SWAPS:
                accepted, present = joined(rest, best.hypothesis), best.fit
                waiting = [a for a in accepted if a is not accepted[-1]]
                mine, whole, swaps = accepted[-1], best, swaps + 1
            gains[mine] = whole.evidence
            names = {t.hypothesis.effect.name for t in rivals if whole.rivalled_by(t)}
            alike[mine] = sorted(names - {mine.effect.name})
        return Found(
            tuple(accepted),
            tuple(gains[a] for a in accepted),
            present,
            tuple(tried),
            tuple((a.effect.name, other) for a in accepted for other in alike[a]),
        )

    def _gain(self, fit: Fit, chosen: Sequence[Hypothesis], without: Fit, rest: Sequence[Hypothesis]) -> float:
        """What the whole explains of the judging samples more than the rest at its best there."""
        judge = self.evidence.judge
        whole = self.fitter.judged(fit.robot, chosen, judge).log_likelihood(judge.rows)
        return whole - self._best_on_judge(without.robot, rest)


def _worth_fitting(prospects: Mapping[Hypothesis, Prospect]) -> list[Hypothesis]:
    """The best prospects, best first, few of each effect."""
    ranked: list[Hypothesis] = []
    for hypothesis in sorted(prospects, key=lambda hypothesis: -prospects[hypothesis].gain):
        if sum(hypothesis.effect is other.effect for other in ranked) < MOST_OF_AN_EFFECT:
            ranked.append(hypothesis)
    least = max(HOPELESS, PROMISING * prospects[ranked[0]].gain) if ranked else HOPELESS
    return [hypothesis for hypothesis in ranked[:MOST_FITTED] if prospects[hypothesis].gain >= least]


def _simplest(trials: Sequence[_Trial]) -> _Trial | None:
    """Of the trials that the evidence does not tell from the best, the one with fewest parameters, then the best."""
    top = max((trial.evidence for trial in trials), default=0.0)
    near = [trial for trial in trials if top - trial.evidence < ALIKE]
    return min(near, key=lambda trial: (trial.parameter_count, -trial.evidence), default=None)


def search(robot: Robot, fitter: Fitter, evidence: Evidence, alpha: float, progress: Progress) -> Found:
    """See :class:`Search`."""
    return Search(robot, fitter, evidence, alpha, progress).run()


def _screened(robot: Robot, hypothesis: Hypothesis, prospect: Prospect) -> _Trial:
    """A hypothesis that is not worth a fit; only a fit may pass the threshold."""
    values = {**hypothesis.setting(robot).values, **prospect.values}
    promised = robot.with_effect(EffectSetting(hypothesis.effect.name, values, hypothesis.cables))
    empty = np.zeros(0)
    return _Trial(hypothesis, Fit(promised, (), empty, empty), 0.0, float("nan"))
