"""What each hypothesis could gain at most, from one linearisation: spares the fits that cannot matter.

Near a model that already leaves noise, an effect too small to see moves the innovations in proportion to its
parameters, ``e + J d``. One evaluation with every parameter at its neutral value gives ``J`` for all hypotheses;
least squares on FIT gives ``d``, and what it gains on both recordings.

Source: Rao's score test, e.g. Cox and Hinkley (1974), Theoretical Statistics, sec. 9.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..robot import EffectSetting, Robot
from ..symbolic import FreeParameter
from .data import Evidence, Sample
from .fit import Fitter
from .hypotheses import Hypothesis, declared_value, free_parameters

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Prospect:
    """What a hypothesis promises: values, log-likelihood gained on FIT and on the judging samples, mean square."""

    values: tuple[float, ...]
    fit_gain: float
    judge_gain: float
    mean_square: float


def screen(
    robot: Robot,
    accepted: Sequence[Hypothesis],
    open_ones: Sequence[Hypothesis],
    fitter: Fitter,
    evidence: Evidence,
) -> dict[Hypothesis, Prospect]:
    """The prospect of each hypothesis beside the accepted ones, whose parameters move along."""
    whole, single = robot, []
    for hypothesis in open_ones:
        parts: list[tuple[int, ...]] = [(cable,) for cable in hypothesis.cables]
        for cables in parts or [()]:
            whole = whole.with_effect(_neutral(robot, hypothesis, cables))
            single.append(Hypothesis(hypothesis.effect, cables))
    free = free_parameters(whole, [*accepted, *single])
    fit_error, fit_slopes = _linearised(whole, free, fitter, evidence.fit)
    judge_error, judge_slopes = _linearised(whole, free, fitter, evidence.judge)
    present = {(h.effect.name, h.cables) for h in accepted}
    old = _selection(free, [i for i, f in enumerate(free) if _key(whole, f) in present])
    found = {}
    for hypothesis in open_ones:
        new = _columns(whole, free, hypothesis)
        without = _least_squares(fit_error, fit_slopes @ old)
        chosen = np.hstack([old, new])
        move = _least_squares(fit_error, fit_slopes @ chosen)
        base = fit_error + fit_slopes @ old @ without
        fitted = fit_error + fit_slopes @ chosen @ move
        judged = judge_error + judge_slopes @ chosen @ move
        begun = [whole.effects[free[i].setting].values[free[i].name] for i in np.argmax(new, axis=0)]
        found[hypothesis] = Prospect(
            values=tuple((np.array(begun) + move[old.shape[1] :]).tolist()),
            fit_gain=0.5 * float(base @ base - fitted @ fitted),
            judge_gain=0.5 * float(judge_error @ judge_error - judged @ judged),
            mean_square=float(np.mean(judged**2)),
        )
    return found


def _neutral(robot: Robot, hypothesis: Hypothesis, cables: tuple[int, ...]) -> EffectSetting:
    values = {}
    for parameter in hypothesis.effect.parameters:
        declared = declared_value(robot, parameter, cables)
        values[parameter.name] = parameter.neutral if declared is None else declared
    return EffectSetting(hypothesis.effect.name, {k: float(v or 0.0) for k, v in values.items()}, cables)


def _linearised(robot: Robot, free: Sequence[FreeParameter], fitter: Fitter, sample: Sample) -> tuple[Array, Array]:
    innovations = fitter.linearised(robot, free, sample)
    chosen = innovations.seen & sample.rows[:, None]
    return innovations.values[chosen], innovations.slopes[chosen]


def _key(robot: Robot, parameter: FreeParameter) -> tuple[str, tuple[int, ...]]:
    setting = robot.effects[parameter.setting]
    return setting.name, setting.cables


def _columns(robot: Robot, free: Sequence[FreeParameter], hypothesis: Hypothesis) -> Array:
    """Which parameters a hypothesis moves together, shape (all parameters, those of the effect)."""
    columns = np.zeros((len(free), len(hypothesis.effect.parameters)))
    names = [p.name for p in hypothesis.effect.parameters]
    for row, parameter in enumerate(free):
        name, cables = _key(robot, parameter)
        if name == hypothesis.effect.name and set(cables) <= set(hypothesis.cables):
            columns[row, names.index(parameter.name)] = 1.0
    return columns


def _selection(free: Sequence[FreeParameter], places: Sequence[int]) -> Array:
    selected: Array = np.eye(len(free))[:, list(places)]
    return selected


def _least_squares(error: Array, slopes: Array) -> Array:
    """The move that makes ``error + slopes move`` smallest, columns scaled to one length."""
    size = np.linalg.norm(slopes, axis=0)
    size = np.where(size > 0.0, size, 1.0)
    move: Array = np.linalg.lstsq(slopes / size, -error, rcond=1e-10)[0] / size
    return move
