"""Verdict of an identification: what the model lacks, in a word, a sentence and a formula."""

from __future__ import annotations

from tautwire_fmu.laws.effects import UNLISTED

from ..robot.schema import Robot
from .candidate_scores import setting_of
from .discovery.candidate_terms import effects_text, formula_text
from .discovery.formula_discovery import Discovery
from .hypotheses import Hypothesis
from .stepwise_selection import SelectionResult
from .trace_result import Verdict

IS_WHITE = "the residual is white noise"


def verdict_of(
    robot: Robot, selection: SelectionResult, effects_hold: bool, discovery: Discovery | None, white_before: bool
) -> tuple[Verdict, str]:
    """Verdict and its sentence on a declared robot, whose residual was white ``white_before``.

    ``effects_hold`` tells whether the FMUs confirm the selection; ``discovery`` is a formula that they confirm.
    """
    names = " and ".join(h.label(robot) for h in selection.accepted)
    lacks = f"The model lacks {names}; with {'it' if len(selection.accepted) == 1 else 'them'}, {IS_WHITE}."
    formula = confirmed_formula(robot, selection, effects_hold, discovery)
    if effects_hold and formula:
        return "discovered", f"{lacks} This effect is not on the list of known ones: {formula}."
    if effects_hold:
        return "effects", lacks
    if discovery:
        sentence = f"No known effect explains the residual; a formula does: {formula}."
        return "discovered", f"{sentence} With it, {IS_WHITE}."
    if not selection.accepted and white_before:
        return "none", f"{IS_WHITE.capitalize()}: this recording shows nothing that the model lacks."
    # Either the filter or the FMUs refused the selection: what it leaves is not always coloured.
    verb = "comes" if len(selection.accepted) == 1 else "come"
    closest = f"; {names} {verb} closest, but not close enough" if selection.accepted else ""
    return "unexplained", f"The residual is not white noise, and no known effect explains it{closest}."


def confirmed_formula(
    robot: Robot, selection: SelectionResult, effects_hold: bool, discovery: Discovery | None
) -> str | None:
    """Formula of what is not on the list; None where there is none."""
    if discovery:
        return formula_text(robot, discovery.formulas)
    unlisted = _unlisted_hypotheses(selection) if effects_hold else []
    return effects_text([(h.label(robot), setting_of(selection.fit.robot, h)) for h in unlisted]) or None


def _unlisted_hypotheses(selection: SelectionResult) -> list[Hypothesis]:
    """Accepted effects that are not on the list."""
    return [hypothesis for hypothesis in selection.accepted if hypothesis.effect in UNLISTED]
