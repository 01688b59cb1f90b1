"""Verdict of an identification: what the model lacks, in a word, a sentence and a formula."""

from __future__ import annotations

from collections.abc import Sequence

from tautwire_fmu.laws.effects import UNLISTED

from ..robot.schema import Robot
from ..robot.uncertain_parameters import uncertain_parameters
from .candidate_scores import setting_of
from .discovery.candidate_terms import effects_text, formula_text
from .discovery.formula_discovery import Discovery
from .disturbance_posterior import reference_weight
from .explained_shares import ExplainedShares
from .hypotheses import Hypothesis, labels_by_effect
from .identification_context import IdentificationContext
from .selection_result import SelectionResult
from .time_limit import TimeLimit
from .trace_result import Verdict

IS_WHITE = "the residual is white noise"


def verdict_of(
    robot: Robot,
    selection: SelectionResult,
    substantial: Sequence[Hypothesis],
    effects_hold: bool,
    discovery: Discovery | None,
    white_before: bool,
) -> tuple[Verdict, str]:
    """Verdict and its sentence on a declared robot, whose residual was white ``white_before``.

    ``substantial`` are the accepted hypotheses that matter; ``effects_hold`` tells whether the FMUs confirm the
    selection; ``discovery`` is a formula that they confirm.
    """
    names = " and ".join(hypothesis.label(robot) for hypothesis in selection.accepted)
    lacking = " and ".join(hypothesis.label(robot) for hypothesis in substantial)
    small = [hypothesis.label(robot) for hypothesis in selection.accepted if hypothesis not in substantial]
    with_small = f" and {_sum_up(small)}, too small to matter" if small else ""
    pronoun = "it" if len(substantial) == 1 else "them"
    lacks = f"The model lacks {lacking}; with {pronoun}{with_small}, {IS_WHITE}."
    if effects_hold:
        evidence = dict(zip(selection.accepted, selection.evidence, strict=True))
        largest_first = sorted(substantial, key=lambda hypothesis: -evidence[hypothesis])
        return _verdict_by_largest(robot, selection, largest_first, lacks)
    if discovery:
        sentence = f"No known effect explains the residual; a formula does: {formula_text(robot, discovery.formulas)}."
        return "discovered", f"{sentence} With it, {IS_WHITE}."
    if not selection.accepted and white_before:
        return "none", f"{IS_WHITE.capitalize()}: nothing that the model lacks is visible in this recording."
    # Either the filter or the FMUs refused the selection: what it leaves is not always coloured.
    verb = "comes" if len(selection.accepted) == 1 else "come"
    closest = f"; {names} {verb} closest, but not close enough" if selection.accepted else ""
    return "unexplained", f"The residual is not white noise, and no known effect explains it{closest}."


def verdict_beside_disturbance(
    context: IdentificationContext,
    selection: SelectionResult,
    shares: ExplainedShares,
    missed: str,
    remaining: str,
    has_resonance: bool = False,
) -> tuple[Verdict, str]:
    """Verdict and its sentence beside a disturbance.

    ``missed`` says in words what the declared robot's error is, ``remaining`` what remains of it with the effects;
    ``has_resonance`` tells whether the recordings show an oscillator that the model lacks.
    """
    policy, accepted = context.policy.size, selection.accepted
    large, labels = shares.substantial(policy), labels_by_effect(accepted, context.robot)
    names = list(dict.fromkeys(labels))
    is_explained = shares.explains(policy)
    is_little = shares.size_missed <= policy.max_size_of_disturbance
    if not is_explained and (is_little or (not has_resonance and _is_small_disturbance(context, shares))):
        small = f" {_sum_up(names).capitalize()} may act, too small to matter." if names else ""
        sentence = f"What the model misses lies within stated uncertainties, noise and a small random force: {missed}."
        return "none", sentence + small
    is_disturbance = shares.size_left <= policy.max_size_of_disturbance
    if large and (is_disturbance or is_explained):
        share_of = {labels[index]: shares.effects[index] for index in large}
        named = _sum_up([f"{name} ({_per_cent(share)} of what is missed)" for name, share in share_of.items()])
        noise = f"{policy.max_size_of_disturbance:g} standard deviations of one sample's noise"
        kind = f", in all no more than {noise}" if is_disturbance else ""
        others = shares.explained - max(shares.effects)
        is_stated = len(names) == 1 and others >= policy.min_share and uncertain_parameters(context.robot)
        uncertain = f"{_per_cent(others)} lies within stated uncertainties, and " if is_stated else ""
        lacks = f"The model lacks {named}; {uncertain}{_per_cent(shares.left)} remains{kind}."
        sentence = f"{lacks} The error is then {remaining}."
        return _verdict_by_largest(context.robot, selection, [accepted[index] for index in large], sentence)
    varies = ""
    if len(shares.steady(policy)) < len(accepted):
        varies = ", which would have to change from stretch to stretch"
    elif len(shares.uncancelled(policy)) < len(accepted):
        varies = ", which would nearly cancel each other"
    elif len(shares.timed(policy)) < len(accepted):
        varies = ", whose time constant these recordings do not determine"
    closest = f" Of it {_per_cent(shares.explained)} would go to {_sum_up(names)}{varies}." if names else ""
    return "unexplained", f"No known effect explains a substantial share of the residual: {missed}.{closest}"


def _is_small_disturbance(context: IdentificationContext, shares: ExplainedShares) -> bool:
    """Whether a disturbance of usual size, and not the effects beside it, takes up what is missed."""
    policy, noise, robot = context.policy.size, context.fitter.noise, context.robot
    disturbance = noise.disturbance
    if disturbance is None or shares.explained >= policy.min_explained_share:
        return False
    errors = [disturbance.position.rms / noise.position, disturbance.tension.rms / noise.tension]
    if disturbance.rotation and noise.rotation:
        errors.append(disturbance.rotation.rms / noise.rotation)
    is_small_force = disturbance.force.rms <= policy.max_force_to_weight * reference_weight(robot)
    return is_small_force and max(errors) <= policy.max_sensor_error


def verdict_of_ended_search(
    verdict: tuple[Verdict, str], limit: TimeLimit, is_little_missed: bool = False
) -> tuple[Verdict, str]:
    """The verdict of a search that had to leave something untried.

    Never that nothing is missing, but for where ``is_little_missed``: after each effect was tried by itself what is
    missed beside a disturbance is little, whatever would have been tried next.
    """
    word, sentence = verdict
    if not limit.untried:
        return verdict
    ended = f"The search ended at its time limit of {limit.seconds:g} s"
    if word == "none" and not is_little_missed:
        return "unexplained", f"{ended}; until then nothing was found that the model lacks."
    if word == "unexplained":
        return "unexplained", f"{ended}. Until then: {sentence[0].lower()}{sentence[1:]}"
    return word, f"{sentence} {ended}, before all was tried."


def _verdict_by_largest(
    robot: Robot, selection: SelectionResult, largest_first: Sequence[Hypothesis], sentence: str
) -> tuple[Verdict, str]:
    """Verdict ``discovered`` where the largest effect is not on the list; the sentence tells those that are not."""
    unlisted = _unlisted(largest_first)
    if not unlisted:
        return "effects", sentence
    formula = _formula_of(robot, selection, unlisted)
    word: Verdict = "discovered" if largest_first[0] in unlisted else "effects"
    return word, f"{sentence} This effect is not on the list of known ones: {formula}."


def _per_cent(share: float) -> str:
    """A share in words, never as none or all of it where it is not."""
    if 0.0 < share < 0.005:
        return "less than 1 %"
    return "more than 99 %" if 0.995 <= share < 1.0 else f"{100.0 * share:.0f} %"


def _sum_up(names: Sequence[str]) -> str:
    """Names as a list in words."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def confirmed_formula(
    robot: Robot, selection: SelectionResult, effects_hold: bool, discovery: Discovery | None
) -> str | None:
    """Formula of what is not on the list; None where there is none."""
    if discovery:
        return formula_text(robot, discovery.formulas)
    unlisted = _unlisted(selection.accepted) if effects_hold else []
    return _formula_of(robot, selection, unlisted) or None


def _unlisted(accepted: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Those of some accepted effects that are not on the list."""
    return [hypothesis for hypothesis in accepted if hypothesis.effect in UNLISTED]


def _formula_of(robot: Robot, selection: SelectionResult, unlisted: Sequence[Hypothesis]) -> str:
    return effects_text([(h.label(robot), setting_of(selection.fit.robot, h)) for h in unlisted])
