"""What hypotheses gain at values that their effects name: where slopes about the model without them mislead.

A rope softens near slackness by ``s ln(1 + exp(T / s))``: at ``s = 0`` all derivatives vanish, so linearisations
promise nothing however much it would explain. A friction force far above the first slope's reach ends a fit in the
wrong valley. The model itself is run at some values instead.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import product
from math import exp, inf, isfinite, log
from typing import Any

import numpy as np
from scipy.optimize import brentq

from tautwire_fmu.laws.effects import Parameter

from ..errors import UnreachableError
from ..robots.robot import EffectSetting, Robot
from .attempts import fitter_apart
from .data import Sample
from .filter_step import Noise
from .fit import Fitter
from .hypotheses import Hypothesis, joined
from .screen import Prospect
from .workers import Workers

# Nats that do not count: smaller values of the parameter are not felt either.
UNFELT = 0.01
# Relative.
PRECISION = 0.01


def silent(prospects: Mapping[Hypothesis, Prospect]) -> dict[Hypothesis, Prospect]:
    """Those of parameters that name values to look at and have no slope."""
    return {h: p for h, p in prospects.items() if any(q.scanned and q.name not in p.values for q in h.parameters)}


def scanned(
    robot: Robot,
    accepted: Sequence[Hypothesis],
    fitter: Fitter,
    sample: Sample,
    prospects: Mapping[Hypothesis, Prospect],
    workers: Workers,
) -> dict[Hypothesis, Prospect]:
    """The prospects that name values to look at, better where a run at one gains more than a run at what they promise.

    ``robot`` has the accepted hypotheses, whose parameters stay as they are.
    """
    asked = [hypothesis for hypothesis in prospects if any(p.scanned for p in hypothesis.parameters)]
    if not asked:
        return {}
    without = fitter.judged(robot, accepted, sample).log_likelihood(sample.rows)
    tasks = [(robot, joined(accepted, h), sample, prospects[h], without) for h in asked]
    if workers.processes == 1:
        made = workers.each(partial(better, fitter), tasks)
    else:
        made = workers.each(better_apart, [(fitter.noise, *task) for task in tasks])
    return {asked[number]: prospect for number, prospect in made}


def better(
    fitter: Fitter, robot: Robot, chosen: Sequence[Hypothesis], sample: Sample, prospect: Prospect, without: float
) -> Prospect:
    """Of the last of the chosen hypotheses: what it promises, or what gains more by a run.

    ``without`` is the log-likelihood of the sample without it.
    """
    gains = []
    if prospect.values and isfinite(promised := _run(robot, chosen, fitter, sample, prospect.values) - without):
        gains.append((promised, prospect))
    for shapes in looked_at(chosen[-1]):
        tried = [{**prospect.values, **values} for values in shapes]
        found = [_run(robot, chosen, fitter, sample, values) - without for values in tried]
        gains += [(g, Prospect(g, values)) for g, values in zip(found, tried, strict=True) if isfinite(g)]
        if all(abs(gain) < UNFELT for gain in found):
            break
    return max(gains, key=lambda each: each[0], default=(0.0, prospect))[1]


def better_apart(noise: Noise, *asked: Any) -> Prospect:
    """As :func:`better`, in a process that keeps a fitter of its own."""
    return better(fitter_apart(noise), *asked)


def felt_from(
    robot: Robot,
    accepted: Sequence[Hypothesis],
    fitter: Fitter,
    sample: Sample,
    hypothesis: Hypothesis,
    parameter: Parameter,
    distance: float,
) -> float:
    """The value of a scanned parameter that moves the whitened innovations by so much, as root of the sum of squares.

    Infinite where the largest value to look at does not. The other parameters are where fits begin.
    """
    chosen = joined(accepted, hypothesis)
    without = fitter.judged(robot, accepted, sample).values[sample.rows]

    def excess(scale: float) -> float:
        begun = hypothesis.setting(robot)
        setting = EffectSetting(begun.name, {**begun.values, parameter.name: exp(scale)}, begun.cables)
        try:
            moved = fitter.judged(robot.with_effect(setting), chosen, sample).values[sample.rows] - without
        except UnreachableError:
            return distance
        found = float(np.sqrt(np.nansum(moved**2)))
        return min(found, 2.0 * distance) - distance if isfinite(found) else distance

    least, most = log(min(parameter.scanned)), log(max(parameter.scanned))
    if excess(most) < 0.0:
        return inf
    return exp(least if excess(least) > 0.0 else brentq(excess, least, most, xtol=PRECISION))


def looked_at(hypothesis: Hypothesis) -> Iterator[list[dict[str, float]]]:
    """The values to look at, the largest first, each with all trials of the parameters that shape the effect."""
    scales = [p for p in hypothesis.parameters if p.scanned]
    shapes = [p for p in hypothesis.parameters if p.trials]
    if not scales:
        return
    names = [p.name for p in (*scales, *shapes)]
    for sizes in product(*(sorted(p.scanned, reverse=True) for p in scales)):
        shaped = product(*(p.trials for p in shapes))
        yield [dict(zip(names, (*sizes, *values), strict=True)) for values in shaped]


def _run(
    robot: Robot, chosen: Sequence[Hypothesis], fitter: Fitter, sample: Sample, values: Mapping[str, float]
) -> float:
    """Log-likelihood with the last of the chosen at some values; NaN where the cables cannot hold them."""
    begun = chosen[-1].setting(robot)
    setting = EffectSetting(begun.name, {**begun.values, **values}, begun.cables)
    try:
        return fitter.judged(robot.with_effect(setting), chosen, sample).log_likelihood(sample.rows)
    except UnreachableError:
        return float("nan")
