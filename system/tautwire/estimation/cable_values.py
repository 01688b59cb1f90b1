"""Values of single cables in place of those that an effect's cables share.

Names are established on unseen data. How many numbers a named effect has is less: cables get one each where the
likelihood of FIT is worth these by Schwarz's criterion, half a log of the number of values N for each of k numbers, and
more than the effect's form may leave, a share of its evidence; and where CHECK does not speak against it.

    log L(each its own) - log L(shared) > max(k/2 log N, share evidence)

Source: Schwarz (1978), Annals of Statistics 6(2), 461-464.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf, log

import numpy as np

from ..errors import UnreachableError
from .candidate_scores import setting_of
from .hypotheses import PLATFORM_SENSOR_FORMS, Hypothesis, split_by_cable
from .identification_context import IdentificationContext
from .parameter_fit import Fit, NoFitError
from .stepwise_selection import SelectionResult


def with_values_of_cables(context: IdentificationContext, selection: SelectionResult) -> SelectionResult:
    """The selection with a value for each cable of those effects whose cables differ."""
    for shared in selection.accepted:
        if shared.form not in PLATFORM_SENSOR_FORMS and len(shared.cables) > 1:
            selection = _with_values_of(context, selection, shared)
    return selection


def _with_values_of(context: IdentificationContext, selection: SelectionResult, shared: Hypothesis) -> SelectionResult:
    separate = split_by_cable([shared])
    chosen = [each for old in selection.accepted for each in (separate if old is shared else [old])]
    robot, setting = selection.fit.robot, setting_of(selection.fit.robot, shared)
    settings = [replace(setting, cables=hypothesis.cables) for hypothesis in separate]
    effects = [each for old in robot.effects for each in (settings if old is setting else [old])]
    robot = replace(robot, effects=tuple(effects))
    try:
        fit = context.fitter.fit_from([robot], chosen, context.split.estimation, -inf)
        gain, unseen_gain = _gains(context, selection, fit, chosen)
    except (UnreachableError, NoFitError):
        return selection
    evidence = dict(zip(selection.accepted, selection.evidence, strict=True))
    price = _schwarz_price(context, len(fit.values) - len(selection.fit.values))
    policy = context.policy.selection
    if gain <= max(price, policy.min_evidence_ratio * evidence[shared]) or unseen_gain < -policy.tie_nats:
        return selection
    evidence |= dict.fromkeys(separate, evidence[shared])
    return replace(selection, accepted=tuple(chosen), evidence=tuple(evidence[h] for h in chosen), fit=fit)


def _gains(
    context: IdentificationContext, selection: SelectionResult, fit: Fit, chosen: Sequence[Hypothesis]
) -> tuple[float, float]:
    """Gains of log-likelihood by a fit over the selection's, on estimation and on validation data."""
    fitter, split = context.fitter, context.split
    gain, unseen_gain = (
        fitter.log_likelihood(fit.robot, chosen, data)
        - fitter.log_likelihood(selection.fit.robot, selection.accepted, data)
        for data in (split.estimation, split.validation)
    )
    return gain, unseen_gain


def _schwarz_price(context: IdentificationContext, parameter_count: int) -> float:
    data = context.split.estimation
    value_count = int(np.count_nonzero(np.isfinite(data.recording.measured()[data.rows])))
    return 0.5 * parameter_count * log(value_count)
