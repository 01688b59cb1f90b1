"""What a recording could tell: the smallest size of each effect that it would have shown, and what looks like what.

Slopes ``J`` of the whitened innovations by all parameters, those of the accepted hypotheses projected out, give both.
An effect of one parameter moved by ``d`` is expected to gain ``d^2 |J|^2 / 2`` nats; the share of an effect that
another could mimic is the squared cosine of the angle between its signature and what the other's span.

Source: Kay (1998), Fundamentals of Statistical Signal Processing II, sec. 4.4; Ljung (1999), sec. 13.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf, log, sqrt

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.effects import BY_NAME

from ..robots.robot import Robot
from .data import Sample
from .fit import Fitter
from .hypotheses import ON_ONE_CABLE, Hypothesis, hypotheses
from .scan import felt_from
from .screen import Signatures, moved_by, signatures_of, trial_count, trials_of
from .verdict import Detectable, Likeness, Separation

Array = NDArray[np.float64]

# Normal quantile of the probability, 90 %, with which an effect of the size given is found.
POWER = 1.2816
# Nats that fitting a parameter on other samples is expected to cost.
FITTED = 1.0
LEAST_SHARE = 1e-9
# Cosines below this are not worth a line.
ALIKE = 0.9


def separation(
    robot: Robot, declared: Robot, accepted: Sequence[Hypothesis], fitter: Fitter, sample: Sample, alpha: float
) -> Separation:
    """Of all hypotheses beside the accepted ones, at the values that ``robot`` has for these; ``declared`` lacks them.

    ``alpha`` is the rate of false alarms that the effects would have to pass.
    """
    every = hypotheses(declared)
    others = [h for h in every if not any(a.overlaps(h) for a in accepted)]
    signatures = signatures_of(robot, accepted, others, fitter, sample)
    places = _places(accepted)
    threshold = log(len(every) / alpha)
    shown = [h for h in others if h.cables in ((), declared.cable_numbers) or h.effect in ON_ONE_CABLE]
    known = [column for group in places for column in group]
    sizes = [d for h in shown for d in _sizes(signatures, h, known, threshold)]
    sizes = [_by_runs(robot, accepted, fitter, sample, size, threshold) for size in sizes]
    alike = [
        likeness
        for index, own in enumerate(accepted)
        for other in others
        if (likeness := _likeness(signatures, robot, declared, (own, places[index]), other, places)) is not None
    ]
    return Separation(tuple(sizes), tuple(sorted(alike, key=lambda found: found.nats)))


def apart(signatures: Signatures, move: Array, other: Hypothesis, rest: Sequence[int] = ()) -> float:
    """Nats between a move of the parameters (columns, 1) and the best that another hypothesis can do in its place."""
    whole = float(_beside(signatures.gram, move, list(rest))[0, 0])
    return 0.5 * whole * (1.0 - _mimicked(signatures, move, other, rest, whole)) if whole > 0.0 else 0.0


def start_moves(signatures: Signatures, robot: Robot, hypothesis: Hypothesis) -> Array:
    """The move (columns, 1) from where an effect is absent to where fits of it begin, at its first trial."""
    names, columns = moved_by(signatures, hypothesis, 0)
    absent = hypothesis.neutral(robot, hypothesis.cables).values
    begun = hypothesis.setting(robot).values
    steps = np.array([float(begun[name]) - float(absent[name]) for name in names])
    moves: Array = (columns @ steps)[:, None]
    return moves


def _mimicked(signatures: Signatures, move: Array, other: Hypothesis, rest: Sequence[int], whole: float) -> float:
    """Share of a move's squared length that another hypothesis can take, at the trial that takes most."""
    best = 0.0
    for number in range(trial_count(other)):
        _, columns = moved_by(signatures, other, number)
        if columns.shape[1]:
            both = _beside(signatures.gram, np.hstack([move, columns]), list(rest))
            best = max(best, float(both[0, 1:] @ _solved(both[1:, 1:], both[1:, :1])[:, 0]) / whole)
    return min(max(best, 0.0), 1.0)


def _places(accepted: Sequence[Hypothesis]) -> list[list[int]]:
    """Which columns are whose."""
    places, first = [], 0
    for hypothesis in accepted:
        places.append(list(range(first, first + len(hypothesis.form))))
        first += len(hypothesis.form)
    return places


def _sizes(signatures: Signatures, hypothesis: Hypothesis, known: list[int], threshold: float) -> list[Detectable]:
    shaping = trials_of(hypothesis.effect)[0]
    best = {
        p.name: Detectable(hypothesis.effect.name, hypothesis.cables, p.name, inf, p.unit, {})
        for p in hypothesis.parameters
        if p.name not in shaping
    }
    for number, shapes in enumerate(trials_of(hypothesis.effect)[: trial_count(hypothesis)]):
        names, columns = moved_by(signatures, hypothesis, number)
        own = _beside(signatures.gram, columns, known)
        for index, name in enumerate(names):
            parameter = next(p for p in hypothesis.parameters if p.name == name)
            strength = sqrt(max(own[index, index], 0.0))
            begun = float(signatures.values @ columns[:, index] / np.sum(columns[:, index]))
            size = _needed(threshold) / strength if strength > 0.0 else inf
            if size > max(parameter.maximum - begun, begun - parameter.minimum):
                size = inf
            beside = {key: value for key, value in shapes.items() if key in hypothesis.form}
            found = Detectable(hypothesis.effect.name, hypothesis.cables, name, size, parameter.unit, beside)
            if size < best[name].size:
                best[name] = found
    return list(best.values())


def _needed(threshold: float) -> float:
    """By how much an effect has to move the whitened innovations, as root of the sum of squares."""
    return POWER + sqrt(POWER**2 + 2.0 * (threshold + FITTED))


def _by_runs(
    robot: Robot, accepted: Sequence[Hypothesis], fitter: Fitter, sample: Sample, found: Detectable, threshold: float
) -> Detectable:
    """The size by runs of the model where slopes see none at all."""
    effect = BY_NAME[found.name]
    parameter = next(p for p in effect.parameters if p.name == found.parameter)
    if not parameter.scanned or found.size < inf:
        return found
    hypothesis = Hypothesis(effect, found.cables)
    return replace(found, size=felt_from(robot, accepted, fitter, sample, hypothesis, parameter, _needed(threshold)))


def _beside(gram: Array, columns: Array, known: list[int]) -> Array:
    """Gram matrix of some combinations of columns, the known columns projected out."""
    own = columns.T @ gram @ columns
    if known:
        across = gram[known] @ columns
        own = own - across.T @ _solved(gram[np.ix_(known, known)], across)
    reduced: Array = own
    return reduced


def _solved(gram: Array, right: Array) -> Array:
    """Least squares, by columns of one size."""
    size = np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
    scaled: Array = np.linalg.lstsq(gram / np.outer(size, size), right / size[:, None], rcond=LEAST_SHARE)[0]
    solution: Array = scaled / size[:, None]
    return solution


def _likeness(
    signatures: Signatures,
    robot: Robot,
    declared: Robot,
    own: tuple[Hypothesis, list[int]],
    other: Hypothesis,
    places: Sequence[list[int]],
) -> Likeness | None:
    """The trial of the other that mimics most; None where even that is little."""
    hypothesis, mine = own
    rest = [column for group in places if group is not mine for column in group]
    move = np.zeros((len(signatures.columns), 1))
    move[mine, 0] = _moves(robot, declared, hypothesis)
    whole = float(_beside(signatures.gram, move, rest)[0, 0])
    if whole <= 0.0:
        return None
    cosine = sqrt(_mimicked(signatures, move, other, rest, whole))
    if cosine < ALIKE:
        return None
    nats = 0.5 * whole * (1.0 - cosine**2)
    return Likeness(hypothesis.effect.name, hypothesis.cables, other.effect.name, other.cables, cosine, nats)


def _moves(robot: Robot, declared: Robot, hypothesis: Hypothesis) -> list[float]:
    """From where the effect is absent to where it is; nothing for parameters that only shape it."""
    setting = next(s for s in robot.effects if (s.name, s.cables) == (hypothesis.effect.name, hypothesis.cables))
    neutral = hypothesis.neutral(declared, hypothesis.cables)
    shaping = trials_of(hypothesis.effect)[0]
    return [
        0.0 if p.name in shaping else float(setting.values[p.name]) - float(neutral.values[p.name])
        for p in hypothesis.parameters
    ]
