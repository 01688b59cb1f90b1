"""Fault isolation: which component is in question, by which residuals at the measured ports exceed noise."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from .component_residuals import PLATFORM, ComponentResidual, FaultLocalisation

UNDETERMINED = "cannot tell"
NO_COMPONENT = "nothing"


def isolate_fault(
    deviating_by_cable: Mapping[int, bool],
    platform_deviates: bool | None,
    balance_closes: bool = False,
    exit_candidates: Collection[int] = (),
    hidden_candidates: Sequence[str] = (),
) -> str:
    """The component in question, by the pattern of significant residuals.

    ``deviating_by_cable`` tells by number whether the tension of a cable's FMU deviates, without cables that could not
    be evaluated; ``platform_deviates`` whether the platform's balance does, None where it could not be.
    ``balance_closes`` tells that the balance closes with the tensions of those cables' FMUs; ``exit_candidates`` are
    cables whose residual a shifted exit point would explain without showing in the balance, ``hidden_candidates``
    components that may err though no cable's tension deviates.

    ==================== ================ ====================================================
    deviating tensions   platform's force component
    ==================== ================ ====================================================
    none                 as expected      nothing
    none                 deviates         platform, or load cells: a zero, or errors that no cable could show
    of cable i           as expected      cable i (rope or winch): its measured tension is real
    of cable i           deviates, closes load cell i, or friction between it and the platform
    of cable i           deviates         load cell i or exit point i, or several components
    of cable i           not known        cable i (rope, winch, load cell or exit point)
    none                 not known        nothing in these cables, cannot tell more
    not known            not known        cannot tell
    ==================== ================ ====================================================

    Where all of several cables deviate the position sensor is in question as well.
    """
    deviating_cables = [number for number, deviates in deviating_by_cable.items() if deviates]
    if platform_deviates is None:
        return _without_balance(deviating_by_cable, deviating_cables)
    if not deviating_cables:
        return alternatives(hidden_candidates or [PLATFORM]) if platform_deviates else NO_COMPONENT
    position_sensor = ["the position sensor"] if len(deviating_cables) == len(deviating_by_cable) > 1 else []
    if not platform_deviates:
        cable_parts = "rope, winch or exit point" if set(deviating_cables) <= set(exit_candidates) else "rope or winch"
        return alternatives([f"{numbered('cable', deviating_cables)} ({cable_parts})", *position_sensor])
    return _load_cells_in_question(deviating_cables, balance_closes, position_sensor)


def _load_cells_in_question(cables: Sequence[int], balance_closes: bool, position_sensor: Sequence[str]) -> str:
    """The components in question where the tensions of cables and the platform's balance deviate."""
    load_cells = numbered("load cell", cables)
    if balance_closes:
        return alternatives([load_cells, "friction before it" if len(cables) == 1 else "friction before them"])
    return alternatives([load_cells, numbered("exit point", cables), *position_sensor, "several components"])


def isolation_verdict(
    cables: Sequence[ComponentResidual],
    platform: Sequence[ComponentResidual],
    balance_closes: bool = False,
    exit_candidates: Collection[int] = (),
    hidden_candidates: Sequence[str] = (),
) -> tuple[str, str]:
    """The component in question, and the sentence that says why; ``platform`` is empty where it was not evaluated."""
    deviating_by_cable = {part.cable_number: part.is_significant for part in cables}
    faulty_component = isolate_fault(
        deviating_by_cable,
        any(part.is_significant for part in platform) if platform else None,
        balance_closes,
        exit_candidates,
        hidden_candidates,
    )
    facts = [*_cable_facts(cables), *_platform_facts(platform)]
    oscillating = [part for part in platform if part.oscillates]
    if oscillating and not any(deviating_by_cable.values()):
        frequency = max(oscillating, key=lambda part: part.ratio).resonance_frequency
        facts.append(f"it oscillates at {frequency:.2f} Hz, as a swinging load or a shaker does")
    evidence = "; ".join(facts)
    conclusion = {PLATFORM: "the faulty component is the platform", NO_COMPONENT: "no component deviates"}.get(
        faulty_component, f"in question: {faulty_component}"
    )
    return (
        faulty_component,
        f"{evidence[:1].upper()}{evidence[1:]}. {conclusion[:1].upper()}{conclusion[1:]}."
        if evidence
        else _verdict_without_evidence(faulty_component),
    )


def reconciled_with_effects(
    localisation: FaultLocalisation, effects: Sequence[tuple[str, Sequence[int]]]
) -> FaultLocalisation:
    """The localisation with a conclusion that agrees with the effects found: names with cables, none for the platform.

    A component alone shows less than all outputs together, so an effect of several cables may stand out at one of them.
    """
    cables = sorted({cable for _, of_effect in effects for cable in of_effect})
    deviating = [part.cable_number for part in localisation.residuals if part.is_significant]
    at_cables = [number for number in deviating if number]
    if not effects or not localisation.residuals:
        return localisation
    if at_cables and set(at_cables) < set(cables):
        names = list(dict.fromkeys(name for name, of_effect in effects if of_effect))
        verbs = "acts on them and shows" if len(names) == 1 else "act on them and show"
        component = f"{numbered('cable', cables)}, most of all {numbered('cable', at_cables)}"
        evidence = localisation.sentence.rpartition(". ")[0]
        sentence = f"{evidence}. In question: {component}; {' and '.join(names)} {verbs} at none of the others alone."
        return replace(localisation, faulty_component=component, sentence=sentence)
    is_elsewhere = bool(at_cables) != bool(cables) and "load cell" not in localisation.faulty_component
    if not deviating or is_elsewhere:
        names = list(dict.fromkeys(name for name, _ in effects))
        addition = f"That the model lacks {' and '.join(names)} is told by all outputs together, not by one component."
        return replace(localisation, sentence=f"{localisation.sentence} {addition}")
    return localisation


def _verdict_without_evidence(faulty_component: str) -> str:
    return f"{faulty_component[:1].upper()}{faulty_component[1:]} which component is faulty."


def _cable_facts(cables: Sequence[ComponentResidual]) -> list[str]:
    deviating = [part for part in cables if part.is_significant]
    if not deviating:
        subject = "the cables' tensions deviate" if len(cables) > 1 else "the cable's tension deviates"
        return [f"{subject} no more than expected"] if cables else []
    if len(deviating) == 1:
        return [f"{deviating[0].component}'s tension deviates {_deviation_text(deviating[0])}"]
    worst = max(deviating, key=lambda part: part.ratio)
    numbers = numbered("cable", [part.cable_number for part in deviating])
    return [f"the tensions of {numbers} deviate, that of {worst.component} most, {_deviation_text(worst)}"]


def _platform_facts(platform: Sequence[ComponentResidual]) -> list[str]:
    if not platform:
        return []
    worst = max(platform, key=lambda part: part.ratio)
    if not worst.is_significant:
        return ["the platform's force balance closes as expected"]
    return [f"the platform's {worst.quantity} deviates {_deviation_text(worst)}"]


def _deviation_text(part: ComponentResidual) -> str:
    mean = f", {_two_digits(part.mean)} {part.unit} in the mean" if part.is_constant else ""
    return f"by {_two_digits(part.rms)} {part.unit} rms{mean} (expected {_two_digits(part.expected_rms)} {part.unit})"


def _two_digits(value: float) -> str:
    """Two significant digits, without an exponent."""
    return f"{value:.0f}" if abs(value) >= 10.0 else f"{value:.2g}"


def _without_balance(deviating_by_cable: Mapping[int, bool], deviating_cables: Sequence[int]) -> str:
    if deviating_cables:
        return f"{numbered('cable', deviating_cables)} (rope, winch, load cell or exit point)"
    if deviating_by_cable:
        return f"nothing in {numbered('cable', list(deviating_by_cable))}; {UNDETERMINED} more"
    return UNDETERMINED


def numbered(noun: str, numbers: Sequence[int]) -> str:
    """As in "cable 2" and "cables 1, 3"."""
    return f"{noun}{'s' if len(numbers) > 1 else ''} {', '.join(map(str, numbers))}"


def alternatives(names: Sequence[str]) -> str:
    """As in "a", "a or b" and "a; b or c" where names have commas of their own."""
    *before, last = names
    return f"{'; '.join(before)} or {last}" if before else last
