"""What a fit says of the effects that were accepted: their parameters with intervals, and how these go together."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

from tautwire_fmu.laws.effects import UNLISTED

from ..model.symbolic import OF_FORMULAS
from ..robots.robot import Robot
from .data import Sample
from .fit import Fit, Fitter
from .hypotheses import declared_value
from .profile import intervals
from .search import Found
from .verdict import Correlation, Estimate, Fitted, FoundEffect
from .workers import Workers


def found_effects(
    robot: Robot, found: Found, fitter: Fitter, sample: Sample, workers: Workers
) -> tuple[FoundEffect, ...]:
    """The accepted effects of the list, in the order found; ``robot`` is as declared, ``sample`` what was fitted."""
    places = _places(found.fit)
    ends = intervals(fitter, found.fit, found.accepted, sample, workers)
    effects = []
    for hypothesis, evidence in zip(found.accepted, found.evidence, strict=True):
        if hypothesis.effect in UNLISTED:
            continue
        estimates = {}
        for parameter in hypothesis.parameters:
            place = places[Fitted(hypothesis.effect.name, hypothesis.cables, parameter.name)]
            low, high = ends[place]
            declared = declared_value(robot, parameter, hypothesis.cables)
            estimates[parameter.name] = Estimate(float(found.fit.values[place]), parameter.unit, low, high, declared)
        effects.append(
            FoundEffect(hypothesis.effect.name, hypothesis.effect.component, hypothesis.cables, estimates, evidence)
        )
    return tuple(effects)


def correlations_of(fit: Fit, effects: Sequence[FoundEffect]) -> tuple[Correlation, ...]:
    """The correlation of each two parameters of some effects, whatever else was fitted beside them.

    ``C_ik / (d_i d_k)`` of the fit's covariance C and its deviations d; none where one has no deviation.
    """
    places, deviations = _places(fit), fit.deviations
    fitted = [Fitted(each.name, each.cables, parameter) for each in effects for parameter in each.parameters]
    found = []
    for one, other in combinations(fitted, 2):
        i, k = places[one], places[other]
        scale = deviations[i] * deviations[k]
        if scale > 0.0:
            value = min(max(float(fit.covariance[i, k] / scale), -1.0), 1.0)
            found.append(Correlation((one, other), value))
    return tuple(found)


def _places(fit: Fit) -> dict[Fitted, int]:
    """Where the fit has each parameter of its robot's effects."""
    of_effects = [(index, free) for index, free in enumerate(fit.free) if free.setting != OF_FORMULAS]
    settings = fit.robot.effects
    return {
        Fitted(settings[free.setting].name, settings[free.setting].cables, free.name): index
        for index, free in of_effects
    }
