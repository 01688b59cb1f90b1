"""The written sections of a trace's page: verdict, tables and lists; each function gives HTML."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ..estimation.trace_result import FittedParameter, FoundEffect, Trace
from ..number_format import format_engineering, format_percent, format_significant
from . import inline_charts as charts
from .html_markup import TableColumn, bullet_list, download_links, escape_text, number_html, section, table
from .trace_figures import ROLE_LABELS, measured_outputs
from .trace_texts import (
    POSITION,
    ROLES,
    TENSION,
    VERDICTS,
    MeasuredOutput,
    axis_outputs,
    cable_outputs,
    cables_text,
    comparison_by_role,
    explained_share,
    format_estimate,
    format_evidence,
    noise_sentence,
    values_text,
)

MAX_CONFUSABLE_SHOWN = 6
# Weaker correlations are not listed.
MIN_SHOWN_CORRELATION = 0.5
ERROR_COLUMNS = (
    TableColumn("Output"),
    TableColumn("Before", True),
    TableColumn("After", True),
    TableColumn("Noise floor", True),
    TableColumn("Explained", True),
    TableColumn("Before to after"),
)


def masthead(trace: Trace, links: Mapping[str, str]) -> str:
    """The page's header: the robot, the verdict in one sentence, and download links."""
    robot = trace.robot_before
    return (
        f'<header><p class="eyebrow"><strong>Tautwire trace</strong> '
        f"<span>{escape_text(robot.name)}, {robot.cable_count} cables</span></p>"
        f'<p class="verdict verdict-{trace.verdict}">{VERDICTS[trace.verdict]}</p>'
        f"<h1>{escape_text(trace.sentence)}</h1>"
        f'<p class="aside">{escape_text(noise_sentence(trace))}</p>{download_links(links)}</header>'
    )


def error_summary(trace: Trace) -> str:
    """Errors before and after on all recordings, with those of each output folded away."""
    rows = []
    details = ""
    for role in ROLES:
        if comparison_by_role(trace, role):
            rows += _error_rows(trace, role, [POSITION, TENSION], f"{role.capitalize()}, ")
            details += _error_details(trace, role)
    lead = (
        "Root mean square (rms) of measured minus co-simulated: before, by the robot as its file declares it, and "
        f"after, with what was found (the extended model). {_data_split_sentence(trace)} The noise floor is what "
        "noise of the "
        "sensors and of the recorded winch speeds alone would leave: no model comes below it but by chance. Explained "
        "is the share of the mean square above the floor that is gone."
    )
    legend = _legend("before", "after") + '<span class="key key-floor">noise floor, logarithmic scale</span>'
    main_table = table("Error of the co-simulation over all axes and all cables", ERROR_COLUMNS, rows, "errors", True)
    return section("summary", "Before and after", f'{main_table}<p class="keys dots">{legend}</p>{details}', lead)


def _data_split_sentence(trace: Trace) -> str:
    """A sentence on the fit and the validation data."""
    if comparison_by_role(trace, "check"):
        return "Effects were fitted to the recording “fit” and judged on “check”."
    return "Effects were fitted to one part of the recording and judged on another."


def identified_effects(trace: Trace) -> str:
    """The identified effects with their parameters, and the formula of a new one."""
    rows = [row for effect in trace.effects for row in _effect_rows(trace, effect)]
    content = f"<p>Formula of the new effect:</p><pre>{escape_text(trace.formula)}</pre>" if trace.formula else ""
    if rows:
        columns = (
            TableColumn("Effect"), TableColumn("Where"), TableColumn("Parameter"), TableColumn("Value", True),
            TableColumn("95 % interval", True, True), TableColumn("Declared", True), TableColumn("Unit"),
            TableColumn("Estimate and declared"), TableColumn("Evidence", True),
        )  # fmt: skip
        content += table("Effects found, with their parameters", columns, rows, "effects", True)
        content += '<p class="keys dots"><span class="key key-after">estimate with its interval</span>'
        content += '<span class="key key-floor">declared</span></p>' + _correlated_estimates(trace)
    elif not content:
        content = "<p>No effect was added to the model.</p>"
    lead = (
        "Evidence tells how much more probable data that the fit did not see are with the effect than without it, as a "
        "natural logarithm (log of the likelihood ratio): 2.3 is ten times, 6.9 a thousand times. In 95 of 100 such "
        "recordings the 95 % interval holds the true value."
    )
    return section("found", "What the model lacked", content, lead if rows else "")


def _correlated_estimates(trace: Trace) -> str:
    """Strongly correlated estimates, whose intervals must not be read one by one."""
    strong = [found for found in trace.correlations if abs(found.value) >= MIN_SHOWN_CORRELATION]
    lines = []
    for found in strong:
        one, other = (f"{each.parameter} of {_effect_name(trace, each)}" for each in found.between)
        direction = "too large" if found.value > 0.0 else "too small"
        lines.append(
            f"{one} and {other}: where one is too large the other is {direction} ({100.0 * found.value:.0f} %)"
        )
    return f"<p>Estimates that err together (correlation):</p>{bullet_list(lines)}" if lines else ""


def _effect_name(trace: Trace, fitted: FittedParameter) -> str:
    cables = f" ({cables_text(fitted.cables, trace.robot_before.cable_count)})" if fitted.cables else ""
    return fitted.name + cables


def alternative_models(trace: Trace) -> str:
    """Alternative models that fit as well, and effects confusable with the identified ones."""
    if trace.also_possible:
        content = bullet_list([" + ".join(names) for names in trace.also_possible])
        lead = "These recordings cannot tell the answer above from:"
    else:
        other = "No other set of effects that was tried explains the recordings as well."
        none = "Nothing that was tried explains the recordings significantly better."
        content, lead = f"<p>{other if trace.effects else none}</p>", ""
    return section("possible", "What else is possible", content + _confusable_effects(trace), lead)


def _confusable_effects(trace: Trace) -> str:
    """The effects most easily confused with the identified ones."""
    count = trace.robot_before.cable_count
    rows = [
        [
            escape_text(f"{each.name}, {cables_text(each.cables, count)}" if each.cables else each.name),
            escape_text(f"{each.other}, {cables_text(each.other_cables, count)}" if each.other_cables else each.other),
            number_html(f"{format_significant(_angle_in_degrees(each.cosine))}°"),
            number_html(format_significant(each.nats)),
        ]
        for each in trace.identifiability.confusable[:MAX_CONFUSABLE_SHOWN]
    ]
    if not rows:
        return ""
    columns = (
        TableColumn("Effect"),
        TableColumn("What looks like it", wide=True),
        TableColumn("Angle between", True),
        TableColumn("Evidence lost", True),
    )
    explanation = (
        '<p class="lead">How like the answer others look in these recordings: the angle between what each changes in '
        "the measurements, 0° where nothing tells them apart and 90° where they have nothing in common; and the "
        "evidence that would be lost with the other in its place. <code>tautwire excite</code> writes a motion that "
        "tells them apart best.</p>"
    )
    return explanation + table("What looks like the answer", columns, rows, "alike")


def _angle_in_degrees(cosine: float) -> float:
    """The angle in degrees of a cosine, clipped to -1 to 1 against rounding."""
    return math.degrees(math.acos(max(-1.0, min(1.0, cosine))))


def detection_limits(trace: Trace) -> str:
    """Detection limits: the smallest size of each effect that the recordings would have shown."""
    sizes = trace.identifiability.detectable
    if not sizes:
        what = "More than noise is left, so that no size can be given below which an effect would not show."
        return section("unseen", "What it could not have seen", f"<p>{what}</p>")
    count = trace.robot_before.cable_count
    rows = [
        [
            escape_text(each.name),
            escape_text(cables_text(each.cables, count) if each.cables else "platform"),
            escape_text(each.parameter),
            number_html(format_engineering(each.size, each.unit)) if math.isfinite(each.size) else escape_text("never"),
            number_html(values_text(each.name, each.other_values)),
        ]
        for each in sizes
    ]
    columns = (
        TableColumn("Effect"), TableColumn("Where"), TableColumn("Parameter"), TableColumn("Smallest size", True, True),
        TableColumn("With", wide=True),
    )  # fmt: skip
    lead = (
        "The size of each effect that these recordings would have shown in nine cases out of ten, counted from where "
        "it is absent. What is smaller may be there. “Never”: no size that it may have would show."
    )
    return section(
        "unseen", "What it could not have seen", table("Smallest sizes", columns, rows, "unseen", True), lead
    )


def residual_analysis(trace: Trace) -> str:
    """Residual analysis: the normalised innovation variance of each output, 1 for noise, and its autocorrelation."""
    largest = float(
        np.max(trace.normalised_innovation_variance[np.isfinite(trace.normalised_innovation_variance)], initial=1.5)
    )
    rows = [
        [
            escape_text(output.label),
            number_html(format_significant(float(value))),
            charts.bar(float(value), largest, tick=1.0),
            number_html(format_significant(float(autocorrelation), 2)),
            number_html(format_significant(float(noise_limit), 2)),
        ]
        for output, value, autocorrelation, noise_limit in zip(
            measured_outputs(trace), trace.normalised_innovation_variance, *trace.autocorrelations, strict=True
        )
    ]
    autocorrelation_columns = TableColumn("Correlation with itself", True), TableColumn("Of noise, at most", True)
    columns = (
        TableColumn("Output"),
        TableColumn("Times the noise", True),
        TableColumn("Against 1"),
        *autocorrelation_columns,
    )
    lead = (
        "How far the final model is off when it predicts each sample from those before it, on data that the fit did "
        "not see: the mean square, in times of what noise alone makes it (in other words, of the whitened "
        "innovations). 1 is noise. Beside it the largest correlation of these errors with themselves one to twenty "
        "samples later (their whiteness), whatever its sign: large where something swings or drifts; of noise, it is "
        "below what stands beside it nineteen times of twenty. Where nothing is to be found, the tests find something "
        "in "
        f"{number_html(f'{format_significant(100.0 * trace.alpha, 2)} %')} of recordings at most."
    )
    return section("left", "What is left", table("What is left in each output", columns, rows, "left", True), lead)


def notes_section(trace: Trace) -> str:
    """Notes of the trace, columns that were not read, and the computing time."""
    lines = list(trace.notes)
    for each in trace.comparisons:
        if each.recording.unknown_columns:
            unread_columns = ", ".join(each.recording.unknown_columns)
            lines.append(f"Columns of the {each.role} recording that were not read: {unread_columns}")
    lines.append(f"The trace took {format_significant(trace.seconds)} s.")
    return section("notes", "Notes", bullet_list(lines))


def _legend(*names: str) -> str:
    return "".join(f'<span class="key key-{name}">{name}</span>' for name in names)


def _error_details(trace: Trace, role: str) -> str:
    """The errors of each output, folded away."""
    label = ROLE_LABELS[role]
    detail_outputs = [*axis_outputs(), *cable_outputs(trace.robot_before.cable_count)]
    rows = _error_rows(trace, role, detail_outputs)
    detail_table = table(f"{label}: error of each output", ERROR_COLUMNS, rows, "errors", True)
    return f"<details><summary>{label}, axis by axis and cable by cable</summary>{detail_table}</details>"


def _error_rows(trace: Trace, role: str, row_outputs: Sequence[MeasuredOutput], prefix: str = "") -> list[list[str]]:
    comparison = comparison_by_role(trace, role)
    if comparison is None:
        return []
    rows = []
    for output in row_outputs:
        before, after = output.error_of(comparison.errors_before), output.error_of(comparison.errors_after)
        floor = output.error_of(trace.noise_floor)
        low, high = _shared_scale(trace, output)
        numbers = [
            f"{number_html(format_significant(value))} {_unit_html(value, output)}" for value in (before, after, floor)
        ]
        share = number_html(format_percent(explained_share(before, after, floor)))
        label = f"{escape_text(prefix + output.label)}"
        rows.append([label, *numbers, share, charts.dumbbell(before, after, floor, low, high)])
    return rows


def _unit_html(value: float, output: MeasuredOutput) -> str:
    return f'<span class="unit">{output.unit}</span>' if math.isfinite(value) else ""


def _shared_scale(trace: Trace, output: MeasuredOutput) -> tuple[float, float]:
    """One scale for all charts of a unit: from below the minimum to above the maximum."""
    scale_outputs = [*axis_outputs(), POSITION, *cable_outputs(trace.robot_before.cable_count), TENSION]
    errors = [trace.noise_floor]
    for each in trace.comparisons:
        errors += [each.errors_before, each.errors_after]
    values = np.array([kind.error_of(each) for kind in scale_outputs if kind.unit == output.unit for each in errors])
    values = values[np.isfinite(values) & (values > 0.0)]
    return (0.8 * float(values.min()), 1.25 * float(values.max())) if values.size else (0.0, 0.0)


def _effect_rows(trace: Trace, effect: FoundEffect) -> list[list[str]]:
    location = effect.component
    if effect.cables:
        location = cables_text(effect.cables, trace.robot_before.cable_count)
    rows = []
    for index, (name, estimate) in enumerate(effect.parameters.items()):
        formatted = format_estimate(estimate)
        interval = f"{number_html(formatted.low)} to {number_html(formatted.high)}"
        drawing = charts.whisker(estimate.value, estimate.low, estimate.high, estimate.declared)
        evidence = number_html(format_evidence(effect.evidence)) if index == 0 else ""
        rows.append([
            escape_text(effect.name), escape_text(location), escape_text(name),
            f"<strong>{number_html(formatted.value)}</strong>",
            interval, number_html(formatted.declared), escape_text(formatted.unit), drawing, evidence,
        ])  # fmt: skip
    return rows
