"""Estimates of the accepted effects: their parameters with intervals and correlations."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from functools import partial
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.effects import UNLISTED

from ..robot.schema import Robot
from .explained_shares import ExplainedShares
from .hypotheses import Hypothesis, declared_value
from .identification_context import IdentificationContext
from .parameter_fit import Fit
from .parameter_stability import stable_intervals
from .policy import SizePolicy
from .profile_likelihood import profile_intervals
from .selection_result import SelectionResult
from .time_limit import OutOfTimeError
from .trace_result import Correlation, Estimate, FittedParameter, FoundEffect

Array = NDArray[np.float64]

# Of an interval's half-width, in the values of a robot as found.
READABLE_DIGITS = 4


def estimated_effects(context: IdentificationContext, selection: SelectionResult) -> tuple[FoundEffect, ...]:
    """Estimates of the accepted effects of the list, in order, on the estimation data that they were fitted to."""
    interval_ends, disagree, dominant = _interval_ends(context, selection)
    effects = []
    for hypothesis, evidence in zip(selection.accepted, selection.evidence, strict=True):
        if hypothesis.effect in UNLISTED:
            continue
        estimates, unstable = {}, []
        for parameter in hypothesis.parameters:
            index = selection.fit.parameter_index(hypothesis.effect.name, hypothesis.cables, parameter.name)
            low, high = interval_ends[index]
            declared = declared_value(context.robot, parameter, hypothesis.cables)
            unstable += [parameter.name] if disagree[index] else []
            value = float(selection.fit.values[index])
            estimates[parameter.name] = Estimate(value, parameter.unit, low, high, declared, dominant[index])
        name, component = hypothesis.effect.name, hypothesis.effect.component
        effect = FoundEffect(name, component, hypothesis.cables, estimates, evidence, unstable=tuple(unstable))
        effects.append(effect)
    return tuple(effects)


def _interval_ends(
    context: IdentificationContext, selection: SelectionResult
) -> tuple[Sequence[tuple[float, float]], Sequence[bool], Sequence[str]]:
    """Ends of the interval of each fitted parameter, whether the recordings disagree on it, and what makes it wide.

    Beside a disturbance they are by the spread over stretches and recordings, else by profile likelihood; from the
    curvature alone where there is no time for more.
    """
    fit = selection.fit
    agree, unknown = [False] * len(fit.values), [""] * len(fit.values)
    try:
        context.time_limit.check()
        if context.fitter.has_disturbance:
            neutral_values = _neutral_values(context.robot, selection)
            stable, disagree = stable_intervals(context, fit, selection.accepted, neutral_values)
            ends = list(zip(stable.low.tolist(), stable.high.tolist(), strict=True))
            return ends, disagree.tolist(), stable.dominant.tolist()
        ends = profile_intervals(
            context.fitter,
            fit,
            selection.accepted,
            context.split.estimation,
            context.workers,
            context.policy.profile_likelihood,
        )
    except OutOfTimeError:
        context.leave_untried("intervals of the parameters: those given are from the likelihood's curvature")
        return [fit.interval(index) for index in range(len(fit.values))], agree, unknown
    return ends, agree, unknown


def _neutral_values(declared: Robot, selection: SelectionResult) -> Array:
    """Values (p,) of the fitted parameters without their effects: neutral, or as the robot file declares."""
    values = selection.fit.values.copy()
    for hypothesis in selection.accepted:
        for parameter in hypothesis.parameters:
            neutral = parameter.neutral
            if neutral is None:
                neutral = declared_value(declared, parameter, hypothesis.cables) or 0.0
            index = selection.fit.parameter_index(hypothesis.effect.name, hypothesis.cables, parameter.name)
            values[index] = neutral
    return values


def with_readable_values(robot: Robot, declared: Robot, effects: Sequence[FoundEffect]) -> Robot:
    """The robot with its fitted numbers to as many digits as they are worth.

    Values of ``effects`` to a thousandth of their intervals' half-widths, other numbers that are not as ``declared`` to
    ten significant digits, and standard deviations to four.
    """
    widths = {
        (effect.name, effect.cables, name): 0.5 * (estimate.high - estimate.low)
        for effect in effects
        for name, estimate in effect.parameters.items()
    }
    settings = []
    for setting in robot.effects:
        keys = {name: (setting.name, setting.cables, name) for name in setting.values}
        values = {name: _rounded(value, widths.get(keys[name], 0.0)) for name, value in setting.values.items()}
        settings.append(replace(setting, values=values))
    platform = replace(
        robot.platform,
        mass=_unless_declared(robot.platform.mass, declared.platform.mass),
        mass_uncertainty=_unless_declared(robot.platform.mass_uncertainty, declared.platform.mass_uncertainty, 4),
    )
    cables = []
    for cable, before in zip(robot.cables, declared.cables, strict=True):
        x, y, z = map(_unless_declared, cable.anchor, before.anchor)
        modulus, damping = (_unless_declared(getattr(cable, n), getattr(before, n)) for n in ("modulus", "damping"))
        deviation = partial(_unless_declared, digits=4)
        cables.append(
            replace(
                cable,
                modulus=modulus,
                damping=damping,
                anchor=(x, y, z),
                modulus_uncertainty=deviation(cable.modulus_uncertainty, before.modulus_uncertainty),
                damping_uncertainty=deviation(cable.damping_uncertainty, before.damping_uncertainty),
                anchor_uncertainty=deviation(cable.anchor_uncertainty, before.anchor_uncertainty),
            )
        )
    return replace(robot, effects=tuple(settings), platform=platform, cables=tuple(cables))


def _rounded(value: float, half_width: float) -> float:
    """A value to a thousandth of a half-width; as it is where that is zero or not finite."""
    if not (np.isfinite(half_width) and half_width > 0.0 and np.isfinite(value)):
        return value
    return round(value, READABLE_DIGITS - 1 - int(np.floor(np.log10(half_width))))


def _unless_declared(value: float, declared: float, digits: int = 10) -> float:
    """A number to so many significant digits, or as it is declared."""
    return value if value == declared else float(f"{value:.{digits}g}")


def effects_by_size(
    effects: Sequence[FoundEffect], accepted: Sequence[Hypothesis], shares: ExplainedShares, policy: SizePolicy
) -> tuple[tuple[FoundEffect, ...], tuple[FoundEffect, ...]]:
    """The effects with their shares, the largest first: those that matter, and those too small to matter."""
    large = {(accepted[index].effect.name, accepted[index].cables) for index in shares.substantial(policy)}
    with_shares = effects_with_shares(effects, accepted, shares)
    return (
        tuple(effect for effect in with_shares if (effect.name, effect.cables) in large),
        tuple(effect for effect in with_shares if (effect.name, effect.cables) not in large),
    )


def effects_by_evidence(
    effects: Sequence[FoundEffect], substantial: Collection[Hypothesis]
) -> tuple[tuple[FoundEffect, ...], tuple[FoundEffect, ...]]:
    """The effects of the substantial hypotheses, and the others, both in order."""
    keys = {(hypothesis.effect.name, hypothesis.cables) for hypothesis in substantial}
    large = tuple(effect for effect in effects if (effect.name, effect.cables) in keys)
    return large, tuple(effect for effect in effects if effect not in large)


def effects_with_shares(
    effects: Sequence[FoundEffect], accepted: Sequence[Hypothesis], shares: ExplainedShares
) -> tuple[FoundEffect, ...]:
    """The effects with their shares, the largest first."""
    by_hypothesis = zip(accepted, shares.effects, strict=True)
    by_key = {(hypothesis.effect.name, hypothesis.cables): share for hypothesis, share in by_hypothesis}
    with_shares = [replace(effect, share=by_key[effect.name, effect.cables]) for effect in effects]
    return tuple(sorted(with_shares, key=lambda effect: -(effect.share or 0.0)))


def series_stiffness_notes(effects: Sequence[FoundEffect], cable_count: int) -> tuple[str, ...]:
    """A note where all ropes are softer than declared: what stands in series with them looks nearly the same.

    A mount's stiffness is constant, a rope's is EA / L.
    """
    softer = {
        cable
        for effect in effects
        for estimate in (effect.parameters.get("modulus"),)
        if effect.name == "modulus" and estimate and estimate.declared and estimate.high < estimate.declared
        for cable in effect.cables
    }
    if len(softer) < cable_count:
        return ()
    return (
        "frame or pulley mounts that give way in series with the ropes look like a lower modulus of all cables; only "
        "their stiffness is the same at any rope length, which a motion through longer and shorter ropes shows",
    )


def parameter_correlations(fit: Fit, effects: Sequence[FoundEffect]) -> tuple[Correlation, ...]:
    """Correlations of each two parameters of some effects, whatever else was fitted beside them.

    ``C_ik / (d_i d_k)`` of the fit's covariance C and its deviations d; none where one has no deviation.
    """
    deviations = fit.standard_deviations
    fitted = [FittedParameter(each.name, each.cables, parameter) for each in effects for parameter in each.parameters]
    correlations = []
    for first, second in combinations(fitted, 2):
        i, k = (fit.parameter_index(each.name, each.cables, each.parameter) for each in (first, second))
        scale = deviations[i] * deviations[k]
        if scale > 0.0:
            value = min(max(float(fit.covariance[i, k] / scale), -1.0), 1.0)
            correlations.append(Correlation((first, second), value))
    return tuple(correlations)
