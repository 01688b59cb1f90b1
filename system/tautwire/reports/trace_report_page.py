"""The page of a trace: what its template shows, as typeset rows of tables and sentences."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tautwire_fmu.laws.effects import BY_NAME

from ..cosimulation.robot_wiring import PLATFORM
from ..estimation.localisation.component_residuals import ComponentResidual
from ..estimation.trace_result import Candidate, FittedParameter, FoundEffect, Trace
from ..number_format import ABSENT_TEXT, format_engineering, format_percent, format_significant
from ..provenance import Provenance
from . import inline_charts as charts
from .page_rendering import Label, Number, PageHeader, Row, render_page
from .trace_figures import ROLE_LABELS, measured_outputs, noise_deviation, trace_page_data
from .trace_texts import (
    ROLES,
    VERDICTS,
    MeasuredOutput,
    alternative_texts,
    cables_text,
    candidate_status,
    candidates_by_round,
    comparison_by_role,
    detectable_texts,
    explained_share,
    format_estimate,
    format_evidence,
    headline,
    noise_sentence,
    output_groups,
    runners_up,
    separating_commands,
    undetectable_effects,
    values_text,
)

MAX_ROWS_SHOWN = 8
MAX_CONFUSABLE_SHOWN = 6
# Weaker correlations are not listed.
MIN_SHOWN_CORRELATION = 0.5
# The scale of the components' ratios spans at least this.
MIN_RATIO_SPAN = (0.5, 4.0)


@dataclass(frozen=True)
class SearchRound:
    """A round of the search as rows: the best fitted candidates, the ``weaker`` ones, and those not fitted."""

    number: int
    fitted: Sequence[Row]
    weaker: Sequence[Row]
    not_fitted: Sequence[Row]


def trace_page(trace: Trace, links: Mapping[str, str], provenance: Provenance | None = None) -> str:
    """The report page; ``links`` maps labels to paths beside the page, such as "robot.toml"."""
    robot, figures = trace.robot_before, trace_page_data(trace)
    subject, title = f"{robot.name}, {robot.cable_count} cables", f"{robot.name}: {trace.sentence}"
    verdict = VERDICTS[trace.verdict]
    header = PageHeader("Tautwire trace", subject, headline(trace), title, verdict, trace.verdict, links, provenance)
    tables = {
        "total_errors": _total_error_rows(trace),
        "output_errors": _output_error_rows(trace),
        "effects": [row for effect in trace.effects for row in _effect_rows(trace, effect)],
        "confusable": _confusable_rows(trace),
        "components": _component_rows(trace),
        "rounds": _search_rounds(trace),
        "innovations": _innovation_rows(trace),
        "detectable": _detection_limit_rows(trace),
    }
    return render_page(
        "trace",
        header,
        figures,
        trace=trace,
        noise_sentence=noise_sentence(trace),
        has_declared=any(each.declared is not None for effect in trace.effects for each in effect.parameters.values()),
        has_check=comparison_by_role(trace, "check") is not None,
        correlations=_correlation_sentences(trace),
        runners_up=runners_up(trace),
        alternatives=alternative_texts(trace),
        commands=separating_commands(trace),
        would_show=detectable_texts(trace) if trace.verdict == "none" else [],
        never_shown=undetectable_effects(trace),
        recordings=[choice["label"] for choice in figures["choices"]],
        panels=_panels_by_quantity(trace),
        noise_source=_noise_source(trace),
        winch_speed_noise=format_significant(1e3 * (robot.sensors.winch_speed_noise or 0.0)),
        bands=_band_sentences(figures["choices"]),
        false_alarm_rate=f"{format_significant(100.0 * trace.alpha, 2)} %",
        notes=_note_lines(trace),
        **tables,
    )


def _total_error_rows(trace: Trace) -> list[Row]:
    """Errors before and after over all axes and all cables, for each recording."""
    outputs = [total for total, _ in output_groups(trace.robot_before) if _is_measured(trace, total)]
    return [row for role in ROLES for row in _error_rows(trace, role, outputs, f"{role.capitalize()}, ")]


def _output_error_rows(trace: Trace) -> dict[str, list[Row]]:
    """Errors before and after of each output, by recording."""
    roles = [role for role in ROLES if comparison_by_role(trace, role)]
    outputs = [output for output in measured_outputs(trace) if _is_measured(trace, output)]
    return {ROLE_LABELS[role]: _error_rows(trace, role, outputs) for role in roles}


def _is_measured(trace: Trace, output: MeasuredOutput) -> bool:
    """Whether any recording has the output."""
    return any(math.isfinite(output.error_of(each.errors_before)) for each in trace.comparisons)


def _error_rows(trace: Trace, role: str, outputs: Sequence[MeasuredOutput], prefix: str = "") -> list[Row]:
    comparison = comparison_by_role(trace, role)
    if comparison is None:
        return []
    rows: list[Row] = []
    for output in outputs:
        before, after = output.error_of(comparison.errors_before), output.error_of(comparison.errors_after)
        floor = output.error_of(trace.noise_floor)
        numbers = [Number(format_significant(value), output.unit) for value in (before, after, floor)]
        share = Number(format_percent(explained_share(before, after, floor)))
        chart = charts.dumbbell(before, after, floor, *_shared_scale(trace, output))
        rows.append([prefix + output.label, *numbers, share, chart])
    return rows


def _shared_scale(trace: Trace, output: MeasuredOutput) -> tuple[float, float]:
    """One scale for all charts of a unit: from below the minimum to above the maximum."""
    scale_outputs = [each for total, parts in output_groups(trace.robot_before) for each in (*parts, total)]
    errors = [trace.noise_floor]
    for each in trace.comparisons:
        errors += [each.errors_before, each.errors_after]
    values = np.array([kind.error_of(each) for kind in scale_outputs if kind.unit == output.unit for each in errors])
    values = values[np.isfinite(values) & (values > 0.0)]
    return (0.8 * float(values.min()), 1.25 * float(values.max())) if values.size else (0.0, 0.0)


def _effect_rows(trace: Trace, effect: FoundEffect) -> list[Row]:
    location = cables_text(effect.cables, trace.robot_before.cable_count) if effect.cables else effect.component
    evidence = Number(format_evidence(effect.evidence))
    rows: list[Row] = []
    for name, estimate in effect.parameters.items():
        text = format_estimate(estimate)
        chart = charts.whisker(estimate.value, estimate.low, estimate.high, estimate.declared)
        value, interval = Number(text.value, strong=True), Number(f"{text.low} to {text.high}")
        # Named once: each name is one effect, however many parameters it has.
        names, evidence_once = (("", ""), "") if rows else ((effect.name, location), evidence)
        rows.append([*names, name, value, interval, Number(text.declared), text.unit, chart, evidence_once])
    return rows


def _correlation_sentences(trace: Trace) -> list[str]:
    """Strongly correlated estimates, whose intervals must not be read one by one."""
    sentences = []
    for each in trace.correlations:
        if abs(each.value) >= MIN_SHOWN_CORRELATION:
            one, other = (f"{part.parameter} of {_effect_name(trace, part)}" for part in each.between)
            direction = "too large" if each.value > 0.0 else "too small"
            share = f"{100.0 * each.value:.0f} %"
            sentences.append(f"{one} and {other}: where one is too large the other is {direction} ({share})")
    return sentences


def _effect_name(trace: Trace, fitted: FittedParameter) -> str:
    cables = f" ({cables_text(fitted.cables, trace.robot_before.cable_count)})" if fitted.cables else ""
    return fitted.name + cables


def _confusable_rows(trace: Trace) -> list[Row]:
    """The effects most easily confused with the identified ones."""
    count = trace.robot_before.cable_count

    def named(effect: str, cables: Sequence[int]) -> str:
        return f"{effect}, {cables_text(cables, count)}" if cables else effect

    return [
        [
            named(each.name, each.cables),
            named(each.other, each.other_cables),
            Number(f"{format_significant(_angle_in_degrees(each.cosine))}°"),
            Number(format_significant(each.nats)),
        ]
        for each in trace.identifiability.confusable[:MAX_CONFUSABLE_SHOWN]
    ]


def _angle_in_degrees(cosine: float) -> float:
    """The angle in degrees of a cosine, clipped to -1 to 1 against rounding."""
    return math.degrees(math.acos(max(-1.0, min(1.0, cosine))))


def _component_rows(trace: Trace) -> list[Row]:
    """Residuals of each FMU alone against their expected noise, the largest ratio first."""
    components = trace.components
    ratios = [part.ratio for part in components.residuals if math.isfinite(part.ratio) and part.ratio > 0.0]
    low = min([MIN_RATIO_SPAN[0], *(0.8 * ratio for ratio in ratios)])
    high = max([MIN_RATIO_SPAN[1], *(1.25 * ratio for ratio in ratios)])
    return [
        [
            part.component,
            part.quantity,
            Number(format_significant(part.rms), part.unit),
            Number(format_significant(part.expected_rms), part.unit),
            Number(format_significant(part.ratio)),
            charts.log_bar(part.ratio, low, high, tick=1.0, css_class="before" if part.is_significant else "after"),
            Number(_residual_pattern(part)),
        ]
        for part in components.ranking
    ]


def _residual_pattern(part: ComponentResidual) -> str:
    """What a component's residual does: the signal that it follows, or the frequency at which it rings."""
    if part.oscillates:
        return f"oscillates at {part.resonance_frequency:.2f} Hz"
    association = part.correlated_signal
    return f"{association.name} ({100.0 * association.correlation:.0f} %)" if association else ABSENT_TEXT


def _search_rounds(trace: Trace) -> list[SearchRound]:
    max_evidence = max((each.evidence for each in trace.candidates if math.isfinite(each.evidence)), default=0.0)
    rounds = []
    for number, candidates in candidates_by_round(trace.candidates):
        fitted = [
            _fitted_row(trace, each, candidate_status(each, candidates), max_evidence)
            for each in candidates
            if math.isfinite(each.mean_square)
        ]
        others = [_unfitted_row(trace, each) for each in candidates if not math.isfinite(each.mean_square)]
        rounds.append(SearchRound(number, fitted[:MAX_ROWS_SHOWN], fitted[MAX_ROWS_SHOWN:], others))
    return rounds


def _fitted_row(trace: Trace, candidate: Candidate, status: str, max_evidence: float) -> Row:
    return [
        candidate.name,
        _candidate_location(trace, candidate),
        Number(format_evidence(candidate.evidence)),
        charts.bar(candidate.evidence, max_evidence, css_class="after" if candidate.accepted else "before"),
        Number(format_significant(candidate.mean_square)),
        Number(values_text(candidate.name, candidate.form_values)),
        Label(status, "taken") if candidate.accepted else status,
    ]


def _unfitted_row(trace: Trace, candidate: Candidate) -> Row:
    """A candidate with the values predicted for it; a dash where these are neutral."""
    parameters = {each.name: each for each in BY_NAME[candidate.name].parameters} if candidate.name in BY_NAME else {}
    values = candidate.form_values
    is_neutral = any(name in parameters and parameters[name].neutral == value for name, value in values.items())
    text = ABSENT_TEXT if is_neutral else values_text(candidate.name, values)
    return [candidate.name, _candidate_location(trace, candidate), Number(text)]


def _candidate_location(trace: Trace, candidate: Candidate) -> str:
    return cables_text(candidate.cables, trace.robot_before.cable_count) if candidate.cables else PLATFORM


def _innovation_rows(trace: Trace) -> list[Row]:
    """The normalised innovation variance of each output, 1 for noise, and its autocorrelation."""
    variances = trace.normalised_innovation_variance
    largest = float(np.max(variances[np.isfinite(variances)], initial=1.5))
    return [
        [
            output.label,
            Number(format_significant(float(variance))),
            charts.bar(float(variance), largest, tick=1.0),
            Number(format_significant(float(autocorrelation), 2)),
            Number(format_significant(float(noise_limit), 2)),
        ]
        for output, variance, autocorrelation, noise_limit in zip(
            measured_outputs(trace), variances, *trace.autocorrelations, strict=True
        )
    ]


def _detection_limit_rows(trace: Trace) -> list[Row]:
    """The smallest size of each effect that the recordings would have shown."""
    count = trace.robot_before.cable_count
    return [
        [
            each.name,
            cables_text(each.cables, count) if each.cables else PLATFORM,
            each.parameter,
            Number(format_engineering(each.size, each.unit)) if math.isfinite(each.size) else "never",
            Number(values_text(each.name, each.other_values)),
        ]
        for each in trace.identifiability.detectable
    ]


def _panels_by_quantity(trace: Trace) -> dict[str, list[tuple[int, str]]]:
    """Channel indices and labels of the outputs that a recording has, positions and tensions in groups of their own."""
    outputs = [(index, output) for index, output in enumerate(measured_outputs(trace)) if _is_measured(trace, output)]
    return {
        title: [(index, output.label) for index, output in outputs if output.errors_key[0] == field]
        for title, field in (("Position", "axes"), ("Tension", "cables"), ("Orientation", "rotations"))
        if field != "rotations" or trace.robot_before.platform.is_rigid_body
    }


def _band_sentences(choices: Sequence[Mapping[str, Any]]) -> list[str]:
    """Each band that is marked in the spectra, in words."""
    return [f"{choice['label']}: {band['words']}" for choice in choices for band in choice["bands"]]


def _noise_source(trace: Trace) -> str:
    """Where the noise band comes from: "declared" in the robot file, "estimated", or "both"."""
    declared = {noise_deviation(trace, output)[1] for output in measured_outputs(trace)}
    return "both" if len(declared) > 1 else "declared" if declared == {True} else "estimated"


def _note_lines(trace: Trace) -> list[str]:
    """What there was no time for, notes of the trace, and the computing time."""
    return [*trace.untried, *trace.notes, f"The trace took {format_significant(trace.seconds)} s."]
