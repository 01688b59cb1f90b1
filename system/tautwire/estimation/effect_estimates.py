"""Estimates of the accepted effects: their parameters with intervals and correlations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

from tautwire_fmu.laws.effects import UNLISTED

from ..robot.symbolic_model import FORMULA_INDEX
from .explained_shares import ExplainedShares
from .hypotheses import declared_value
from .identification_context import IdentificationContext
from .parameter_fit import Fit
from .policy import SizePolicy
from .profile_likelihood import profile_intervals
from .stepwise_selection import SelectionResult
from .time_limit import OutOfTimeError
from .trace_result import Correlation, Estimate, FittedParameter, FoundEffect


def estimated_effects(context: IdentificationContext, selection: SelectionResult) -> tuple[FoundEffect, ...]:
    """Estimates of the accepted effects of the list, in order, on the estimation data that they were fitted to."""
    indices = _parameter_indices(selection.fit)
    interval_ends = _interval_ends(context, selection)
    effects = []
    for hypothesis, evidence in zip(selection.accepted, selection.evidence, strict=True):
        if hypothesis.effect in UNLISTED:
            continue
        estimates = {}
        for parameter in hypothesis.parameters:
            index = indices[FittedParameter(hypothesis.effect.name, hypothesis.cables, parameter.name)]
            low, high = interval_ends[index]
            declared = declared_value(context.robot, parameter, hypothesis.cables)
            estimates[parameter.name] = Estimate(
                float(selection.fit.values[index]), parameter.unit, low, high, declared
            )
        effects.append(
            FoundEffect(hypothesis.effect.name, hypothesis.effect.component, hypothesis.cables, estimates, evidence)
        )
    return tuple(effects)


def _interval_ends(context: IdentificationContext, selection: SelectionResult) -> Sequence[tuple[float, float]]:
    """Ends of the interval of each fitted parameter; from the curvature alone where there is no time for more."""
    fit = selection.fit
    try:
        return profile_intervals(
            context.fitter,
            fit,
            selection.accepted,
            context.split.estimation,
            context.workers,
            context.policy.profile_likelihood,
        )
    except OutOfTimeError:
        context.leave_untried("intervals by profile likelihood: those given are from the likelihood's curvature")
        return [fit.interval(index) for index in range(len(fit.values))]


def effects_by_size(
    effects: Sequence[FoundEffect], shares: ExplainedShares, policy: SizePolicy
) -> tuple[tuple[FoundEffect, ...], tuple[FoundEffect, ...]]:
    """The effects with their shares, the largest first: those that matter, and those too small to matter."""
    with_shares = [replace(effect, share=share) for effect, share in zip(effects, shares.effects, strict=True)]
    large = shares.substantial(policy)
    return tuple(with_shares[i] for i in large), tuple(e for i, e in enumerate(with_shares) if i not in large)


def parameter_correlations(fit: Fit, effects: Sequence[FoundEffect]) -> tuple[Correlation, ...]:
    """Correlations of each two parameters of some effects, whatever else was fitted beside them.

    ``C_ik / (d_i d_k)`` of the fit's covariance C and its deviations d; none where one has no deviation.
    """
    indices, deviations = _parameter_indices(fit), fit.standard_deviations
    fitted = [FittedParameter(each.name, each.cables, parameter) for each in effects for parameter in each.parameters]
    correlations = []
    for first, second in combinations(fitted, 2):
        i, k = indices[first], indices[second]
        scale = deviations[i] * deviations[k]
        if scale > 0.0:
            value = min(max(float(fit.covariance[i, k] / scale), -1.0), 1.0)
            correlations.append(Correlation((first, second), value))
    return tuple(correlations)


def _parameter_indices(fit: Fit) -> dict[FittedParameter, int]:
    """Index in the fit of each parameter of its robot's effects."""
    of_effects = [(index, free) for index, free in enumerate(fit.free) if free.effect_index != FORMULA_INDEX]
    settings = fit.robot.effects
    return {
        FittedParameter(settings[free.effect_index].name, settings[free.effect_index].cables, free.name): index
        for index, free in of_effects
    }
