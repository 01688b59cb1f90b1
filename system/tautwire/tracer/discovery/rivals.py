"""Known effects that are no kind of the list, in the place of those found, whose names must not go to their likes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import chain, combinations
from math import inf, log

from tautwire_fmu.laws.effects import UNLISTED

from ...errors import UnreachableError
from ...robots.robot import Robot
from ..adequacy import is_noise
from ..data import Evidence, Sample
from ..fit import EXACT, Fit, Fitter, NoFitError
from ..hypotheses import Hypothesis, hypotheses, joined
from ..search import PART, ROUGHLY_ALIKE, SHARE_ALIKE, Found
from ..trials import ALIKE, setting_of

Progress = Callable[[str, float], None]


def with_rivals(
    robot: Robot, found: Found, fitter: Fitter, evidence: Evidence, alpha: float, progress: Progress
) -> Found:
    """What a search found, or an unlisted effect in the place of some of it.

    That is where it explains more with no more parameters, or as much with fewer. Where what was found leaves more than
    noise, an unlisted effect is tried beside it too, and has to leave noise. Judged on samples that did not fit it.
    """
    judge = evidence.judge
    enough = is_noise(fitter.judged(found.fit.robot, found.accepted, judge), judge.rows)
    if enough and not found.accepted:
        return found
    significant = log((len(hypotheses(robot)) + 1) / alpha)
    best, worth = found, _worth(fitter, found.fit, found.accepted, judge)
    tried = list(_tried(robot, found.accepted, enough))
    for number, chosen in enumerate(tried):
        progress(f"rivals: {chosen[-1].label(robot)}", number / len(tried))
        fit = _fit(robot, found, chosen, fitter, evidence)
        if fit is None or not (enough or is_noise(fitter.judged(fit.robot, chosen, judge), judge.rows)):
            continue
        gain = _worth(fitter, fit, chosen, judge) - worth
        more = _count(chosen) - _count(best.accepted)
        if gain > (-ALIKE if more < 0 else ALIKE if more == 0 else significant):
            best, worth = _found(found, chosen, fit, gain), worth + gain
    return best


def _tried(robot: Robot, accepted: Sequence[Hypothesis], enough: bool) -> Iterator[tuple[Hypothesis, ...]]:
    """Each unlisted effect beside parts of what was accepted; all of that only where it is not enough."""
    largest = len(accepted) - 1 if enough else len(accepted)
    parts = list(chain.from_iterable(combinations(accepted, size) for size in range(largest + 1)))
    places = dict.fromkeys([robot.cable_numbers, *(hypothesis.cables for hypothesis in accepted if hypothesis.cables)])
    for effect in UNLISTED:
        for cables in places:
            for part in parts:
                yield tuple(joined(part, Hypothesis(effect, cables)))


def _fit(robot: Robot, found: Found, chosen: Sequence[Hypothesis], fitter: Fitter, evidence: Evidence) -> Fit | None:
    """Fitted to all samples where a fit to a part of them comes near what was found; None where it does not."""
    head = evidence.fit.head
    start = robot
    for hypothesis in chosen:
        old = hypothesis in found.accepted
        start = start.with_effect(setting_of(found.fit.robot, hypothesis) if old else hypothesis.setting(robot))
    reached = _worth(fitter, found.fit, found.accepted, head)
    try:
        rough = fitter.fit_from([start], chosen, head, -inf, PART)
        if _worth(fitter, rough, chosen, head) < reached - ROUGHLY_ALIKE - SHARE_ALIKE * abs(reached):
            return None
        return fitter.fit_from([rough.robot], chosen, evidence.fit, -inf, EXACT)
    except (UnreachableError, NoFitError):
        return None


def _worth(fitter: Fitter, fit: Fit, chosen: Sequence[Hypothesis], sample: Sample) -> float:
    return fitter.judged(fit.robot, chosen, sample).log_likelihood(sample.rows)


def _count(chosen: Sequence[Hypothesis]) -> int:
    return sum(len(hypothesis.form) for hypothesis in chosen)


def _found(found: Found, chosen: Sequence[Hypothesis], fit: Fit, gain: float) -> Found:
    """The chosen in the place of what was found; evidence of the last is what it gains over that."""
    kept = [found.evidence[found.accepted.index(h)] if h in found.accepted else gain for h in chosen]
    return replace(found, accepted=tuple(chosen), evidence=tuple(kept), fit=fit)
