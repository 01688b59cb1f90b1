"""What each hypothesis could gain at most, from linearisations about the present model: spares hopeless fits.

An effect too small to see moves the innovations in proportion to its parameters, ``e + J d``. Evaluations with every
parameter at its neutral value give ``J`` for all hypotheses at once; least squares on FIT gives ``d``, and what it
gains there. Parameters that count only while others are not neutral (the time of a relaxation) have no slope there:
the others are tried at several values of theirs.

Source: Rao's score test, e.g. Cox and Hinkley (1974), Theoretical Statistics, sec. 9.3.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.effects import Effect

from ..robot import PER_CABLE, EffectSetting, Robot
from .data import Sample
from .fit import Fitter
from .hypotheses import OF_THE_PLATFORM, Hypothesis, free_parameters

Array = NDArray[np.float64]
Column = tuple[str, tuple[int, ...], str]

# Directions of the parameters that move the innovations by less than this share of the others are not told apart.
LEAST_SHARE = 1e-9


@dataclass(frozen=True)
class Prospect:
    """What a hypothesis promises: log-likelihood gained on FIT, and the values that would gain it."""

    gain: float
    values: Mapping[str, float]


@dataclass(frozen=True)
class Signatures:
    """Innovations ``error`` (k,) of all samples that count, and how each parameter moves them.

    ``columns`` are (effect, cables, parameter); ``slopes`` (k, columns); ``values`` where they were taken.
    """

    error: Array
    columns: tuple[Column, ...]
    slopes: Array
    values: Array
    gram: Array = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "gram", self.slopes.T @ self.slopes)


def screen(
    robot: Robot,
    accepted: Sequence[Hypothesis],
    open_ones: Sequence[Hypothesis],
    fitter: Fitter,
    sample: Sample,
) -> dict[Hypothesis, Prospect]:
    """The best prospect of each hypothesis beside the accepted ones, whose parameters move along."""
    found: dict[Hypothesis, Prospect] = {}
    for effects in _groups(open_ones):
        for number in range(max(len(_trials(effect)) for effect in effects)):
            present = [h for h in open_ones if h.effect in effects and number < _trial_count(h)]
            signatures = _signatures(robot, accepted, present, number, fitter, sample)
            for hypothesis in present:
                prospect = _prospect(signatures, accepted, hypothesis, _trials(hypothesis.effect)[number])
                if hypothesis not in found or prospect.gain > found[hypothesis].gain:
                    found[hypothesis] = prospect
    return found


def _groups(open_ones: Iterable[Hypothesis]) -> list[list[Effect]]:
    """Effects that are linearised together: each with states of its own apart, they may be stiff."""
    effects = list(dict.fromkeys(hypothesis.effect for hypothesis in open_ones))
    groups = [[e for e in effects if not e.states], *([e] for e in effects if e.states)]
    return [group for group in groups if group]


def _trials(effect: Effect) -> list[dict[str, float]]:
    tried = [p for p in effect.parameters if p.trials]
    return [dict(zip([p.name for p in tried], values, strict=True)) for values in product(*(p.trials for p in tried))]


def _trial_count(hypothesis: Hypothesis) -> int:
    """Of a form without parameters that have trials, one is as good as all."""
    trials = _trials(hypothesis.effect)
    return len(trials) if set(trials[0]) & set(hypothesis.form) else 1


def _signatures(
    robot: Robot,
    accepted: Sequence[Hypothesis],
    hypotheses: Sequence[Hypothesis],
    trial: int,
    fitter: Fitter,
    sample: Sample,
) -> Signatures:
    """All effects of the hypotheses switched on and neutral, one cable at a time."""
    forms: dict[tuple[Effect, tuple[int, ...]], dict[str, None]] = {}
    for hypothesis in hypotheses:
        for cables in _one_each(hypothesis):
            forms.setdefault((hypothesis.effect, cables), {}).update(dict.fromkeys(hypothesis.form))
    whole, new = robot, []
    for (effect, cables), form in forms.items():
        values = {**Hypothesis(effect, cables).neutral(robot, cables).values, **_trials(effect)[trial]}
        whole = whole.with_effect(EffectSetting(effect.name, values, cables))
        new.append(Hypothesis(effect, cables, tuple(name for name in form if name not in _trials(effect)[trial])))
    free = free_parameters(whole, [*accepted, *new])
    innovations = fitter.linearised(whole, free, sample, {effect.name for effect, _ in forms})
    chosen = innovations.seen & sample.rows[:, None]
    settings = [whole.effects[f.setting] for f in free]
    slopes = innovations.slopes[chosen]
    # An effect too stiff for the filter's step has no slope that could be trusted.
    slopes[:, ~np.isfinite(slopes).all(axis=0)] = 0.0
    return Signatures(
        innovations.values[chosen],
        tuple((s.name, s.cables, f.name) for s, f in zip(settings, free, strict=True)),
        slopes,
        np.array([s.values[f.name] for s, f in zip(settings, free, strict=True)]),
    )


def _one_each(hypothesis: Hypothesis) -> list[tuple[int, ...]]:
    if hypothesis.effect.component not in PER_CABLE:
        return [()]
    return [(cable,) for cable in hypothesis.cables]


def _prospect(
    signatures: Signatures, accepted: Sequence[Hypothesis], hypothesis: Hypothesis, shapes: Mapping[str, float]
) -> Prospect:
    old = _selection(signatures, [(a.effect.name, a.cables, name) for a in accepted for name in a.form])
    names, new = _moved(signatures, hypothesis)
    without, _ = _gain(signatures, old)
    gain, move = _gain(signatures, np.hstack([old, new]))
    begun = signatures.values @ new / np.maximum(np.sum(new, axis=0), 1.0)
    values = dict(zip(names, (begun + move[old.shape[1] :]).tolist(), strict=True))
    bounds = {p.name: (p.minimum, p.maximum) for p in hypothesis.parameters}
    if any(not bounds[name][0] <= value <= bounds[name][1] for name, value in values.items()):
        # A bound crossed by one parameter of several is for the fit to see to.
        gain = without if len(values) == 1 else gain
        values = {name: float(np.clip(value, *bounds[name])) for name, value in values.items()}
    kept = {name: value for name, value in shapes.items() if name in hypothesis.form}
    return Prospect(gain - without, {**kept, **values})


def _moved(signatures: Signatures, hypothesis: Hypothesis) -> tuple[list[str], Array]:
    """The parameters of a hypothesis that have a slope, and which columns each moves (columns, parameters)."""
    names, columns = [], []
    acts = set(hypothesis.cables[:1] if hypothesis.form in OF_THE_PLATFORM else hypothesis.cables)
    for name in hypothesis.form:
        chosen = [
            float((effect, parameter) == (hypothesis.effect.name, name) and set(cables) <= acts)
            for effect, cables, parameter in signatures.columns
        ]
        if np.diag(signatures.gram) @ np.array(chosen) > 0.0:
            names.append(name)
            columns.append(chosen)
    return names, np.array(columns).reshape(len(names), len(signatures.columns)).T


def _selection(signatures: Signatures, columns: Sequence[Column]) -> Array:
    places = [signatures.columns.index(column) for column in columns if column in signatures.columns]
    selected: Array = np.eye(len(signatures.columns))[:, places]
    return selected


def _gain(signatures: Signatures, chosen: Array) -> tuple[float, Array]:
    """Half of what least squares over some combinations of columns takes off the sum of squares, and the move."""
    if not chosen.shape[1]:
        return 0.0, np.zeros(0)
    gram = chosen.T @ signatures.gram @ chosen
    size = np.sqrt(np.maximum(np.diag(gram), np.finfo(float).tiny))
    pull = chosen.T @ (signatures.slopes.T @ signatures.error)
    move = np.linalg.lstsq(gram / np.outer(size, size), -pull / size, rcond=LEAST_SHARE)[0] / size
    return float(-0.5 * pull @ move), move
