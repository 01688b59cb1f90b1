"""The written parts of the page: verdict, tables and lists; each function gives HTML."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ..tracer.verdict import Fitted, FoundEffect, Trace
from . import charts
from .figures import ROLE_LABELS, outputs
from .markup import Column, bullets, downloads, number, section, table, text
from .summary import (
    POSITION,
    ROLES,
    TENSION,
    VERDICTS,
    Output,
    axis_outputs,
    cable_outputs,
    cables_text,
    comparison_of,
    estimate_text,
    evidence_text,
    noise_sentence,
    share_explained,
    values_text,
)
from .units import engineering, percent, significant

SHOWN_ALIKE = 6
# Correlations below this are not worth a line.
TOGETHER = 0.5
ERROR_COLUMNS = (
    Column("Output"),
    Column("Before", True),
    Column("After", True),
    Column("Noise floor", True),
    Column("Explained", True),
    Column("Before to after"),
)


def masthead(trace: Trace, links: Mapping[str, str]) -> str:
    """What the page is about, the verdict in one sentence, and where the files are."""
    robot = trace.robot_before
    return (
        f'<header><p class="eyebrow"><strong>Tautwire trace</strong> '
        f"<span>{text(robot.name)}, {robot.cable_count} cables</span></p>"
        f'<p class="verdict verdict-{trace.verdict}">{VERDICTS[trace.verdict]}</p>'
        f"<h1>{text(trace.sentence)}</h1>"
        f'<p class="aside">{text(noise_sentence(trace))}</p>{downloads(links)}</header>'
    )


def summary(trace: Trace) -> str:
    """Errors before and after on all recordings, and each output below on request."""
    rows = []
    details = ""
    for role in ROLES:
        if comparison_of(trace, role):
            rows += _error_rows(trace, role, [POSITION, TENSION], f"{role.capitalize()}, ")
            details += _error_details(trace, role)
    lead = (
        "Root mean square (rms) of measured minus co-simulated: before, by the robot as its file declares it, and "
        f"after, with what was found (the extended model). {_judged(trace)} The noise floor is what noise of the "
        "sensors and of the recorded winch speeds alone would leave: no model comes below it but by chance. Explained "
        "is the share of the mean square above the floor that is gone."
    )
    key = _key("before", "after") + '<span class="key key-floor">noise floor, logarithmic scale</span>'
    main = table("Error of the co-simulation over all axes and all cables", ERROR_COLUMNS, rows, "errors", True)
    return section("summary", "Before and after", f'{main}<p class="keys dots">{key}</p>{details}', lead)


def _judged(trace: Trace) -> str:
    """What effects were fitted to and judged on."""
    if comparison_of(trace, "check"):
        return "Effects were fitted to the recording “fit” and judged on “check”."
    return "Effects were fitted to one part of the recording and judged on another."


def found(trace: Trace) -> str:
    """Effects with their parameters, and the formula of a new one."""
    rows = [row for effect in trace.effects for row in _effect_rows(trace, effect)]
    content = f"<p>Formula of the new effect:</p><pre>{text(trace.formula)}</pre>" if trace.formula else ""
    if rows:
        columns = (
            Column("Effect"), Column("Where"), Column("Parameter"), Column("Value", True),
            Column("95 % interval", True, True), Column("Declared", True), Column("Unit"),
            Column("Estimate and declared"), Column("Evidence", True),
        )  # fmt: skip
        content += table("Effects found, with their parameters", columns, rows, "effects", True)
        content += '<p class="keys dots"><span class="key key-after">estimate with its interval</span>'
        content += '<span class="key key-floor">declared</span></p>' + _together(trace)
    elif not content:
        content = "<p>No effect was added to the model.</p>"
    lead = (
        "Evidence tells how much more probable data that the fit did not see are with the effect than without it, as a "
        "natural logarithm (log of the likelihood ratio): 2.3 is ten times, 6.9 a thousand times. In 95 of 100 such "
        "recordings the 95 % interval holds the true value."
    )
    return section("found", "What the model lacked", content, lead if rows else "")


def _together(trace: Trace) -> str:
    """Which estimates err together, so that their intervals must not be taken one by one."""
    strong = [found for found in trace.correlations if abs(found.value) >= TOGETHER]
    said = []
    for found in strong:
        one, other = (f"{each.parameter} of {_named(trace, each)}" for each in found.between)
        way = "too large" if found.value > 0.0 else "too small"
        said.append(f"{one} and {other}: where one is too large the other is {way} ({100.0 * found.value:.0f} %)")
    return f"<p>Estimates that err together (correlation):</p>{bullets(said)}" if said else ""


def _named(trace: Trace, fitted: Fitted) -> str:
    cables = f" ({cables_text(fitted.cables, trace.robot_before.cable_count)})" if fitted.cables else ""
    return fitted.name + cables


def also_possible(trace: Trace) -> str:
    """Sets of effects that fit as well."""
    if trace.also_possible:
        content = bullets([" + ".join(names) for names in trace.also_possible])
        lead = "These recordings cannot tell the answer above from:"
    else:
        other = "No other set of effects that was tried explains the recordings as well."
        none = "Nothing that was tried explains the recordings significantly better."
        content, lead = f"<p>{other if trace.effects else none}</p>", ""
    return section("possible", "What else is possible", content + _alike(trace), lead)


def _alike(trace: Trace) -> str:
    """What would look most like the answer."""
    count = trace.robot_before.cable_count
    rows = [
        [
            text(f"{each.name}, {cables_text(each.cables, count)}" if each.cables else each.name),
            text(f"{each.other}, {cables_text(each.other_cables, count)}" if each.other_cables else each.other),
            number(f"{significant(_angle(each.cosine))}°"),
            number(significant(each.nats)),
        ]
        for each in trace.separation.alike[:SHOWN_ALIKE]
    ]
    if not rows:
        return ""
    columns = (
        Column("Effect"),
        Column("What looks like it", wide=True),
        Column("Angle between", True),
        Column("Evidence lost", True),
    )
    told = (
        '<p class="lead">How like the answer others look in these recordings: the angle between what each changes in '
        "the measurements, 0° where nothing tells them apart and 90° where they have nothing in common; and the "
        "evidence that would be lost with the other in its place. <code>tautwire excite</code> writes a motion that "
        "tells them apart best.</p>"
    )
    return told + table("What looks like the answer", columns, rows, "alike")


def _angle(cosine: float) -> float:
    """The angle in degrees, whatever rounding has left of a cosine."""
    return math.degrees(math.acos(max(-1.0, min(1.0, cosine))))


def unseen(trace: Trace) -> str:
    """The smallest size of each effect that the recordings would have shown."""
    sizes = trace.separation.detectable
    if not sizes:
        what = "More than noise is left, so that no size can be given below which an effect would not show."
        return section("unseen", "What it could not have seen", f"<p>{what}</p>")
    count = trace.robot_before.cable_count
    rows = [
        [
            text(each.name),
            text(cables_text(each.cables, count) if each.cables else "platform"),
            text(each.parameter),
            number(engineering(each.size, each.unit)) if math.isfinite(each.size) else text("never"),
            number(values_text(each.name, each.beside)),
        ]
        for each in sizes
    ]
    columns = (
        Column("Effect"), Column("Where"), Column("Parameter"), Column("Smallest size", True, True),
        Column("With", wide=True),
    )  # fmt: skip
    lead = (
        "The size of each effect that these recordings would have shown in nine cases out of ten, counted from where "
        "it is absent. What is smaller may be there. “Never”: no size that it may have would show."
    )
    return section(
        "unseen", "What it could not have seen", table("Smallest sizes", columns, rows, "unseen", True), lead
    )


def left(trace: Trace) -> str:
    """Mean squares of the whitened innovations of each output, against one."""
    largest = float(np.max(trace.left[np.isfinite(trace.left)], initial=1.5))
    rows = [
        [
            text(output.label),
            number(significant(float(value))),
            charts.bar(float(value), largest, mark=1.0),
            number(significant(float(alike), 2)),
            number(significant(float(of_noise), 2)),
        ]
        for output, value, alike, of_noise in zip(outputs(trace), trace.left, *trace.autocorrelations, strict=True)
    ]
    alike_to_itself = Column("Correlation with itself", True), Column("Of noise, at most", True)
    columns = (Column("Output"), Column("Times the noise", True), Column("Against 1"), *alike_to_itself)
    lead = (
        "How far the final model is off when it predicts each sample from those before it, on data that the fit did "
        "not see: the mean square, in times of what noise alone makes it (in other words, of the whitened "
        "innovations). 1 is noise. Beside it the largest correlation of these errors with themselves one to twenty "
        "samples later (their whiteness), whatever its sign: large where something swings or drifts; of noise, it is "
        "below what stands beside it nineteen times of twenty. Where nothing is to be found, the tests find something "
        "in "
        f"{number(f'{significant(100.0 * trace.alpha, 2)} %')} of recordings at most."
    )
    return section("left", "What is left", table("What is left in each output", columns, rows, "left", True), lead)


def notes(trace: Trace) -> str:
    """Remarks of the trace, columns that were not read, and how long it took."""
    lines = list(trace.notes)
    for each in trace.comparisons:
        if each.recording.unknown_columns:
            unread = ", ".join(each.recording.unknown_columns)
            lines.append(f"Columns of the {each.role} recording that were not read: {unread}")
    lines.append(f"The trace took {significant(trace.seconds)} s.")
    return section("notes", "Notes", bullets(lines))


def _key(*names: str) -> str:
    return "".join(f'<span class="key key-{name}">{name}</span>' for name in names)


def _error_details(trace: Trace, role: str) -> str:
    """The errors of each output, folded away."""
    label = ROLE_LABELS[role]
    parts = [*axis_outputs(), *cable_outputs(trace.robot_before.cable_count)]
    rows = _error_rows(trace, role, parts)
    inside = table(f"{label}: error of each output", ERROR_COLUMNS, rows, "errors", True)
    return f"<details><summary>{label}, axis by axis and cable by cable</summary>{inside}</details>"


def _error_rows(trace: Trace, role: str, shown: Sequence[Output], prefix: str = "") -> list[list[str]]:
    comparison = comparison_of(trace, role)
    if comparison is None:
        return []
    rows = []
    for output in shown:
        before, after = output.of(comparison.errors_before), output.of(comparison.errors_after)
        floor = output.of(trace.noise_floor)
        low, high = _scale(trace, output)
        numbers = [f"{number(significant(value))} {_unit(value, output)}" for value in (before, after, floor)]
        share = number(percent(share_explained(before, after, floor)))
        label = f"{text(prefix + output.label)}"
        rows.append([label, *numbers, share, charts.dumbbell(before, after, floor, low, high)])
    return rows


def _unit(value: float, output: Output) -> str:
    return f'<span class="unit">{output.unit}</span>' if math.isfinite(value) else ""


def _scale(trace: Trace, output: Output) -> tuple[float, float]:
    """One scale for all drawings of a unit: from below the least value to above the largest."""
    kinds = [*axis_outputs(), POSITION, *cable_outputs(trace.robot_before.cable_count), TENSION]
    errors = [trace.noise_floor]
    for each in trace.comparisons:
        errors += [each.errors_before, each.errors_after]
    values = np.array([kind.of(each) for kind in kinds if kind.unit == output.unit for each in errors])
    values = values[np.isfinite(values) & (values > 0.0)]
    return (0.8 * float(values.min()), 1.25 * float(values.max())) if values.size else (0.0, 0.0)


def _effect_rows(trace: Trace, effect: FoundEffect) -> list[list[str]]:
    where = effect.component
    if effect.cables:
        where = cables_text(effect.cables, trace.robot_before.cable_count)
    rows = []
    for place, (name, estimate) in enumerate(effect.parameters.items()):
        told = estimate_text(estimate)
        interval = f"{number(told.low)} to {number(told.high)}"
        drawing = charts.whisker(estimate.value, estimate.low, estimate.high, estimate.declared)
        evidence = number(evidence_text(effect.evidence)) if place == 0 else ""
        rows.append([
            text(effect.name), text(where), text(name), f"<strong>{number(told.value)}</strong>",
            interval, number(told.declared), text(told.unit), drawing, evidence,
        ])  # fmt: skip
    return rows
