"""Other models in the place of what was found, so that nothing gets the name of its likes.

They are known effects that are no kind of the list, and larger forms of fewer effects.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import chain, combinations
from math import inf, log

from tautwire_fmu.laws.effects import UNLISTED

from ..errors import UnreachableError
from ..robots.robot import EffectSetting, Robot
from .adequacy import is_noise
from .data import Evidence, Sample
from .fit import EXACT, Fit, Fitter, NoFitError
from .hypotheses import Hypothesis, enlarged, hypotheses, joined
from .search import PART, ROUGHLY_ALIKE, SHARE_ALIKE, Found
from .trials import ALIKE, setting_of

Progress = Callable[[str, float], None]


def with_rivals(
    robot: Robot, found: Found, fitter: Fitter, evidence: Evidence, alpha: float, progress: Progress
) -> Found:
    """What a search found, or an unlisted effect or a larger form of one effect in the place of some of it.

    That is where it explains more with no more parameters, or as much with fewer. Where what was found leaves more than
    noise, an unlisted effect is tried beside it too, and has to leave noise. Judged on samples that did not fit it.
    """
    judge = evidence.judge
    enough = is_noise(fitter.judged(found.fit.robot, found.accepted, judge), judge.rows)
    if enough and not found.accepted:
        return found
    significant = log((len(hypotheses(robot)) + 1) / alpha)
    best, worth = found, _worth(fitter, found.fit, found.accepted, judge)
    tried = [*_unlisted(robot, found.accepted, enough), *_larger(found.accepted)]
    for number, chosen in enumerate(tried):
        progress(f"rivals: {chosen[-1].label(robot)}", number / len(tried))
        fit = _fit(robot, found, chosen, fitter, evidence)
        if fit is None or not (enough or is_noise(fitter.judged(fit.robot, chosen, judge), judge.rows)):
            continue
        gain = _worth(fitter, fit, chosen, judge) - worth
        more = _count(chosen) - _count(best.accepted)
        if gain > (-ALIKE if more < 0 else ALIKE if more == 0 else significant):
            worth += gain
            best = _found(found, chosen, fit, worth - _without_last(robot, fit, chosen, fitter, judge))
    return best


def _larger(accepted: Sequence[Hypothesis]) -> Iterator[tuple[Hypothesis, ...]]:
    """One more form of each accepted effect beside parts of the others."""
    for old in accepted:
        others = [hypothesis for hypothesis in accepted if hypothesis is not old]
        for size in range(len(others)):
            for part in combinations(others, size):
                for larger in enlarged([old]):
                    yield (*part, larger)


def _unlisted(robot: Robot, accepted: Sequence[Hypothesis], enough: bool) -> Iterator[tuple[Hypothesis, ...]]:
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
        start = start.with_effect(_begun(robot, found, hypothesis))
    reached = _worth(fitter, found.fit, found.accepted, head)
    try:
        rough = fitter.fit_from([start], chosen, head, -inf, PART)
        if _worth(fitter, rough, chosen, head) < reached - ROUGHLY_ALIKE - SHARE_ALIKE * abs(reached):
            return None
        return fitter.fit_from([rough.robot], chosen, evidence.fit, -inf, EXACT)
    except (UnreachableError, NoFitError):
        return None


def _begun(robot: Robot, found: Found, hypothesis: Hypothesis) -> EffectSetting:
    """Where a fit begins: what was found of the same effect is kept."""
    begun = hypothesis.setting(robot)
    for old in found.accepted:
        if (old.effect, old.cables) == (hypothesis.effect, hypothesis.cables):
            known = setting_of(found.fit.robot, old).values
            return replace(begun, values={**begun.values, **{name: known[name] for name in old.form}})
    return begun


def _worth(fitter: Fitter, fit: Fit, chosen: Sequence[Hypothesis], sample: Sample) -> float:
    return fitter.judged(fit.robot, chosen, sample).log_likelihood(sample.rows)


def _count(chosen: Sequence[Hypothesis]) -> int:
    return sum(len(hypothesis.form) for hypothesis in chosen)


def _without_last(robot: Robot, fit: Fit, chosen: Sequence[Hypothesis], fitter: Fitter, judge: Sample) -> float:
    """Log-likelihood of the judging samples under the others at their best there; -inf where they cannot be run."""
    others = chosen[:-1]
    for hypothesis in others:
        robot = robot.with_effect(setting_of(fit.robot, hypothesis))
    try:
        best = fitter.fit_from([robot], others, judge, -inf) if others else replace(fit, robot=robot)
        return _worth(fitter, best, others, judge)
    except (UnreachableError, NoFitError):
        return -inf


def _found(found: Found, chosen: Sequence[Hypothesis], fit: Fit, evidence: float) -> Found:
    """The chosen in the place of what was found, with the evidence of the last of them."""
    kept = [found.evidence[found.accepted.index(h)] if h in found.accepted else evidence for h in chosen]
    names = {hypothesis.effect.name for hypothesis in chosen}
    alike = tuple(pair for pair in found.alike if pair[0] in names)
    return replace(found, accepted=tuple(chosen), evidence=tuple(kept), fit=fit, alike=alike)
