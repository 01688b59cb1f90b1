"""Result of a selection of effects, and its change by one of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from tautwire_fmu.laws.effects import DAMPING, RELAXATION

from ..robot.schema import Robot
from .candidate_fits import fit_model
from .candidate_scores import setting_of
from .disturbance import Disturbance
from .disturbance_fit import joint_fit, with_fitted_disturbance
from .hypotheses import Hypothesis
from .identification_context import IdentificationContext
from .parameter_fit import Fit
from .policy import SelectionPolicy
from .trace_result import Candidate


@dataclass(frozen=True)
class SelectionResult:
    """Result of a selection: the accepted hypotheses in order, evidence of each, their joint fit, all candidates.

    ``disturbance`` is the one beside them, None where none was assumed.
    """

    accepted: tuple[Hypothesis, ...]
    evidence: tuple[float, ...]
    fit: Fit
    candidates: tuple[Candidate, ...]
    confusable: tuple[tuple[str, ...], ...]
    disturbance: Disturbance | None = None

    def substantial(self, policy: SelectionPolicy) -> tuple[Hypothesis, ...]:
        """The accepted hypotheses with more evidence than what the strongest one's form may leave."""
        least = policy.min_exact_evidence_ratio * max(self.evidence, default=0.0)
        return tuple(h for h, evidence in zip(self.accepted, self.evidence, strict=True) if evidence >= least)


def nothing_selected(robot: Robot) -> SelectionResult:
    """The selection before any search: the robot as it is."""
    return SelectionResult((), (), Fit.without_parameters(robot), (), ())


def with_disturbance_beside(
    context: IdentificationContext, accepted: Sequence[Hypothesis], fit: Fit
) -> tuple[IdentificationContext, Fit]:
    """The context with the disturbance fitted with the accepted hypotheses, and their fit."""
    if not context.fitter.has_disturbance:
        return context, fit
    fitter = with_fitted_disturbance(context.fitter, fit.robot, accepted, context.split.estimation)
    context = replace(context, fitter=fitter)
    fitter, fit = joint_fit(fitter, fit_model(context, accepted, fit.robot), accepted, context.split.estimation)
    return replace(context, fitter=fitter), fit


def with_damping_for_fast_relaxations(
    context: IdentificationContext, accepted: Sequence[Hypothesis], fit: Fit
) -> tuple[IdentificationContext, list[Hypothesis], Fit]:
    """The accepted hypotheses and their fit, with damping for relaxations that the fit made faster than a sample.

    To what is slower, a branch of modulus E and time ``tau`` is a damping of E tau. It is taken where it explains
    validation data as well, within what a coarse fit leaves.
    """
    data = context.split.validation
    sample_interval = float(np.median(np.diff(data.recording.time)))
    for relaxation in (each for each in accepted if each.effect is RELAXATION and each.form == RELAXATION.forms[0]):
        limit, values = Hypothesis(DAMPING, relaxation.cables), setting_of(fit.robot, relaxation).values
        if values["time"] >= sample_interval or any(limit.overlaps(other) for other in accepted):
            continue
        declared = limit.neutral(context.robot, limit.cables).values["damping"]
        damping = limit.setting(context.robot, {"damping": declared + values["modulus"] * values["time"]})
        chosen = [limit if each is relaxation else each for each in accepted]
        beside, own_fit = with_disturbance_beside(
            context, chosen, fit_model(context, chosen, fit.robot.with_effect(damping))
        )
        log_likelihood = context.fitter.log_likelihood(fit.robot, accepted, data)
        loss = log_likelihood - beside.fitter.log_likelihood(own_fit.robot, chosen, data)
        if loss <= context.policy.selection.coarse_tie(log_likelihood):
            return beside, chosen, own_fit
    return context, list(accepted), fit


def without_least_evident(
    context: IdentificationContext, selection: SelectionResult
) -> tuple[IdentificationContext, SelectionResult]:
    """The selection without the effect that has the least evidence, and the others fitted anew."""
    evidence = dict(zip(selection.accepted, selection.evidence, strict=True))
    least = min(selection.accepted, key=lambda hypothesis: evidence[hypothesis]).effect
    kept = [hypothesis for hypothesis in selection.accepted if hypothesis.effect is not least]
    context, fit = with_disturbance_beside(context, kept, fit_model(context, kept, selection.fit.robot))
    fewer = replace(
        selection,
        accepted=tuple(kept),
        evidence=tuple(evidence[hypothesis] for hypothesis in kept),
        fit=fit,
        confusable=tuple(pair for pair in selection.confusable if pair[0] != least.name),
        disturbance=context.fitter.noise.disturbance,
    )
    return context, fewer
