"""The HTML page of a campaign, one file that needs no network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pyarrow as pa

from ..number_format import (
    ABSENT_TEXT,
    digits_for_range,
    format_engineering,
    format_on_page,
    format_percent,
    format_significant,
    page_unit,
)
from ..provenance import Provenance
from ..reports import inline_charts as charts
from ..reports.page_rendering import Number, PageHeader, Row, render_page
from ..robot.schema import Robot
from .campaign_figures import (
    CampaignResults,
    channel_description,
    column_label,
    figure_data,
    numeric_outputs,
    variant_label,
)
from .campaign_heat_map import HEAT_KEYS, sobol_heat_maps
from .campaign_plan import PARAMETER_NAMES, Distribution, Plan
from .campaign_summary import FlagProbability, SobolIndices, Spread, Summary
from .dataset_schema import RowColumn
from .platform_rotations import summary_channels
from .trace_summary import IdentifiedParameter, TraceSummary

# Sobol indices below this are only in the summary.
MIN_SOBOL_INDEX = 0.05
NO_SIGNIFICANT_INDEX = "none that can be told from 0"
OUTPUT_GROUPS = {
    "static_tension": "Static tension",
    "frequency": "Frequency",
    "damping_ratio": "Damping ratio",
    "stiffness": "Stiffness",
    "end_rotation": "End rotation",
    "end": "End position",
    "path_error_angle": "Orientation error",
    "path_error": "Path error",
    "tension": "Tension",
}
FLAG_LABELS = {
    "held": "Static equilibrium exists",
    "slack": "A cable goes slack",
    "limit_broken": "A tension limit is violated",
}


def campaign_page(
    plan: Plan,
    robot: Robot,
    results: CampaignResults,
    links: Mapping[str, str],
    provenance: Provenance | None = None,
) -> str:
    """The page of a campaign over samples or a grid; ``links`` maps labels to paths beside the page."""
    figures, summary = figure_data(plan, robot.cable_count, results), results.summary
    subject, headline = f"{robot.name}, {robot.cable_count} cables", _headline(plan, summary)
    verdict = ("All runs completed", "none")
    if summary.failed:
        verdict = (f"{summary.failed} of {summary.count} runs failed", "unexplained")
    return render_page(
        "campaign",
        PageHeader("Tautwire campaign", subject, headline, f"{robot.name}: {headline}", *verdict, links, provenance),
        figures,
        plan=plan,
        variants=[each["label"] for each in figures["variants"]],
        probabilities=[_probability_row(each) for each in summary.probabilities],
        inputs=_input_rows(plan),
        band_panels=_band_panels(plan, robot),
        output_panels=_output_panels(plan, results.columns),
        dependences=_sobol_rows(summary.dependences),
        heat_maps=sobol_heat_maps(summary.dependences),
        heat_keys=HEAT_KEYS,
        min_sobol_index=f"{MIN_SOBOL_INDEX:g}",
        spreads=_spread_rows(summary.spreads),
        failures=[[reason, Number(str(count))] for reason, count in summary.reasons] if summary.failed else [],
        notes=summary.notes,
    )


def _headline(plan: Plan, summary: Summary) -> str:
    """The headline: runs of each controller, and the 95 % ranges of the path error or of the lowest frequency."""
    run_count_text = f"{summary.count} runs"
    if len(plan.controllers) > 1:
        run_count_text = (
            f"{summary.count // len(plan.controllers)} runs with each of {len(plan.controllers)} controllers"
        )
    for name, description in (
        ("path_error_largest", "the largest path error"),
        ("frequency_1", "the lowest frequency"),
    ):
        matching = [each for each in summary.spreads if each.name == name]
        if matching:
            along = f" along {matching[0].path}" if len(plan.paths) > 1 else ""
            compared = [each for each in matching if each.path == matching[0].path]
            spans = ", ".join(_span_text(each, named=len(compared) > 1) for each in compared)
            return f"{run_count_text}: in 95 % of them {description}{along} is {spans}."
    return f"{run_count_text}."


def _span_text(spread: Spread, named: bool) -> str:
    low, high = (format_on_page(value, spread.unit) for value in (spread.quantiles[0], spread.quantiles[-1]))
    return f"{low} to {high}" + (f" ({spread.controller})" if named else "")


def _probability_row(each: FlagProbability) -> Row:
    interval = f"{format_percent(each.low)} to {format_percent(each.high)}, {each.times} of {each.count}"
    return [
        FLAG_LABELS.get(each.name, column_label(each.name)),
        variant_label(each.path, each.controller),
        Number(format_percent(each.relative_frequency)),
        charts.bar(each.relative_frequency, 1.0),
        Number(interval),
    ]


def _input_rows(plan: Plan) -> list[Row]:
    """The distribution of each input, and the correlations between them."""
    rows: list[Row] = []
    for each in plan.inputs:
        text = _distribution_text(each.distribution)
        rows.append([each.key, text if each.distribution.texts else Number(text)])
    rows += [
        [f"{plan.keys[each.first]} and {plan.keys[each.second]}", Number(f"correlation {each.value:g}")]
        for each in plan.correlations
    ]
    return rows if plan.inputs else []


def _distribution_text(distribution: Distribution) -> str:
    values = distribution.discrete_values
    if values:
        listed = ", ".join(distribution.texts[:6] or [f"{each:g}" for each in values[:6]])
        return f"{listed}, ... ({len(values)} values)" if len(values) > 6 else listed
    names = PARAMETER_NAMES[distribution.kind]
    parameters = ", ".join(f"{name} {value:g}" for name, value in zip(names, distribution.numbers, strict=True))
    return f"{distribution.kind}: {parameters}"


def _band_panels(plan: Plan, robot: Robot) -> dict[str, list[tuple[int, str]]]:
    """Channel indices and labels of the bands over time, by quantity; empty where nothing moves."""
    groups: dict[str, list[tuple[int, str]]] = {}
    if plan.paths and plan.compute.series > 1:
        for index, name in enumerate(summary_channels(plan, robot.cable_count)):
            title, label, _ = channel_description(name)
            groups.setdefault(title, []).append((index, label))
    return groups


def _output_panels(plan: Plan, columns: Sequence[RowColumn]) -> dict[str, list[tuple[int, str]]]:
    """Indices and labels of the numeric outputs, by group; empty for a grid without inputs."""
    groups: dict[str, list[tuple[int, str]]] = {}
    if plan.inputs or plan.method != "grid":
        for index, column in enumerate(numeric_outputs(columns)):
            groups.setdefault(_output_group(column.name), []).append((index, column_label(column.name)))
    return groups


def _output_group(name: str) -> str:
    return next((title for prefix, title in OUTPUT_GROUPS.items() if name.startswith(prefix)), "Others")


def _sobol_rows(dependences: Sequence[SobolIndices]) -> dict[str, list[Row]]:
    """Sobol indices by path and controller, and by output: a row per influential input, the largest first."""
    tables: dict[str, list[Row]] = {}
    for path, controller, output in dict.fromkeys((each.path, each.controller, each.output) for each in dependences):
        significant = [
            each
            for each in dependences
            if (each.path, each.controller, each.output) == (path, controller, output) and each.is_significant
        ]
        rows = tables.setdefault(variant_label(path, controller), [])
        if significant:
            influential = [each for each in significant if _largest_index(each) >= MIN_SOBOL_INDEX]
            rows += [_sobol_row(each) for each in sorted(influential, key=_largest_index, reverse=True)]
        else:
            rows.append([column_label(output), NO_SIGNIFICANT_INDEX, "", "", ""])
    return tables


def _largest_index(each: SobolIndices) -> float:
    """The largest of the indices whose intervals exclude 0."""
    return max(
        each.first if each.is_first_significant else 0.0, (each.total or 0.0) if each.is_total_significant else 0.0
    )


def _sobol_row(each: SobolIndices) -> Row:
    """The indices with their half-widths, dashes for those whose intervals contain 0."""
    first = f"{each.first:.2f} ± {each.first_width:.2f}" if each.is_first_significant else ABSENT_TEXT
    total = f"{each.total:.2f} ± {each.total_width:.2f}" if each.is_total_significant else ABSENT_TEXT
    return [
        column_label(each.output),
        each.input,
        Number(first),
        charts.bar(min(each.first, 1.0), 1.0) if each.is_first_significant else "",
        "" if each.total is None else Number(total),
    ]


def _spread_rows(spreads: Sequence[Spread]) -> dict[str, list[Row]]:
    """Mean, deviation, quantiles and extremes of each output, by path and controller."""
    tables: dict[str, list[Row]] = {}
    for each in spreads:
        tables.setdefault(variant_label(each.path, each.controller), []).append(_spread_row(each))
    return tables


def _spread_row(each: Spread) -> Row:
    """The statistics in the page's unit, coordinates to more digits where they differ little."""
    unit, unit_size = page_unit(each.unit)
    digits = digits_for_range(each.least, each.largest) if each.unit == "m" else 4
    low, _, middle, _, high = each.quantiles
    mean, *rest = (
        Number(format_significant(value / unit_size, digits), unit)
        for value in (each.mean, low, middle, high, each.least, each.largest)
    )
    deviation = Number(format_significant(each.standard_deviation / unit_size, 4), unit)
    return [column_label(each.name), mean, deviation, *rest]


def trace_summary_page(
    plan: Plan,
    summary: TraceSummary,
    rows: pa.Table,
    links: Mapping[str, str],
    provenance: Provenance | None = None,
) -> str:
    """The page of a campaign of traces; its figures need no scripts."""
    counts = ", ".join(f"{count} {verdict}" for verdict, count in summary.verdicts) or "none could be traced"
    sentence = f"{summary.count} recordings: {counts}."
    verdict = (f"{summary.failed} failed", "unexplained") if summary.failed else ("All traced", "none")
    header = PageHeader("Tautwire campaign", Path(plan.file).stem, sentence, sentence, *verdict, links, provenance)
    recordings = [_recording_row(row) for row in rows.to_pylist()]
    return render_page("trace_summary", header, findings=_finding_rows(summary.findings), recordings=recordings)


def _finding_rows(findings: Sequence[IdentifiedParameter]) -> dict[str, list[Row]]:
    """For each parameter of each effect, its interval in each recording, with the first recording's value as a tick."""
    tables: dict[str, list[Row]] = {}
    for effect, cables, parameter in dict.fromkeys((f.effect, f.cables, f.parameter) for f in findings):
        same_parameter = [f for f in findings if (f.effect, f.cables, f.parameter) == (effect, cables, parameter)]
        cable_text = f", cables {', '.join(map(str, cables))}" if cables else ""
        tables[f"{effect}: {column_label(parameter)}{cable_text}"] = [
            _finding_row(each, same_parameter[0].value) for each in same_parameter
        ]
    return tables


def _finding_row(each: IdentifiedParameter, reference: float) -> Row:
    value, low, high = (format_engineering(number, each.unit, 4) for number in (each.value, each.low, each.high))
    chart = charts.whisker(each.value, each.low or each.value, each.high or each.value, reference)
    return [each.recording, Number(value), chart, Number(f"{low} to {high}")]


def _recording_row(row: Mapping[str, Any]) -> Row:
    columns = (("position", "m"), ("tension", "N"))
    return [
        row["recording"],
        row["verdict"] or "failed",
        *(
            Number(format_on_page(row[f"{quantity}_rms_{when}"], unit))
            for quantity, unit in columns
            for when in ("before", "after")
        ),
        row["sentence"] or row["failure"] or "",
    ]
