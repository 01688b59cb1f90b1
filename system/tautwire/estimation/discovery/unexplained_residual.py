"""Analysis of a residual that no known effect explains: an accepted formula, or the resonances that it shows."""

from __future__ import annotations

from dataclasses import dataclass

from ..disturbance_posterior import disturbance_prior
from ..explained_shares import ExplainedShares
from ..identification_context import IdentificationContext, no_progress
from ..selection_result import SelectionResult
from ..trace_result import Resonance
from .candidate_terms import formula_text
from .formula_discovery import Discovery, discover_formula
from .hidden_resonances import find_resonances
from .policy import FormulaPolicy

NOT_TRIED = "formulas and hidden oscillators were not tried: that is done for point masses only"


@dataclass(frozen=True)
class UnexplainedResidual:
    """Result of the analysis: an accepted ``discovery`` to be tried in the FMUs, hidden resonances, and notes."""

    discovery: Discovery | None = None
    resonances: tuple[Resonance, ...] = ()
    notes: tuple[str, ...] = ()


def explain_residual(context: IdentificationContext, selection: SelectionResult) -> UnexplainedResidual:
    """Analyse the residual of a robot that known effects do not explain; ``selection`` are those that come closest.

    Of a platform that turns nothing is analysed, and a note says so.
    """
    if context.robot.platform.is_rigid_body:
        return UnexplainedResidual(notes=(NOT_TRIED,))
    robot, fitter, evidence, workers = context.robot, context.fitter, context.split, context.workers
    policy = context.policy.discovery
    beside = (selection.fit.robot, selection.accepted, fitter, evidence)
    runs_in_parallel = selection.accepted and workers.processes > 1
    pending = workers.submit(discover_formula, *beside, no_progress, policy) if runs_in_parallel else None
    threshold = context.evidence_threshold(others=1)
    formula = _if_accepted(
        discover_formula(robot, (), fitter, evidence, context.progress, policy), threshold, policy.formulas
    )
    if formula is not None and formula.residuals_are_white:
        return UnexplainedResidual(formula)
    # Effects that only come closest may have absorbed the resonance.
    lines = find_resonances(selection.fit.robot, fitter, evidence, policy.resonances)
    if not lines and selection.accepted:
        lines = find_resonances(robot, fitter, evidence, policy.resonances)
    notes = [line.sentence for line in lines]
    if formula is not None:
        description = formula_text(robot, formula.formulas)
        notes.append(f"a formula explains only part of the residual: {description}")
    if pending is not None:
        context.progress("searching for a formula beside effects", 0.0)
        joint_formula = pending.result()
    else:
        joint_formula = discover_formula(*beside, context.progress, policy) if selection.accepted else None
    joint_formula = _if_accepted(joint_formula, threshold, policy.formulas)
    if joint_formula is not None and joint_formula.residuals_are_white:
        names = " and ".join(hypothesis.label(robot) for hypothesis in selection.accepted)
        description = formula_text(robot, joint_formula.formulas)
        notes.append(
            f"with {names} and a formula the residual is white noise, but either may stand for another cause: "
            f"{description}"
        )
    return UnexplainedResidual(None, lines, tuple(notes))


def resonances_beside_disturbance(context: IdentificationContext, shares: ExplainedShares) -> UnexplainedResidual:
    """Hidden resonances where much is missed and effects explain little of it.

    Under the usual disturbance: the fitted one has taken up the oscillation.
    """
    size = context.policy.size
    is_little = shares.size_missed <= size.max_size_of_disturbance
    if is_little or shares.explained >= size.min_explained_share or context.robot.platform.is_rigid_body:
        return UnexplainedResidual()
    context.progress("hidden oscillators", 0.0)
    prior = disturbance_prior(context.robot, context.fitter.noise, context.policy.fit.disturbance)
    usual = context.fitter.with_disturbance(prior.median)
    lines = find_resonances(context.robot, usual, context.split, context.policy.discovery.resonances)
    return UnexplainedResidual(resonances=lines, notes=tuple(line.sentence for line in lines))


def _if_accepted(discovery: Discovery | None, threshold: float, policy: FormulaPolicy) -> Discovery | None:
    return discovery if discovery is not None and discovery.is_accepted(threshold, policy) else None
