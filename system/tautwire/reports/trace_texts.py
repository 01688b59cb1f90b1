"""Texts and numbers about a trace that the terminal and the page share: error comparisons, shares, names."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from tautwire_fmu.laws.effects import BY_NAME

from ..estimation.hypotheses import hypotheses
from ..estimation.trace_result import Candidate, Comparison, Detectable, Errors, Estimate, FoundEffect, Trace
from ..number_format import ABSENT_TEXT, digits_beside, format_engineering, format_in_common_unit, format_significant
from ..robot.schema import AXES, Robot

ROLES = ("fit", "check")
VERDICTS = {
    "effects": "Effect found",
    "none": "Nothing is visible",
    "discovered": "New effect, formula found",
    "unexplained": "Not explained",
}
MILLIMETRES_PER_METRE = 1e3
MILLIRADIANS_PER_RADIAN = 1e3
# An error below this multiple of the noise floor leaves nothing for a model to explain.
NOISE_FLOOR_MARGIN = 1.05
MAX_VALUES_IN_HEADLINE = 2


@dataclass(frozen=True)
class MeasuredOutput:
    """A measured output or a total: ``scale`` converts SI to ``unit``; ``errors_key`` locates it in Errors."""

    label: str
    unit: str
    scale: float
    errors_key: tuple[str, int | None]

    def error_of(self, errors: Errors | None) -> float:
        """The root mean square error in ``unit``; NaN where nothing was measured."""
        if errors is None:
            return math.nan
        name, index = self.errors_key
        field = getattr(errors, name)
        if index is not None and index >= len(field):
            return math.nan
        return self.scale * float(field if index is None else field[index])


POSITION = MeasuredOutput("position", "mm", MILLIMETRES_PER_METRE, ("position_rms", None))
TENSION = MeasuredOutput("tension", "N", 1.0, ("tension_rms", None))
ORIENTATION = MeasuredOutput("orientation", "mrad", MILLIRADIANS_PER_RADIAN, ("orientation_rms", None))


def axis_outputs() -> list[MeasuredOutput]:
    """One output for each axis."""
    return [MeasuredOutput(axis, "mm", MILLIMETRES_PER_METRE, ("axes", index)) for index, axis in enumerate(AXES)]


def cable_outputs(cable_count: int) -> list[MeasuredOutput]:
    """One output for each cable."""
    return [MeasuredOutput(f"cable {index + 1}", "N", 1.0, ("cables", index)) for index in range(cable_count)]


def rotation_outputs(robot: Robot) -> list[MeasuredOutput]:
    """One output for each axis about which a platform turns; none for a point mass."""
    return [
        MeasuredOutput(f"about {axis}", "mrad", MILLIRADIANS_PER_RADIAN, ("rotations", index))
        for index, axis in enumerate(AXES)
        if robot.platform.is_rigid_body
    ]


def output_groups(robot: Robot) -> list[tuple[MeasuredOutput, list[MeasuredOutput]]]:
    """Totals, each with its outputs: positions, tensions, and where the platform turns its orientation."""
    groups = [(POSITION, axis_outputs()), (TENSION, cable_outputs(robot.cable_count))]
    return [*groups, *([(ORIENTATION, rotation_outputs(robot))] if robot.platform.is_rigid_body else [])]


def comparison_by_role(trace: Trace, role: str) -> Comparison | None:
    """The comparison with the recording of a role; None where there is no such recording."""
    return next((each for each in trace.comparisons if each.role == role), None)


def explained_share(before: float, after: float, floor: float) -> float | None:
    """Share of the mean square error above the noise floor that the model explains; None where there was none."""
    if not math.isfinite(before) or not math.isfinite(after):
        return None
    noise = floor if math.isfinite(floor) else 0.0
    if before <= NOISE_FLOOR_MARGIN * noise or before == 0.0:
        return None
    return min(1.0, (before**2 - after**2) / (before**2 - noise**2))


def cables_text(cables: Sequence[int], cable_count: int) -> str:
    """Cable numbers as text: "all cables", "cable 2", "cables 1, 3"; a dash for none."""
    if not cables:
        return "-"
    if len(cables) == cable_count:
        return "all cables"
    return f"cable{'s' if len(cables) > 1 else ''} {', '.join(str(cable) for cable in cables)}"


def parameter_unit(effect: str, parameter: str) -> str:
    """The unit of an effect's parameter; empty where the effect or parameter is unknown."""
    effect_definition = BY_NAME.get(effect)
    units = {each.name: each.unit for each in effect_definition.parameters} if effect_definition else {}
    return units.get(parameter, "")


def values_text(effect: str, values: Mapping[str, float]) -> str:
    """Parameter values of an effect on one line, as in "damping 2.10 GPa s".

    Of a ratio near 1, or another value near its neutral one, three digits of the difference are shown.
    """
    definition = BY_NAME.get(effect)
    neutral = {each.name: each.neutral for each in definition.parameters} if definition else {}
    texts = [
        format_engineering(value, parameter_unit(effect, name), digits_beside(value, neutral.get(name)))
        for name, value in values.items()
    ]
    return ", ".join(f"{name} {text}" for name, text in zip(values, texts, strict=True))


@dataclass(frozen=True)
class EstimateText:
    """A formatted estimate: one unit for all numbers, as many decimals as its interval justifies."""

    value: str
    low: str
    high: str
    declared: str
    unit: str


def format_estimate(estimate: Estimate) -> EstimateText:
    """Formats an estimate with its interval and declared value."""
    numbers = (estimate.value, estimate.low, estimate.high, estimate.declared)
    texts, unit = format_in_common_unit(numbers, estimate.unit, (estimate.high - estimate.low) / 2.0)
    value, low, high, declared = texts
    return EstimateText(value, low, high, declared, unit)


def headline(trace: Trace) -> str:
    """The verdict's sentence, and behind it the fitted values of the largest effect with their 95 % intervals."""
    if not trace.effects or trace.verdict not in ("effects", "discovered"):
        return trace.sentence
    largest = max(trace.effects, key=lambda each: (each.share or 0.0, each.evidence))
    cables = f" ({cables_text(largest.cables, trace.robot_before.cable_count)})" if largest.cables else ""
    values = []
    for name, estimate in largest.parameters.items():
        text = format_estimate(estimate)
        values.append(f"{name} {text.value} {text.unit}".rstrip() + f" (95 % interval {_interval_text(text)})")
    hidden_count = len(values) - MAX_VALUES_IN_HEADLINE
    more = f" and {hidden_count} more" if hidden_count > 0 else ""
    return f"{trace.sentence} Fitted {largest.name}{cables}: {', '.join(values[:MAX_VALUES_IN_HEADLINE])}{more}."


def _interval_text(text: EstimateText) -> str:
    """An interval in words; of an open end it names the other."""
    if text.low == ABSENT_TEXT:
        return "unbounded" if text.high == ABSENT_TEXT else f"up to {text.high}"
    return f"from {text.low}" if text.high == ABSENT_TEXT else f"{text.low} to {text.high}"


def candidates_by_round(candidates: Sequence[Candidate]) -> list[tuple[int, list[Candidate]]]:
    """Rounds of the search in order, each with its candidates by descending evidence."""

    def sort_key(candidate: Candidate) -> tuple[int, float, str, tuple[int, ...]]:
        evidence = candidate.evidence if math.isfinite(candidate.evidence) else -math.inf
        return (candidate.round, -evidence, candidate.name, candidate.cables)

    ordered = sorted(candidates, key=sort_key)
    return [(number, list(group)) for number, group in groupby(ordered, key=lambda each: each.round)]


def runners_up(trace: Trace) -> list[str]:
    """The best other effect of the round that took each effect: "damping: modulus, all cables: 64.2 of 812.4".

    Both numbers are evidence of that round, in nats. Without effects whose round is not known, or has no fitted rival.
    """
    lines = []
    for effect in trace.effects:
        taken = next((each for each in trace.candidates if _is_taken_as(each, effect)), None)
        fitted = [each for each in trace.candidates if taken and each.round == taken.round and each.name != effect.name]
        best = max(
            (each for each in fitted if math.isfinite(each.evidence)), key=lambda each: each.evidence, default=None
        )
        if taken and best:
            cables = f", {cables_text(best.cables, trace.robot_before.cable_count)}" if best.cables else ""
            evidence = f"{format_evidence(best.evidence)} of {format_evidence(taken.evidence)}"
            lines.append(f"{effect.name}: {best.name}{cables}: {evidence}")
    return lines


def _is_taken_as(candidate: Candidate, effect: FoundEffect) -> bool:
    return candidate.accepted and candidate.name == effect.name and set(effect.cables) <= set(candidate.cables)


def candidate_status(candidate: Candidate, of_round: Sequence[Candidate]) -> str:
    """Why a fitted candidate was taken in its round or not, in a few words; blank where that is not known."""
    if candidate.accepted:
        return "taken"
    required = candidate.required_evidence
    if required is not None and candidate.evidence <= required:
        return f"needs {required:.0f}"
    accepted = next((each for each in of_round if each.accepted), None)
    if accepted is None:
        return ""
    return "weaker" if candidate.evidence <= accepted.evidence else "less simple"


def detectable_texts(trace: Trace) -> list[str]:
    """Smallest sizes that would have been detected, as in "payload: mass 1.2 kg"; where cables differ, on any."""
    largest: dict[tuple[str, str], Detectable] = {}
    for each in trace.identifiability.detectable:
        known = largest.setdefault((each.name, each.parameter), each)
        if known.size < each.size:
            largest[each.name, each.parameter] = each
    return [
        f"{each.name}: {each.parameter} {format_engineering(each.size, each.unit)}"
        for each in largest.values()
        if math.isfinite(each.size)
    ]


def undetectable_effects(trace: Trace) -> list[str]:
    """Effects of which these recordings would have shown no size."""
    sizes: dict[str, list[float]] = {}
    for each in trace.identifiability.detectable:
        sizes.setdefault(each.name, []).append(each.size)
    return [name for name, of_effect in sizes.items() if not any(map(math.isfinite, of_effect))]


def alternative_texts(trace: Trace) -> list[str]:
    """What the data cannot tell from the effects, as in "pulley in place of sensor_offset"."""
    # Unlisted effects, whose formula is the answer, are in the robot alone.
    found = {setting.name for setting in trace.robot_after.effects if setting not in trace.robot_before.effects}
    texts = []
    for names in trace.also_possible:
        replaced, others = [n for n in names if n in found], [n for n in names if n not in found]
        texts.append(
            " + ".join(others or names) + (f" in place of {' + '.join(replaced)}" if replaced and others else "")
        )
    return texts


def separating_commands(trace: Trace) -> list[str]:
    """Commands that design a motion for effects that these recordings cannot tell apart, one for each set of them."""
    robot, found = trace.robot_before, [effect.name for effect in trace.effects]
    designable = {each.effect.name for each in hypotheses(robot) if each.cables in ((), robot.cable_numbers)}
    sets = [dict.fromkeys(names if set(names) & set(found) else (*found, *names)) for names in trace.also_possible]
    lists = dict.fromkeys(",".join(names) for names in sets if len(names) > 1 and set(names) <= designable)
    return [f"tautwire excite robot.toml --effects {names} --out program.csv" for names in lists]


def noise_sentence(trace: Trace) -> str:
    """Whether the residual is white noise, before and after, or what was assumed beside it, in one sentence."""
    if trace.disturbance:
        force = format_engineering(trace.disturbance.force.rms, "N", 2)
        return f"Beside white noise a random force of {force} on the platform is assumed: see the notes."
    before, after = trace.noise_before, trace.noise_after
    if before and after:
        return "The residual of the declared model is already white noise."
    if after:
        return "The residual of the extended model is white noise; that of the declared model is not."
    if before:
        return "The residual of the declared model is white noise; that of the final model is not."
    if trace.effects:
        return "One-step predictions leave more than white noise, also those of the extended model."
    return "One-step predictions leave more than white noise."


def format_evidence(evidence: float) -> str:
    """Formats evidence in natural logarithms to one decimal; to four digits where it is large."""
    if not math.isfinite(evidence):
        return ABSENT_TEXT
    return format_significant(evidence, 4) if abs(evidence) >= 1000.0 else f"{evidence:.1f}"
