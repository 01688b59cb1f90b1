"""Values of single cables in place of those that an effect's cables share.

Names are established on unseen data. How many numbers a named effect has is less: cables get one each where the
likelihood of FIT is worth these by Schwarz's criterion, half a log of the number of values N for each of k numbers, and
FIT and CHECK together, the latter at the values of FIT, gain more than the effect's form may leave, a share of its
evidence.

    log L(each its own) - log L(shared) > k/2 log N on FIT, and > share evidence on both

Both are taken beside the best disturbance of each recording.

Where no tension was measured, nothing tells how far ropes stretch, and a likelihood makes up for stiffness, pretension
and mass that are only roughly known by the radii of drums. These are then as kinematics alone have them, each its own,
unless that makes CHECK less probable by more than the effect's form may leave.

Source: Schwarz (1978), Annals of Statistics 6(2), 461-464.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import reduce
from math import inf, log

import numpy as np

from tautwire_fmu.laws.effects import DRUM

from ..errors import UnreachableError
from ..recordings.recording_notes import kinematic_scales
from ..recordings.winch_scales import WinchScale
from ..robot.schema import Robot
from .candidate_scores import setting_of
from .disturbance_fit import joint_fit, marginal_log_likelihood, with_fitted_disturbance
from .hypotheses import (
    PLATFORM_SENSOR_FORMS,
    Hypothesis,
    free_parameters,
    split_by_cable,
    value_of,
    with_values,
)
from .identification_context import IdentificationContext
from .parameter_fit import Fit, Fitter, NoFitError
from .selection_result import SelectionResult
from .time_limit import OutOfTimeError

RADIUS_FORM = ("radius_ratio",)


def with_values_of_cables(
    context: IdentificationContext, selection: SelectionResult
) -> tuple[IdentificationContext, SelectionResult]:
    """The selection with a value for each cable of those effects whose cables differ, and its disturbance's context."""
    for shared in selection.accepted:
        if shared.form not in PLATFORM_SENSOR_FORMS and len(shared.cables) > 1:
            with suppress(UnreachableError, NoFitError):
                context, selection = _with_values_of(context, selection, shared)
    try:
        return _with_kinematic_radii(context, selection)
    except OutOfTimeError:
        context.leave_untried("radii of drums by kinematics")
    except (UnreachableError, NoFitError):
        pass
    return context, selection


def _with_values_of(
    context: IdentificationContext, selection: SelectionResult, shared: Hypothesis
) -> tuple[IdentificationContext, SelectionResult]:
    separate, split = split_by_cable([shared]), context.split
    chosen = [each for old in selection.accepted for each in (separate if old is shared else [old])]
    robot = selection.fit.robot
    fit = context.fitter.fit_from([_separated(robot, shared)], chosen, split.estimation, -inf)
    accepted, evidence = selection.accepted, dict(zip(selection.accepted, selection.evidence, strict=True))
    shared_likelihood = context.fitter.log_likelihood(robot, accepted, split.estimation)
    price = _schwarz_price(context, len(fit.values) - len(selection.fit.values))
    # The disturbance is the best one beside the shared values: to fit it anew adds less than they gain under it.
    if context.fitter.log_likelihood(fit.robot, chosen, split.estimation) - shared_likelihood <= 0.5 * price:
        return context, selection
    fitter = with_fitted_disturbance(context.fitter, fit.robot, chosen, split.estimation)
    fit = fitter.fit_from([fit.robot], chosen, split.estimation, -inf)
    fitter, fit = joint_fit(fitter, fit, chosen, split.estimation)
    gain = fitter.log_likelihood(fit.robot, chosen, split.estimation) - shared_likelihood
    if gain <= price:
        return context, selection
    unseen_gain = _unseen_gain(context, (context.fitter, robot, accepted), (fitter, fit.robot, chosen))
    left_by_form = context.policy.selection.min_cable_evidence_ratio * evidence[shared]
    if gain + unseen_gain <= left_by_form:
        return context, selection
    evidence |= dict.fromkeys(separate, evidence[shared])
    separated = replace(
        selection,
        accepted=tuple(chosen),
        evidence=tuple(evidence[h] for h in chosen),
        fit=fit,
        disturbance=fitter.noise.disturbance,
    )
    return replace(context, fitter=fitter), separated


def _separated(robot: Robot, shared: Hypothesis) -> Robot:
    """The robot with the setting of an effect once for each of its cables."""
    setting = setting_of(robot, shared)
    settings = [replace(setting, cables=(cable,)) for cable in setting.cables]
    effects = [each for old in robot.effects for each in (settings if old is setting else [old])]
    return replace(robot, effects=tuple(effects))


def _unseen_gain(
    context: IdentificationContext,
    before: tuple[Fitter, Robot, Sequence[Hypothesis]],
    after: tuple[Fitter, Robot, Sequence[Hypothesis]],
) -> float:
    """By how much CHECK is more probable under a second model, each beside its best disturbance."""
    calls = [(*model, context.split.validation, False) for model in (before, after)]
    log_likelihoods = dict(context.workers.map_unordered(marginal_log_likelihood, calls))
    return log_likelihoods[1] - log_likelihoods[0]


def _with_kinematic_radii(
    context: IdentificationContext, selection: SelectionResult
) -> tuple[IdentificationContext, SelectionResult]:
    """The selection with the radius of each drum as kinematics alone have it, where no tension was measured.

    Beside the other effects that were selected; none of the drums' radii where kinematics do not tell all of them.
    """
    split, accepted = context.split, selection.accepted
    drums = [hypothesis for hypothesis in accepted if hypothesis.effect is DRUM]
    is_declared = any(setting.name == DRUM.name for setting in context.robot.effects)
    has_tension = any(data.recording.has_tension for data in (split.estimation, split.validation))
    if not drums or is_declared or has_tension:
        return context, selection
    others = tuple(setting for setting in selection.fit.robot.effects if setting.name != DRUM.name)
    counted = split.estimation.first(int(np.sum(split.estimation.rows))).recording
    scales = {scale.cable: scale for scale in kinematic_scales(replace(context.robot, effects=others), counted)}
    if any(drum.form != RADIUS_FORM or not scales.keys() >= set(drum.cables) for drum in drums):
        return context, selection
    evidence = [
        (each, nats)
        for old, nats in zip(accepted, selection.evidence, strict=True)
        for each in ((split_by_cable([old]) or [old]) if old in drums else [old])
    ]
    chosen = tuple(hypothesis for hypothesis, _ in evidence)
    fitter, fit = _fit_beside_radii(context, reduce(_separated, drums, selection.fit.robot), chosen, scales)
    gain = _unseen_gain(context, (context.fitter, selection.fit.robot, accepted), (fitter, fit.robot, chosen))
    of_drums = max(nats for hypothesis, nats in evidence if hypothesis.effect is DRUM)
    if not gain >= -context.policy.selection.min_cable_evidence_ratio * of_drums:
        return context, selection
    kinematic = replace(
        selection,
        accepted=chosen,
        evidence=tuple(nats for _, nats in evidence),
        fit=fit,
        disturbance=fitter.noise.disturbance,
    )
    return replace(context, fitter=fitter), kinematic


def _fit_beside_radii(
    context: IdentificationContext, robot: Robot, chosen: Sequence[Hypothesis], scales: Mapping[int, WinchScale]
) -> tuple[Fitter, Fit]:
    """The disturbance, and the chosen hypotheses, fitted to FIT with the drums' radii held at the winches' scales.

    The covariance of other parameters is that given these radii.
    """
    estimation = context.split.estimation
    free = free_parameters(robot, chosen)
    cables = {each: robot.effects[each.effect_index].cables for each in free}
    radii = {each: scales[cables[each][0]] for each in free if robot.effects[each.effect_index].name == DRUM.name}
    robot = with_values(robot, list(radii), {each: scale.factor for each, scale in radii.items()})
    fitter = with_fitted_disturbance(context.fitter, robot, chosen, estimation)
    others = fitter.fit_from([robot], [h for h in chosen if h.effect is not DRUM], estimation, -inf)
    covariance = np.zeros([len(free)] * 2)
    known = [free.index(each) for each in others.free]
    covariance[np.ix_(known, known)] = others.covariance
    for each, scale in radii.items():
        covariance[free.index(each), free.index(each)] = scale.deviation**2
    values = np.array([value_of(others.robot, each) for each in free])
    return fitter, Fit(others.robot, free, values, covariance)


def _schwarz_price(context: IdentificationContext, parameter_count: int) -> float:
    return 0.5 * parameter_count * log(context.split.estimation.value_count(context.robot.platform.is_rigid_body))
