"""Which effects earn a place: fitted on some samples, judged on others.

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

from ..robots.robot import EffectSetting, Robot
from .adequacy import is_noise
from .attempts import Attempt, Task, attempt, attempt_apart
from .data import Evidence, Sample
from .fit import EXACT, Fit, Fitter
from .hypotheses import Hypothesis, divided, enlarged, hypotheses, joined
from .scan import scanned, silent
from .screen import Prospect, screened_apart
from .trials import Trial, screened, setting_of, simplest, worth_fitting
from .verdict import Candidate
from .workers import Workers

Progress = Callable[[str, float], None]

ROUNDS = 4
# Fits to a part of FIT are told apart when they differ by more nats than this, and more than this share.
ROUGHLY_ALIKE, SHARE_ALIKE = 50.0, 1e-3
# Relative change of the cost at which fits to a part stop.
PART = 1e-4
# Roughness (m/s^2 per root hertz) under which a model far from noise is looked at, too.
ROUGH = 0.1
# The best prospects, which are always fitted to all of it.
SURE = 2
# Mean square of innovations below which a model needs no larger form of the same effects.
NEARLY_NOISE = 1.1
MOST_SWAPS = 4
# Samples by which values to begin at, and rivals that come near enough to be fitted to all, are told from the others.
OF_RIVALS = 600


@dataclass(frozen=True)
class Found:
    """What a search accepted: the hypotheses in the order found, their joint fit, evidence of each, and the rest."""

    accepted: tuple[Hypothesis, ...]
    evidence: tuple[float, ...]
    fit: Fit
    candidates: tuple[Candidate, ...]
    alike: tuple[tuple[str, ...], ...]


class Search:
    """Adds the best hypothesis while one is significant, then drops those that the others made needless.

    What the robot file declares, effects included, stays as it is until a hypothesis replaces it.
    """

    def __init__(
        self,
        robot: Robot,
        fitter: Fitter,
        evidence: Evidence,
        alpha: float,
        progress: Progress,
        workers: Workers | None = None,
    ) -> None:
        self.robot = robot
        self.fitter = fitter
        self.evidence = evidence
        self.progress = progress
        self.workers = workers or Workers(1, fitter.between)
        self.threshold = log(len(hypotheses(robot)) / alpha)
        self._known: dict[tuple[Hypothesis, ...], list[Trial]] = {}

    def run(self) -> Found:
        """The whole search."""
        accepted: list[Hypothesis] = []
        present = self._fit(accepted)
        tried: list[Candidate] = []
        for number in range(1, ROUNDS + 1):
            trials = self._try_all(number, present.robot, accepted)
            best = simplest(trials)
            significant = best is not None and best.evidence > self.threshold
            tried += [trial.candidate(number, significant and trial is best) for trial in trials]
            if best is None or not significant:
                break
            accepted = joined(accepted, best.hypothesis)
            present = best.fit
        return self._attributed(accepted, present, tried)

    def _fit(self, chosen: Sequence[Hypothesis], begin: Robot | None = None, roughly: bool = False) -> Fit:
        """The chosen hypotheses alone, from the values of a robot that has them; roughly by a part of the samples."""
        robot = self.robot
        for hypothesis in chosen:
            robot = robot.with_effect(setting_of(begin, hypothesis) if begin else hypothesis.setting(robot))
        sample = self.evidence.fit.head if roughly else self.evidence.fit
        return self.fitter.fit_from([robot], chosen, sample, -inf, PART if roughly else EXACT)

    def _best_on_judge(self, robot: Robot, chosen: Sequence[Hypothesis], clear: float) -> float:
        """Log-likelihood of the judging samples under a model at its best there, as an e-value's rival must be.

        Roughly so where it stays clearly below ``clear``: by more than the fit's stop can be wrong.
        """
        judge = self.evidence.judge
        if not chosen:
            return self._log_likelihood(robot, chosen, judge)
        for stop in (PART, EXACT):
            robot = self.fitter.fit_from([robot], chosen, judge, -inf, stop).robot
            found = self._log_likelihood(robot, chosen, judge)
            if clear - found > ROUGHLY_ALIKE + SHARE_ALIKE * abs(found):
                break
        return found

    def _log_likelihood(self, robot: Robot, chosen: Sequence[Hypothesis], sample: Sample) -> float:
        return self.fitter.judged(robot, chosen, sample).log_likelihood(sample.rows)

    def _rivals(self, number: int, robot: Robot, accepted: list[Hypothesis], whole: Trial) -> list[Trial]:
        """What could stand in the place of one hypothesis beside the accepted ones."""
        known = self._known.get(tuple(accepted))
        if known is not None:
            return [trial for trial in known if not trial.hypothesis.overlaps(whole.hypothesis)]
        return self._try_all(number, robot, accepted, whole)

    def _try_all(
        self, number: int, robot: Robot, accepted: list[Hypothesis], rival: Trial | None = None
    ) -> list[Trial]:
        """Every hypothesis beside the accepted ones; those that promise something are fitted.

        With a ``rival`` only what comes near it is fitted to all samples. Without one, and beside others, the first
        that leaves noise is enough: rivals of all that is accepted are tried later.
        """
        judge, fit = self.evidence.judge, self.evidence.fit
        taken = [*accepted, rival.hypothesis] if rival else accepted
        open_ones = [h for h in hypotheses(self.robot) if not any(a.overlaps(h) for a in taken)]
        adequate = all(is_noise(self.fitter.innovations(robot, sample), sample.rows) for sample in (judge, fit))
        # What is far from noise shows in a part of the recording; what is near needs all of it.
        looked = fit if adequate else fit.head
        sample = looked if adequate or rival is None else fit.beginning(OF_RIVALS)
        self.progress(f"round {number}: screening", 0.0)
        prospects = screened_apart(robot, accepted, open_ones, self.fitter, looked, self.workers)
        prospects |= scanned(robot, accepted, self.fitter, looked, silent(prospects), self.workers)
        near = {} if adequate else screened_apart(robot, accepted, open_ones, self.fitter, looked, self.workers, ROUGH)
        worth = worth_fitting(prospects, near)
        if not adequate:
            few, promising = fit.beginning(OF_RIVALS), {h: prospects[h] for h in worth}
            prospects |= scanned(robot, accepted, self.fitter, few, promising, self.workers)
        starts = {h: self._starts(robot, h, [p[h] for p in (prospects, near) if h in p]) for h in worth}
        # Far from noise the trials need only be told from each other.
        without = self._best_on_judge(robot, accepted, -inf if adequate else inf)
        least = self._log_likelihood(robot, accepted, sample)
        hasty = bool(accepted) and rival is None and not adequate
        trials = self._fitted(number, accepted, starts, sample, least, without, hasty)
        if not adequate and rival is None and not any(trial.mean_square < NEARLY_NOISE for trial in trials):
            others = [*enlarged(accepted), *divided(accepted)]
            starts = {h: (robot.with_effect(h.setting(robot)),) for h in others}
            trials += self._fitted(number, accepted, starts, sample, least, without)
        if not adequate:
            trials = self._polished(number, accepted, trials, () if rival else worth[:SURE], without, rival)
        self.progress(f"round {number}: done", 1.0)
        tried = {trial.hypothesis for trial in trials}
        trials += [screened(robot, h, prospects[h]) for h in prospects if h not in tried]
        if not hasty or tried.issuperset(worth):
            self._known[tuple(accepted)] = trials
        return trials

    def _fitted(
        self,
        number: int,
        accepted: list[Hypothesis],
        starts: Mapping[Hypothesis, tuple[Robot, ...]],
        sample: Sample,
        least: float,
        without: float,
        hasty: bool = False,
    ) -> list[Trial]:
        stop = EXACT if sample is self.evidence.fit else PART
        tasks = {h: Task(tuple(joined(accepted, h)), starts[h], least, stop) for h in starts}
        tried = self._tried(f"round {number}", tasks, sample, without, hasty)
        return [tried[hypothesis] for hypothesis in starts if hypothesis in tried]

    def _starts(self, robot: Robot, hypothesis: Hypothesis, prospects: Sequence[Prospect]) -> tuple[Robot, ...]:
        begun = hypothesis.setting(robot)
        promised = [EffectSetting(begun.name, {**begun.values, **p.values}, begun.cables) for p in prospects]
        return tuple(robot.with_effect(setting) for setting in (*promised, begun))

    def _polished(
        self,
        number: int,
        accepted: list[Hypothesis],
        trials: list[Trial],
        sure: Sequence[Hypothesis],
        without: float,
        rival: Trial | None,
    ) -> list[Trial]:
        """The best trials fitted to all samples."""
        top = max((trial.evidence for trial in (*trials, *([rival] if rival else []))), default=0.0)
        least = top - ROUGHLY_ALIKE - SHARE_ALIKE * abs(top)
        chosen = [trial for trial in trials if trial.evidence >= least or trial.hypothesis in sure]
        tasks = {t.hypothesis: Task(tuple(joined(accepted, t.hypothesis)), (t.fit.robot,), -inf, EXACT) for t in chosen}
        better = self._tried(f"round {number}, all of it", tasks, self.evidence.fit, without)
        return [better.get(trial.hypothesis, trial) for trial in trials]

    def _tried(
        self, what: str, tasks: Mapping[Hypothesis, Task], sample: Sample, without: float, hasty: bool = False
    ) -> dict[Hypothesis, Trial]:
        """The hypotheses of some tasks, fitted; without those that the cables cannot hold.

        In haste only until one leaves noise.
        """
        order = list(tasks)
        found = {}
        with closing(self._attempts(list(tasks.values()), sample)) as attempts:
            for done, (index, made) in enumerate(attempts, start=1):
                hypothesis = order[index]
                self.progress(f"{what}: {hypothesis.label(self.robot)}", done / len(order))
                if made is not None:
                    gain = made.log_likelihood - without
                    found[hypothesis] = Trial(hypothesis, made.fit, gain, made.mean_square)
                if hasty and made is not None and made.mean_square < NEARLY_NOISE:
                    break
        return found

    def _attempts(self, tasks: list[Task], sample: Sample) -> Generator[tuple[int, Attempt | None]]:
        judge = self.evidence.judge
        if self.workers.processes == 1:
            return self.workers.each(partial(attempt, self.fitter), [(task, sample, judge) for task in tasks])
        return self.workers.each(attempt_apart, [(self.fitter.noise, task, sample, judge) for task in tasks])

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
            mine = waiting.pop(0)
            rest = [a for a in accepted if a is not mine]
            without = self._fit(rest, present.robot, roughly=True)
            whole = Trial(mine, present, self._gain(present, accepted, without, rest), float("nan"))
            if whole.evidence < self.threshold:
                accepted, present, waiting = rest, self._fit(rest, without.robot), list(rest)
                continue
            number = ROUNDS + 1 + len(gains) + swaps
            rivals = self._rivals(number, without.robot, rest, whole)
            best = simplest([whole, *rivals])
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
        whole = self._log_likelihood(fit.robot, chosen, self.evidence.judge)
        return whole - self._best_on_judge(without.robot, rest, whole - self.threshold)


def search(
    robot: Robot,
    fitter: Fitter,
    evidence: Evidence,
    alpha: float,
    progress: Progress,
    workers: Workers | None = None,
) -> Found:
    """See :class:`Search`."""
    return Search(robot, fitter, evidence, alpha, progress, workers).run()
