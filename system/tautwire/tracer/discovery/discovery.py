"""Looks for a formula of what no known effect explains: found on some samples, to be judged on others.

Each round linearises the filter's run with the formula so far, chooses the few terms of the library that explain most
of what would be left without it, and fits their coefficients and shapes exactly.

Source: Brunton, Proctor and Kutz (2016), Discovering governing equations from data by sparse identification of
nonlinear dynamical systems, PNAS 113(15), 3932-3937; here on innovations, since measured positions are noisy.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf, log

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from ...errors import UnreachableError
from ...robots.robot import Formula, Robot
from ..adequacy import is_noise
from ..data import Evidence, Sample
from ..fit import EXACT, Fit, Fitter, NoFitError
from ..hypotheses import Hypothesis
from .candidates import best_terms, reach, slopes_of
from .library import Term, library
from .spectrum import rhythms
from .written import closed, opened, shape_names

Array = NDArray[np.float64]
Progress = Callable[[str, float], None]

ROUNDS = 3
# What a formula may bring about that makes no model: a push that the ropes cannot hold, a slope that is not finite.
NO_MODEL = (UnreachableError, NoFitError, np.linalg.LinAlgError)
# Terms are chosen by the first so many samples, and fitted to all.
MOST_SAMPLES = 10_000
# Shares of the linear estimate from which a fit may begin.
STEPS = (1.0, 0.3)
# Standard deviations that a coefficient has to be away from nothing.
SURE = 4.0
# Standard deviations within which two shapes are one.
ALIKE = 4.0
# Of what a formula explains, the part that no known effect looks like is at least this.
OWN_SHARE = 0.05


@dataclass(frozen=True)
class Discovery:
    """A robot with ``formulas`` that it lacked, and what they leave on the samples that found them and on the others.

    ``evidence`` is the log-likelihood on those others over that of the model without it at its best there,
    ``own_evidence`` over that with those terms alone that look like effects that the project knows.
    """

    robot: Robot
    formulas: tuple[Formula, ...]
    evidence: float
    own_evidence: float
    leaves_noise: bool

    def earns_its_place(self, threshold: float) -> bool:
        """Whether it is significant, and more than known effects by another name."""
        return self.evidence > threshold and self.own_evidence > max(threshold, OWN_SHARE * self.evidence)


@dataclass(frozen=True)
class _State:
    """Terms with coefficients, the robot that has them, and how well it does on the samples that fit."""

    terms: dict[Term, float]
    fit: Fit
    worth: float


@threadpool_limits.wrap(limits=1)
def discover(
    base: Robot, accepted: Sequence[Hypothesis], fitter: Fitter, evidence: Evidence, progress: Progress
) -> Discovery | None:
    """A formula beside the accepted hypotheses; None where no term explains anything."""
    sample = evidence.fit
    best = _worth(fitter, _start(base), accepted, sample)
    for number in range(1, ROUNDS + 1):
        progress(f"looking for a formula, round {number}", (number - 1) / ROUNDS)
        present = best
        try:
            after = _round(present, accepted, fitter, sample)
        except NO_MODEL:
            break
        if after is None or after.worth <= present.worth:
            break
        best = after
        if is_noise(fitter.judged(best.fit.robot, accepted, sample), sample.rows):
            break
    progress("looking for a formula", 1.0)
    return _judged(base, best, accepted, fitter, evidence) if best.terms else None


def _start(base: Robot) -> _State:
    return _State({}, Fit(base, (), np.zeros(0), np.zeros((0, 0))), -inf)


def _worth(fitter: Fitter, state: _State, accepted: Sequence[Hypothesis], sample: Sample) -> _State:
    """With the log-likelihood less what its parameters cost."""
    innovations = fitter.judged(state.fit.robot, accepted, sample)
    count = int(np.sum(innovations.seen[sample.rows]))
    cost = 0.5 * log(max(count, 2)) * len(state.fit.free)
    return replace(state, worth=innovations.log_likelihood(sample.rows) - cost)


def _round(present: _State, accepted: Sequence[Hypothesis], fitter: Fitter, sample: Sample) -> _State | None:
    robot = present.fit.robot
    found = rhythms(sample.recording.time, fitter.judged(robot, accepted, sample), sample.rows)
    terms = library(robot, reach(robot, accepted, fitter, sample.beginning(MOST_SAMPLES)), found)
    terms = tuple(dict.fromkeys((*present.terms, *terms)))
    slopes = slopes_of(robot, accepted, terms, fitter, sample.beginning(MOST_SAMPLES))
    chosen = best_terms(slopes, present.terms, fitter.between)
    if not chosen:
        return None
    least = fitter.judged(robot, accepted, sample).log_likelihood(sample.rows)
    after = _fitted(robot, chosen, present, accepted, fitter, sample, least)
    merged = _merged(after)
    if len(shape_names(list(merged))) < len(shape_names(list(after.terms))):
        after = _fitted(after.fit.robot, merged, after, accepted, fitter, sample, -inf)
    weak = _weak(after)
    while weak and len(after.terms) > 1:
        kept = {term: c for term, c in after.terms.items() if term != weak}
        after = _fitted(after.fit.robot, kept, after, accepted, fitter, sample, -inf)
        weak = _weak(after)
    return _worth(fitter, after, accepted, sample)


def _fitted(
    robot: Robot,
    terms: dict[Term, float],
    before: _State,
    accepted: Sequence[Hypothesis],
    fitter: Fitter,
    sample: Sample,
    least: float,
) -> _State:
    """The terms' coefficients and shapes, and the accepted hypotheses' parameters, fitted exactly."""
    old = before.terms
    declared = tuple(formula for formula in robot.formulas if not formula.numbers)
    steps = [{t: old.get(t, 0.0) + s * (c - old.get(t, 0.0)) for t, c in terms.items()} for s in STEPS]
    starts = [replace(robot, formulas=(*declared, *opened(step))) for step in steps]
    fit = fitter.fit_from(starts, accepted, sample, least, EXACT)
    numbers = _numbers(fit.robot.formulas)
    names = shape_names(list(terms))
    found = {
        replace(term, shape=numbers[names[term.family, term.shape]] if term.family else 0.0): numbers[f"c{index}"]
        for index, term in enumerate(terms, start=1)
    }
    return _State(found, fit, -inf)


def _merged(state: _State) -> dict[Term, float]:
    """With shapes that the samples do not tell apart made one."""
    deviations = _deviations(state)
    kept: dict[tuple[str, float], float] = {}
    for (family, shape), name in shape_names(list(state.terms)).items():
        near = [(f, s) for f, s in kept if f == family and abs(s - shape) < ALIKE * max(deviations[name], kept[f, s])]
        kept.setdefault(near[0] if near else (family, shape), deviations[name])
        if near:
            same = {t: replace(t, shape=near[0][1]) for t in state.terms if (t.family, t.shape) == (family, shape)}
            state = replace(state, terms={same.get(t, t): c for t, c in state.terms.items()})
    return state.terms


def _numbers(formulas: Sequence[Formula]) -> dict[str, float]:
    return {name: float(value) for formula in formulas for name, value in formula.numbers.items()}


def _deviations(state: _State) -> dict[str, float]:
    return {free.name: float(d) for free, d in zip(state.fit.free, state.fit.deviations, strict=True)}


def _weak(state: _State) -> Term | None:
    """The term whose coefficient is least sure, if it is not sure."""
    deviations = _deviations(state)
    sure = {term: abs(c) / max(deviations[f"c{i}"], 1e-300) for i, (term, c) in enumerate(state.terms.items(), start=1)}
    least = min(sure, key=lambda term: sure[term])
    return least if sure[least] < SURE else None


def _judged(
    base: Robot, best: _State, accepted: Sequence[Hypothesis], fitter: Fitter, evidence: Evidence
) -> Discovery | None:
    """With rounded numbers, on the samples that did not find it."""
    formulas = closed(best.terms, _deviations(best))
    robot = replace(best.fit.robot, formulas=(*base.formulas, *formulas))
    fit, judge = evidence.fit, evidence.judge
    try:
        shown = fitter.judged(robot, accepted, judge)
        noise = is_noise(shown, judge.rows) and is_noise(fitter.judged(robot, accepted, fit), fit.rows)
        rival = fitter.fit_from([base], accepted, judge, -inf).robot if accepted else base
        without = fitter.judged(rival, accepted, judge).log_likelihood(judge.rows)
        familiar = _familiar(base, best, accepted, fitter, judge, without)
    except NO_MODEL:
        return None
    reached = shown.log_likelihood(judge.rows)
    return Discovery(robot, formulas, reached - without, reached - familiar, noise)


def _familiar(
    base: Robot, best: _State, accepted: Sequence[Hypothesis], fitter: Fitter, judge: Sample, without: float
) -> float:
    """Log-likelihood of the judging samples under the terms alone that look like known effects, at their best there."""
    kept = {term: c for term, c in best.terms.items() if term.listed}
    if len(kept) == len(best.terms):
        return inf
    if not kept:
        return without
    found = _fitted(best.fit.robot, kept, best, accepted, fitter, judge, -inf)
    reached = fitter.judged(found.fit.robot, accepted, judge).log_likelihood(judge.rows)
    return max(without, reached)
