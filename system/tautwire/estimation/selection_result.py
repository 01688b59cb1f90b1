"""Result of a selection of effects, and its change by one of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ..robot.schema import Robot
from .candidate_fits import fit_model
from .disturbance import Disturbance
from .disturbance_fit import joint_fit, with_fitted_disturbance
from .estimation_data import DataSplit
from .hypotheses import Hypothesis
from .identification_context import IdentificationContext
from .parameter_fit import Fit
from .policy import SelectionPolicy
from .trace_result import Candidate


@dataclass(frozen=True)
class SelectionResult:
    """Result of a selection: the accepted hypotheses in order, evidence of each, their joint fit, all candidates.

    ``disturbance`` is the one beside them, None where none was assumed; ``split`` are the data with winch speeds
    interpolated otherwise than those that the search began with, where these are likelier. ``has_tried_each`` tells
    whether there was time to try each effect by itself.
    """

    accepted: tuple[Hypothesis, ...]
    evidence: tuple[float, ...]
    fit: Fit
    candidates: tuple[Candidate, ...]
    confusable: tuple[tuple[str, ...], ...]
    disturbance: Disturbance | None = None
    split: DataSplit | None = None
    has_tried_each: bool = False

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
