"""What each hypothesis could gain at most, from linearisations about the present model: spares hopeless fits.

An effect too small to see moves the innovations in proportion to its parameters, ``e + J d``. One run of the filter,
linearised, gives ``J`` for all hypotheses at once; least squares on FIT gives ``d``, and what it gains there.
Parameters that count only while others are not neutral (the time of a relaxation) have no slope there: the others are
tried at several values of theirs.

Source: Rao's score test, e.g. Cox and Hinkley (1974), Theoretical Statistics, sec. 9.3.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.effects import Effect

from ..robots.robot import Robot
from ..runs.start import placed
from .attempts import fitter_apart
from .data import Sample
from .directions import Column, EffectDirections
from .filter_step import Noise
from .fit import Fitter
from .hypotheses import OF_THE_PLATFORM, Hypothesis, free_parameters
from .linearisation import linearise_run
from .workers import Workers

Array = NDArray[np.float64]

# Directions of the parameters that move the innovations by less than this share of the others are not told apart.
LEAST_SHARE = 1e-9


@dataclass(frozen=True)
class Prospect:
    """What a hypothesis promises: log-likelihood gained on FIT, and the values that would gain it."""

    gain: float
    values: Mapping[str, float]


@dataclass(frozen=True)
class Signatures:
    """How parameters move the innovations ``e`` of all samples that count, to first order.

    ``columns`` (p) name the parameters, ``values`` (p) where the slopes ``J`` were taken; ``gram`` is ``J' J`` (p, p),
    ``pull`` ``J' e`` (p).
    """

    columns: tuple[Column, ...]
    values: Array
    gram: Array
    pull: Array


def screen(
    robot: Robot,
    accepted: Sequence[Hypothesis],
    open_ones: Sequence[Hypothesis],
    fitter: Fitter,
    sample: Sample,
    roughness: float = 0.0,
) -> dict[Hypothesis, Prospect]:
    """The best prospect of each hypothesis beside the accepted ones, whose parameters move along.

    Far from noise slopes mislead: an oscillation that is out of phase after a while asks for damping whatever it lacks.
    With ``roughness`` (m/s^2 per root hertz) the run stays beside what was measured, and slopes tell the truth.
    """
    signatures = signatures_of(robot, accepted, open_ones, fitter, sample, roughness)
    found: dict[Hypothesis, Prospect] = {}
    for hypothesis in open_ones:
        trials = enumerate(trials_of(hypothesis.effect)[: trial_count(hypothesis)])
        prospects = [_prospect(signatures, accepted, hypothesis, number, shapes) for number, shapes in trials]
        found[hypothesis] = max(prospects, key=lambda prospect: prospect.gain)
    return found


def screened_apart(
    robot: Robot,
    accepted: Sequence[Hypothesis],
    open_ones: Sequence[Hypothesis],
    fitter: Fitter,
    sample: Sample,
    workers: Workers,
    roughness: float = 0.0,
) -> dict[Hypothesis, Prospect]:
    """As :func:`screen`, the effects dealt out to the workers."""
    count = workers.processes
    if count == 1:
        return screen(robot, accepted, open_ones, fitter, sample, roughness)
    effects = list(dict.fromkeys(hypothesis.effect for hypothesis in open_ones))
    dealt = [[h for h in open_ones if h.effect in effects[number::count]] for number in range(count)]
    calls = [(fitter.noise, robot, accepted, own, sample, roughness) for own in dealt if own]
    found = {h: prospect for _, prospects in workers.each(_screen_alone, calls) for h, prospect in prospects.items()}
    return {hypothesis: found[hypothesis] for hypothesis in open_ones}


def _screen_alone(
    noise: Noise,
    robot: Robot,
    accepted: Sequence[Hypothesis],
    open_ones: Sequence[Hypothesis],
    sample: Sample,
    roughness: float,
) -> dict[Hypothesis, Prospect]:
    return screen(robot, accepted, open_ones, fitter_apart(noise), sample, roughness)


def signatures_of(
    robot: Robot,
    accepted: Sequence[Hypothesis],
    hypotheses: Sequence[Hypothesis],
    fitter: Fitter,
    sample: Sample,
    roughness: float = 0.0,
) -> Signatures:
    """Of the accepted hypotheses' parameters, and of the others' on each cable alone, switched on and neutral."""
    likelihood, values = fitter.likelihood(robot, accepted, sample)
    free = free_parameters(robot, accepted)
    settings = [robot.effects[f.setting] for f in free]
    columns = [Column(s.name, s.cables, f.name, 0) for s, f in zip(settings, free, strict=True)]
    directions = list(_directions(placed(robot, sample.start), hypotheses, likelihood.model.state_names))
    columns += [column for direction in directions for column in direction.columns]
    begun = np.concatenate([np.array(values), *(direction.values for direction in directions)])
    gram, pull = np.zeros((len(begun), len(begun))), np.zeros(len(begun))
    slopes = np.hstack([direction.start for direction in directions])
    last = 0
    for run in linearise_run(likelihood, values, sample.recording, roughness):
        fitter.between()
        rows = np.zeros(len(run.own), dtype=bool)
        rows[run.own] = sample.rows[last : last + int(np.sum(run.own))]
        last += int(np.sum(run.own))
        parts = zip(*(direction.through(run) for direction in directions), strict=True)
        slopes, moved = run.carry(slopes, *(np.concatenate(part, axis=2) for part in parts))
        matrix = np.concatenate([run.slopes, moved], axis=2)[rows].reshape(-1, len(begun))
        gram += matrix.T @ matrix
        pull += matrix.T @ run.values[rows].ravel()
    return _finite(Signatures(tuple(columns), begun, gram, pull))


def _finite(signatures: Signatures) -> Signatures:
    """Without the slopes that are not finite: an effect too stiff for the filter's step has none to be trusted."""
    fine = np.isfinite(np.diag(signatures.gram))
    gram = np.where(np.outer(fine, fine), signatures.gram, 0.0)
    return Signatures(signatures.columns, signatures.values, gram, np.where(fine, signatures.pull, 0.0))


def _directions(
    robot: Robot, hypotheses: Sequence[Hypothesis], state_names: Sequence[str]
) -> Iterator[EffectDirections]:
    for effect in dict.fromkeys(hypothesis.effect for hypothesis in hypotheses):
        own = [hypothesis for hypothesis in hypotheses if hypothesis.effect is effect]
        cables = sorted({cable for hypothesis in own for cable in hypothesis.cables})
        forms = list(dict.fromkeys(hypothesis.form for hypothesis in own))
        yield EffectDirections(robot, effect, cables, forms, trials_of(effect), state_names)


def trials_of(effect: Effect) -> list[dict[str, float]]:
    """All combinations of the values from which fits of an effect begin; one, of nothing, where it has none."""
    tried = [p for p in effect.parameters if p.trials]
    return [dict(zip([p.name for p in tried], values, strict=True)) for values in product(*(p.trials for p in tried))]


def trial_count(hypothesis: Hypothesis) -> int:
    """Of a form without parameters that have trials, one is as good as all."""
    trials = trials_of(hypothesis.effect)
    return len(trials) if set(trials[0]) & set(hypothesis.form) else 1


def _prospect(
    signatures: Signatures,
    accepted: Sequence[Hypothesis],
    hypothesis: Hypothesis,
    trial: int,
    shapes: Mapping[str, float],
) -> Prospect:
    old = _first(signatures, sum(len(a.form) for a in accepted))
    names, new = moved_by(signatures, hypothesis, trial)
    without, _ = _gain(signatures, old)
    gain, move = _gain(signatures, np.hstack([old, new]))
    begun = signatures.values @ new / np.maximum(np.sum(new, axis=0), 1.0)
    values = dict(zip(names, (begun + move[old.shape[1] :]).tolist(), strict=True))
    bounds = {p.name: (p.minimum, p.maximum) for p in hypothesis.parameters}
    if any(not bounds[name][0] <= value <= bounds[name][1] for name, value in values.items()):
        inside = {name: float(np.clip(value, *bounds[name])) for name, value in values.items()}
        # A bound crossed by one parameter of several is for the fit to see to.
        if len(values) == 1:
            gain = without + (gain - without) * _kept(begun[0], values[names[0]], inside[names[0]])
        values = inside
    kept = {name: value for name, value in shapes.items() if name in hypothesis.form}
    return Prospect(gain - without, {**kept, **values})


def _kept(begun: float, best: float, bound: float) -> float:
    """Of a parabola's gain between where it has ``begun`` and its ``best``, the share at a bound between."""
    return 1.0 - ((best - bound) / (best - begun)) ** 2


def moved_by(signatures: Signatures, hypothesis: Hypothesis, trial: int) -> tuple[list[str], Array]:
    """The parameters of a hypothesis that have a slope, and which columns each moves (columns, parameters)."""
    names, columns = [], []
    acts = set(hypothesis.cables[:1] if hypothesis.form in OF_THE_PLATFORM else hypothesis.cables)
    for name in hypothesis.form:
        chosen = [
            float(
                (column.effect, column.parameter, column.trial) == (hypothesis.effect.name, name, trial)
                and set(column.cables) <= acts
            )
            for column in signatures.columns
        ]
        if np.diag(signatures.gram) @ np.array(chosen) > 0.0:
            names.append(name)
            columns.append(chosen)
    return names, np.array(columns).reshape(len(names), len(signatures.columns)).T


def _first(signatures: Signatures, count: int) -> Array:
    selected: Array = np.eye(len(signatures.columns))[:, :count]
    return selected


def _gain(signatures: Signatures, chosen: Array) -> tuple[float, Array]:
    """Half of what least squares over some combinations of columns takes off the sum of squares, and the move."""
    if not chosen.shape[1]:
        return 0.0, np.zeros(0)
    gram = chosen.T @ signatures.gram @ chosen
    size = np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
    pull = chosen.T @ signatures.pull
    move = np.linalg.lstsq(gram / np.outer(size, size), -pull / size, rcond=LEAST_SHARE)[0] / size
    return float(-0.5 * pull @ move), move
