"""The HTML page of a campaign, one file that needs no network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import pyarrow as pa

from ..number_format import format_engineering, format_percent, format_significant
from ..reports import inline_charts as charts
from ..reports.html_markup import (
    TableColumn,
    bullet_list,
    download_links,
    escape_text,
    html_page,
    number_html,
    panel_groups,
    section,
    table,
)
from ..reports.robot_scene import choice_buttons, figures_container, legend_key
from ..robot.schema import Robot
from .campaign_figures import channel_description, column_label, figure_data, numeric_outputs, variant_label
from .campaign_plan import PARAMETER_NAMES, Distribution, Plan
from .campaign_summary import FlagProbability, SobolIndices, Spread, Summary
from .dataset_schema import RowColumn, series_columns
from .trace_summary import IdentifiedParameter, TraceSummary

PAGE_SCRIPTS = ("campaign.js",)
# Sobol indices below this are only in the summary.
MIN_SOBOL_INDEX = 0.05
OUTPUT_GROUPS = {
    "static_tension": "Static tension",
    "frequency": "Frequency",
    "damping_ratio": "Damping ratio",
    "stiffness": "Stiffness",
    "end": "Where it ends",
    "path_error": "Error of the path",
    "tension": "Tension",
}
FLAG_LABELS = {
    "held": "The cables hold it at rest",
    "slack": "A cable goes slack",
    "limit_broken": "A tension limit is broken",
}


def campaign_page(
    plan: Plan,
    robot: Robot,
    columns: Sequence[RowColumn],
    summary: Summary,
    rows: pa.Table,
    folder: Path,
    links: Mapping[str, str],
) -> str:
    """The page of a campaign over samples or a grid; ``links`` maps labels to paths beside the page."""
    figures = figure_data(plan, columns, robot.cable_count, summary, rows, folder)
    labels = [each["label"] for each in figures["variants"]]
    figure_sections = _bands_section(plan, robot) + _spreads_section(plan, columns)
    parts = [
        _masthead(plan, robot, summary, links),
        _probabilities(summary.probabilities),
        _inputs(plan),
        figures_container(choice_buttons("Path and controller", labels) if len(labels) > 1 else "", figure_sections),
        _sobol_section(summary.dependences),
        _spread_tables(summary.spreads),
        _failures(summary),
        section("notes", "Notes", bullet_list(summary.notes)) if summary.notes else "",
    ]
    return html_page(f"{robot.name}: {_headline(plan, summary)}", "\n".join(parts), figures, PAGE_SCRIPTS)


def trace_summary_page(plan: Plan, summary: TraceSummary, rows: pa.Table, links: Mapping[str, str]) -> str:
    """The page of a campaign of traces; its figures need no scripts."""
    counts = ", ".join(f"{count} {verdict}" for verdict, count in summary.verdicts) or "none could be traced"
    sentence = f"{summary.count} recordings: {counts}."
    kind, verdict = ("unexplained", f"{summary.failed} failed") if summary.failed else ("none", "All traced")
    header = (
        '<header><p class="eyebrow"><strong>Tautwire campaign</strong> '
        f"<span>{escape_text(Path(plan.file).stem)}</span></p>"
        '<p class="verdict '
        f'verdict-{kind}">{verdict}</p><h1>{escape_text(sentence)}</h1>{download_links(links)}</header>'
    )
    return html_page(sentence, "\n".join([header, _findings(summary.findings), _recordings(rows)]))


def _masthead(plan: Plan, robot: Robot, summary: Summary, links: Mapping[str, str]) -> str:
    verdict, kind = ("All runs came to their end", "none")
    if summary.failed:
        verdict, kind = f"{summary.failed} of {summary.count} runs failed", "unexplained"
    method_text = f"Method {plan.method}, seed {plan.seed}; {len(plan.inputs)} numbers vary."
    return (
        f'<header><p class="eyebrow"><strong>Tautwire campaign</strong> '
        f"<span>{escape_text(robot.name)}, {robot.cable_count} cables</span></p>"
        f'<p class="verdict verdict-{kind}">{escape_text(verdict)}</p><h1>{escape_text(_headline(plan, summary))}</h1>'
        f'<p class="aside">{number_html(method_text)}</p>{download_links(links)}</header>'
    )


def _headline(plan: Plan, summary: Summary) -> str:
    """The headline: number of runs, and the 95 % range of the path error or of the lowest frequency."""
    run_count_text = f"{summary.count} runs"
    for name, description in (
        ("path_error_largest", "the largest error of the path"),
        ("frequency_1", "the lowest frequency"),
    ):
        matching = [each for each in summary.spreads if each.name == name]
        if matching:
            spread = matching[0]
            variant = (
                f" ({variant_label(spread.path, spread.controller)})" if spread.path and len(plan.variants) > 1 else ""
            )
            low, high = spread.quantiles[0], spread.quantiles[-1]
            span = f"{format_engineering(low, spread.unit)} to {format_engineering(high, spread.unit)}"
            return f"{run_count_text}: in 95 % of them {description}{variant} is {span}."
    return f"{run_count_text}."


def _probabilities(probabilities: Sequence[FlagProbability]) -> str:
    if not probabilities:
        return ""
    columns = [
        TableColumn("What"),
        TableColumn("Path"),
        TableColumn("Probability", True),
        TableColumn(""),
        TableColumn("95 % interval", True, True),
    ]
    rows = [
        [
            escape_text(FLAG_LABELS.get(each.name, column_label(each.name))),
            escape_text(variant_label(each.path, each.controller)),
            number_html(format_percent(each.relative_frequency)),
            charts.bar(each.relative_frequency, 1.0),
            number_html(f"{format_percent(each.low)} to {format_percent(each.high)}, {each.times} of {each.count}"),
        ]
        for each in probabilities
    ]
    return section("probabilities", "How probable", table("Probabilities", columns, rows, "shares", True))


def _inputs(plan: Plan) -> str:
    if not plan.inputs:
        return ""
    descriptions = {each.key: _distribution_text(each.distribution) for each in plan.inputs}
    rows = [
        [escape_text(each.key), (escape_text if each.distribution.texts else number_html)(descriptions[each.key])]
        for each in plan.inputs
    ]
    rows += [
        [
            escape_text(f"{plan.keys[each.first]} and {plan.keys[each.second]}"),
            number_html(f"correlation {each.value:g}"),
        ]
        for each in plan.correlations
    ]
    return section(
        "inputs", "What varies", table("Inputs", [TableColumn("Number"), TableColumn("Distribution")], rows, "", True)
    )


def _distribution_text(distribution: Distribution) -> str:
    values = distribution.discrete_values
    if values:
        listed = ", ".join(distribution.texts[:6] or [f"{each:g}" for each in values[:6]])
        return f"{listed}, ... ({len(values)} values)" if len(values) > 6 else listed
    names = PARAMETER_NAMES[distribution.kind]
    parameters = ", ".join(f"{name} {value:g}" for name, value in zip(names, distribution.numbers, strict=True))
    return f"{distribution.kind}: {parameters}"


def _bands_section(plan: Plan, robot: Robot) -> str:
    if not plan.paths or plan.compute.series < 2:
        return ""
    groups: dict[str, list[tuple[int, str]]] = {}
    for index, name in enumerate(series_columns(robot.cable_count)):
        title, label, _ = channel_description(name)
        groups.setdefault(title, []).append((index, label))
    keys = f'<p class="keys">{legend_key("after", "median")}{legend_key("band", "the middle 95 % of runs")}</p>'
    return section("bands", "Over time", keys + panel_groups("band", groups, "Band over time"))


def _spreads_section(plan: Plan, columns: Sequence[RowColumn]) -> str:
    is_grid = plan.method == "grid"
    if is_grid and not plan.inputs:
        return ""
    groups: dict[str, list[tuple[int, str]]] = {}
    for index, column in enumerate(numeric_outputs(columns)):
        groups.setdefault(_output_group(column.name), []).append((index, column_label(column.name)))
    control = ""
    if is_grid:
        options = "".join(
            f'<option value="{place}">{escape_text(name)}</option>' for place, name in enumerate(plan.keys)
        )
        control = f'<p class="controls"><label>Over <select id="against">{options}</select></label></p>'
    kind, title, lead = (
        ("against", "Over the grid", "Each point is a run.")
        if is_grid
        else ("spread", "How outputs spread", "Dotted: median, and the ends of the middle 95 % of runs.")
    )
    return section("spreads", title, control + panel_groups(kind, groups, title), lead)


def _output_group(name: str) -> str:
    return next((title for prefix, title in OUTPUT_GROUPS.items() if name.startswith(prefix)), "Others")


def _sobol_section(dependences: Sequence[SobolIndices]) -> str:
    """A table of Sobol indices for each path and controller: for each output a row per influential input."""
    if not dependences:
        return ""
    columns = [
        TableColumn("Output"),
        TableColumn("Input"),
        TableColumn("Alone", True),
        TableColumn(""),
        TableColumn("In all", True),
    ]
    content = ""
    for path, controller in dict.fromkeys((each.path, each.controller) for each in dependences):
        variant_indices = [each for each in dependences if (each.path, each.controller) == (path, controller)]
        rows = [
            [escape_text(column_label(each.output)), escape_text(each.input), *_index_cells(each)]
            for output in dict.fromkeys(each.output for each in variant_indices)
            for each in sorted(
                (one for one in variant_indices if one.output == output), key=_largest_index, reverse=True
            )
            if _largest_index(each) >= MIN_SOBOL_INDEX
        ]
        content += table(variant_label(path, controller), columns, rows, "shares")
    lead = (
        "Sobol indices: the part of an output&rsquo;s variance that an input makes alone, and with all its "
        "interactions where the samples tell that; &plusmn; half the 95 % interval. "
        f"Those below {MIN_SOBOL_INDEX:g} are in the summary alone."
    )
    return section("dependences", "What outputs depend on", content, lead)


def _largest_index(each: SobolIndices) -> float:
    return max(each.first, each.total or 0.0)


def _index_cells(each: SobolIndices) -> tuple[str, str, str]:
    first = number_html(f"{each.first:.2f} \N{PLUS-MINUS SIGN} {each.first_width:.2f}")
    known = each.total is not None and each.total_width is not None
    total = number_html(f"{each.total:.2f} \N{PLUS-MINUS SIGN} {each.total_width:.2f}") if known else ""
    return first, charts.bar(max(0.0, min(each.first, 1.0)), 1.0), total


def _spread_tables(spreads: Sequence[Spread]) -> str:
    titles = ("Mean", "Deviation", "2.5 %", "Median", "97.5 %", "Least", "Largest")
    columns = [TableColumn("Output"), *(TableColumn(title, True) for title in titles)]
    content = ""
    for path, controller in dict.fromkeys((each.path, each.controller) for each in spreads):
        rows = [
            [escape_text(column_label(each.name)), *(_value_cell(value, each.unit) for value in _spread_values(each))]
            for each in spreads
            if (each.path, each.controller) == (path, controller)
        ]
        content += table(variant_label(path, controller), columns, rows, "extremes")
    return section("summary", "In figures", content) if content else ""


def _spread_values(each: Spread) -> tuple[float, ...]:
    low, _, middle, _, high = each.quantiles
    return (each.mean, each.standard_deviation, low, middle, high, each.least, each.largest)


def _value_cell(value: float, unit: str) -> str:
    return f'{number_html(format_significant(value, 4))} <span class="unit">{escape_text(unit)}</span>'


def _failures(summary: Summary) -> str:
    if not summary.failed:
        return ""
    rows = [[escape_text(reason), number_html(str(count))] for reason, count in summary.reasons]
    columns = [TableColumn("Reason"), TableColumn("Runs", True)]
    return section("failures", "Why runs failed", table("Failures", columns, rows, "", True))


def _findings(findings: Sequence[IdentifiedParameter]) -> str:
    """A table for each parameter of each effect: its interval in each recording, drawn on one scale."""
    content = ""
    for effect, cables, parameter in dict.fromkeys((f.effect, f.cables, f.parameter) for f in findings):
        same_parameter = [f for f in findings if (f.effect, f.cables, f.parameter) == (effect, cables, parameter)]
        cable_text = f", cables {', '.join(map(str, cables))}" if cables else ""
        columns = [
            TableColumn("Recording"),
            TableColumn("Value", True),
            TableColumn(""),
            TableColumn("95 % interval", True, True),
        ]
        rows = [
            [
                escape_text(each.recording),
                number_html(format_engineering(each.value, each.unit, 4)),
                charts.whisker(each.value, each.low or each.value, each.high or each.value, same_parameter[0].value),
                number_html(
                    f"{format_engineering(each.low, each.unit, 4)} to {format_engineering(each.high, each.unit, 4)}"
                ),
            ]
            for each in same_parameter
        ]
        content += table(f"{effect}: {column_label(parameter)}{cable_text}", columns, rows, "extremes")
    lead = "Each interval is drawn on a scale of its own; the tick is the first recording&rsquo;s value."
    return section("findings", "What was found", content, lead) if content else ""


def _recordings(rows: pa.Table) -> str:
    columns = [
        TableColumn("Recording"),
        TableColumn("Verdict"),
        TableColumn("Position before", True),
        TableColumn("after", True),
        TableColumn("Tension before", True),
        TableColumn("after", True),
        TableColumn("In words", False, True),
    ]
    names = (
        ("position_rms_before", "m"),
        ("position_rms_after", "m"),
        ("tension_rms_before", "N"),
        ("tension_rms_after", "N"),
    )
    cells = [
        [
            escape_text(row["recording"]),
            escape_text(row["verdict"] or "failed"),
            *(number_html(format_engineering(row[name], unit)) for name, unit in names),
            escape_text(row["sentence"] or row["failure"] or ""),
        ]
        for row in rows.to_pylist()
    ]
    return section("recordings", "Recording by recording", table("Recordings", columns, cells, "extremes", True))
