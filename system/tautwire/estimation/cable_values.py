"""Values of single cables in place of those that an effect's cables share.

Names are established on unseen data. How many numbers a named effect has is less: cables get one each where the
likelihood of FIT is worth these by Schwarz's criterion, half a log of the number of values N for each of k numbers, and
FIT and CHECK together, the latter at the values of FIT, gain more than the effect's form may leave, a share of its
evidence.

    log L(each its own) - log L(shared) > k/2 log N on FIT, and > share evidence on both

Both are taken beside the best disturbance of each recording.

Source: Schwarz (1978), Annals of Statistics 6(2), 461-464.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from math import inf, log

from ..errors import UnreachableError
from .candidate_scores import setting_of
from .disturbance_fit import joint_fit, marginal_log_likelihood, with_fitted_disturbance
from .hypotheses import PLATFORM_SENSOR_FORMS, Hypothesis, split_by_cable
from .identification_context import IdentificationContext
from .parameter_fit import NoFitError
from .selection_result import SelectionResult


def with_values_of_cables(
    context: IdentificationContext, selection: SelectionResult
) -> tuple[IdentificationContext, SelectionResult]:
    """The selection with a value for each cable of those effects whose cables differ, and its disturbance's context."""
    for shared in selection.accepted:
        if shared.form not in PLATFORM_SENSOR_FORMS and len(shared.cables) > 1:
            with suppress(UnreachableError, NoFitError):
                context, selection = _with_values_of(context, selection, shared)
    return context, selection


def _with_values_of(
    context: IdentificationContext, selection: SelectionResult, shared: Hypothesis
) -> tuple[IdentificationContext, SelectionResult]:
    separate, split = split_by_cable([shared]), context.split
    chosen = [each for old in selection.accepted for each in (separate if old is shared else [old])]
    robot, setting = selection.fit.robot, setting_of(selection.fit.robot, shared)
    settings = [replace(setting, cables=hypothesis.cables) for hypothesis in separate]
    effects = [each for old in robot.effects for each in (settings if old is setting else [old])]
    fit = context.fitter.fit_from([replace(robot, effects=tuple(effects))], chosen, split.estimation, -inf)
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
    models = [(context.fitter, robot, accepted), (fitter, fit.robot, chosen)]
    calls = [(*model, split.validation, False) for model in models]
    unseen = dict(context.workers.map_unordered(marginal_log_likelihood, calls))
    unseen_gain = unseen[1] - unseen[0]
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


def _schwarz_price(context: IdentificationContext, parameter_count: int) -> float:
    return 0.5 * parameter_count * log(context.split.estimation.value_count(context.robot.platform.is_rigid_body))
