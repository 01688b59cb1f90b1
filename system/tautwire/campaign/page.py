"""A campaign as one HTML page that needs no network, in the style of the other reports."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import pyarrow as pa

from ..report import charts
from ..report.markup import Column, bullets, downloads, number, section, table, text
from ..report.panels import panel_groups
from ..report.scene import chooser, figures_body, key
from ..report.shell import html_page
from ..report.units import engineering, percent, significant
from ..robots.robot import Robot
from .distributions import SHAPES, Distribution
from .figures import channel_kind, figures_of, label_of, numbers_shown, variant_label
from .plan import Plan
from .rows import RowColumn, series_columns
from .season import Finding, Season
from .summary import Dependence, Probability, Spread, Summary

SCRIPTS = ("campaign.js",)
# Sobol indices below this are in the summary alone.
SMALLEST_SHARE = 0.05
GROUPS = {
    "static_tension": "Static tension",
    "frequency": "Frequency",
    "damping_ratio": "Damping ratio",
    "stiffness": "Stiffness",
    "end": "Where it ends",
    "path_error": "Error of the path",
    "tension": "Tension",
}
WORDS = {
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
    figures = figures_of(plan, columns, robot.cable_count, summary, rows, folder)
    labels = [each["label"] for each in figures["variants"]]
    drawn = _bands_section(plan, robot) + _spreads_section(plan, columns)
    parts = [
        _masthead(plan, robot, summary, links),
        _probabilities(summary.probabilities),
        _inputs(plan),
        figures_body(chooser("Path and controller", labels) if len(labels) > 1 else "", drawn),
        _dependences(summary.dependences),
        _spreads_tables(summary.spreads),
        _failures(summary),
        section("notes", "Notes", bullets(summary.notes)) if summary.notes else "",
    ]
    return html_page(f"{robot.name}: {_sentence(plan, summary)}", "\n".join(parts), figures, SCRIPTS)


def season_page(plan: Plan, season: Season, rows: pa.Table, links: Mapping[str, str]) -> str:
    """The page of a campaign of traces; no figure of it needs scripts."""
    counts = ", ".join(f"{count} {verdict}" for verdict, count in season.verdicts) or "none could be traced"
    sentence = f"{season.count} recordings: {counts}."
    kind, verdict = ("unexplained", f"{season.failed} failed") if season.failed else ("none", "All traced")
    header = (
        f'<header><p class="eyebrow"><strong>Tautwire campaign</strong> <span>{text(Path(plan.file).stem)}</span></p>'
        f'<p class="verdict verdict-{kind}">{verdict}</p><h1>{text(sentence)}</h1>{downloads(links)}</header>'
    )
    return html_page(sentence, "\n".join([header, _findings(season.findings), _recordings(rows)]))


def _masthead(plan: Plan, robot: Robot, summary: Summary, links: Mapping[str, str]) -> str:
    verdict, kind = ("All runs came to their end", "none")
    if summary.failed:
        verdict, kind = f"{summary.failed} of {summary.count} runs failed", "unexplained"
    how = f"Method {plan.method}, seed {plan.seed}; {len(plan.inputs)} numbers vary."
    return (
        f'<header><p class="eyebrow"><strong>Tautwire campaign</strong> '
        f"<span>{text(robot.name)}, {robot.cable_count} cables</span></p>"
        f'<p class="verdict verdict-{kind}">{text(verdict)}</p><h1>{text(_sentence(plan, summary))}</h1>'
        f'<p class="aside">{number(how)}</p>{downloads(links)}</header>'
    )


def _sentence(plan: Plan, summary: Summary) -> str:
    """What there is to know first: how many runs, and how sure the lowest frequency or the path is."""
    said = f"{summary.count} runs"
    for name, what in (
        ("path_error_largest", "the largest error of the path"),
        ("frequency_1", "the lowest frequency"),
    ):
        found = [each for each in summary.spreads if each.name == name]
        if found:
            best = found[0]
            whose = f" ({variant_label(best.path, best.controller)})" if best.path and len(plan.variants) > 1 else ""
            low, high = best.quantiles[0], best.quantiles[-1]
            span = f"{engineering(low, best.unit)} to {engineering(high, best.unit)}"
            return f"{said}: in 95 % of them {what}{whose} is {span}."
    return f"{said}."


def _probabilities(found: Sequence[Probability]) -> str:
    if not found:
        return ""
    columns = [
        Column("What"),
        Column("Path"),
        Column("Probability", True),
        Column(""),
        Column("95 % interval", True, True),
    ]
    rows = [
        [
            text(WORDS.get(each.name, label_of(each.name))),
            text(variant_label(each.path, each.controller)),
            number(percent(each.share)),
            charts.bar(each.share, 1.0),
            number(f"{percent(each.low)} to {percent(each.high)}, {each.times} of {each.count}"),
        ]
        for each in found
    ]
    return section("probabilities", "How probable", table("Probabilities", columns, rows, "shares", True))


def _inputs(plan: Plan) -> str:
    if not plan.inputs:
        return ""
    told = {each.key: _distribution(each.distribution) for each in plan.inputs}
    rows = [[text(each.key), (text if each.distribution.texts else number)(told[each.key])] for each in plan.inputs]
    rows += [
        [text(f"{plan.keys[each.first]} and {plan.keys[each.second]}"), number(f"correlation {each.value:g}")]
        for each in plan.correlations
    ]
    return section("inputs", "What varies", table("Inputs", [Column("Number"), Column("Distribution")], rows, "", True))


def _distribution(distribution: Distribution) -> str:
    steps = distribution.steps
    if steps:
        shown = ", ".join(distribution.texts[:6] or [f"{each:g}" for each in steps[:6]])
        return f"{shown}, ... ({len(steps)} values)" if len(steps) > 6 else shown
    names = SHAPES[distribution.kind]
    told = ", ".join(f"{name} {value:g}" for name, value in zip(names, distribution.numbers, strict=True))
    return f"{distribution.kind}: {told}"


def _bands_section(plan: Plan, robot: Robot) -> str:
    if not plan.paths or plan.compute.series < 2:
        return ""
    groups: dict[str, list[tuple[int, str]]] = {}
    for place, name in enumerate(series_columns(robot.cable_count)):
        title, label, _ = channel_kind(name)
        groups.setdefault(title, []).append((place, label))
    keys = f'<p class="keys">{key("after", "median")}{key("band", "the middle 95 % of runs")}</p>'
    return section("bands", "Over time", keys + panel_groups("band", groups, "Band over time"))


def _spreads_section(plan: Plan, columns: Sequence[RowColumn]) -> str:
    is_grid = plan.method == "grid"
    if is_grid and not plan.inputs:
        return ""
    groups: dict[str, list[tuple[int, str]]] = {}
    for place, column in enumerate(numbers_shown(columns)):
        groups.setdefault(_group(column.name), []).append((place, label_of(column.name)))
    control = ""
    if is_grid:
        options = "".join(f'<option value="{place}">{text(name)}</option>' for place, name in enumerate(plan.keys))
        control = f'<p class="controls"><label>Over <select id="against">{options}</select></label></p>'
    kind, title, lead = (
        ("against", "Over the grid", "Each point is a run.")
        if is_grid
        else ("spread", "How outputs spread", "Dotted: median, and the ends of the middle 95 % of runs.")
    )
    return section("spreads", title, control + panel_groups(kind, groups, title), lead)


def _group(name: str) -> str:
    return next((title for prefix, title in GROUPS.items() if name.startswith(prefix)), "Others")


def _dependences(found: Sequence[Dependence]) -> str:
    """A table for each path and controller: for each output a row for each input that makes much of it."""
    if not found:
        return ""
    columns = [Column("Output"), Column("Input"), Column("Alone", True), Column(""), Column("In all", True)]
    content = ""
    for path, controller in dict.fromkeys((each.path, each.controller) for each in found):
        here = [each for each in found if (each.path, each.controller) == (path, controller)]
        rows = [
            [text(label_of(each.output)), text(each.input), *_index(each)]
            for output in dict.fromkeys(each.output for each in here)
            for each in sorted((one for one in here if one.output == output), key=_share, reverse=True)
            if _share(each) >= SMALLEST_SHARE
        ]
        content += table(variant_label(path, controller), columns, rows, "shares")
    lead = (
        "Sobol indices: the part of an output&rsquo;s variance that an input makes alone, and with all its "
        "interactions where the samples tell that; &plusmn; half the 95 % interval. "
        f"Those below {SMALLEST_SHARE:g} are in the summary alone."
    )
    return section("dependences", "What outputs depend on", content, lead)


def _share(each: Dependence) -> float:
    return max(each.first, each.total or 0.0)


def _index(each: Dependence) -> tuple[str, str, str]:
    first = number(f"{each.first:.2f} \N{PLUS-MINUS SIGN} {each.first_width:.2f}")
    known = each.total is not None and each.total_width is not None
    total = number(f"{each.total:.2f} \N{PLUS-MINUS SIGN} {each.total_width:.2f}") if known else ""
    return first, charts.bar(max(0.0, min(each.first, 1.0)), 1.0), total


def _spreads_tables(spreads: Sequence[Spread]) -> str:
    titles = ("Mean", "Deviation", "2.5 %", "Median", "97.5 %", "Least", "Largest")
    columns = [Column("Output"), *(Column(title, True) for title in titles)]
    content = ""
    for path, controller in dict.fromkeys((each.path, each.controller) for each in spreads):
        rows = [
            [text(label_of(each.name)), *(_value(value, each.unit) for value in _numbers(each))]
            for each in spreads
            if (each.path, each.controller) == (path, controller)
        ]
        content += table(variant_label(path, controller), columns, rows, "extremes")
    return section("summary", "In figures", content) if content else ""


def _numbers(each: Spread) -> tuple[float, ...]:
    low, _, middle, _, high = each.quantiles
    return (each.mean, each.standard_deviation, low, middle, high, each.least, each.largest)


def _value(value: float, unit: str) -> str:
    return f'{number(significant(value, 4))} <span class="unit">{text(unit)}</span>'


def _failures(summary: Summary) -> str:
    if not summary.failed:
        return ""
    rows = [[text(reason), number(str(count))] for reason, count in summary.reasons]
    columns = [Column("Reason"), Column("Runs", True)]
    return section("failures", "Why runs failed", table("Failures", columns, rows, "", True))


def _findings(findings: Sequence[Finding]) -> str:
    """A table for each parameter of each effect: its interval in each recording, drawn on one scale."""
    content = ""
    for effect, cables, parameter in dict.fromkeys((f.effect, f.cables, f.parameter) for f in findings):
        here = [f for f in findings if (f.effect, f.cables, f.parameter) == (effect, cables, parameter)]
        on = f", cables {', '.join(map(str, cables))}" if cables else ""
        columns = [Column("Recording"), Column("Value", True), Column(""), Column("95 % interval", True, True)]
        rows = [
            [
                text(each.recording),
                number(engineering(each.value, each.unit, 4)),
                charts.whisker(each.value, each.low or each.value, each.high or each.value, here[0].value),
                number(f"{engineering(each.low, each.unit, 4)} to {engineering(each.high, each.unit, 4)}"),
            ]
            for each in here
        ]
        content += table(f"{effect}: {label_of(parameter)}{on}", columns, rows, "extremes")
    lead = "Each interval is drawn on a scale of its own; the tick is the first recording&rsquo;s value."
    return section("findings", "What was found", content, lead) if content else ""


def _recordings(rows: pa.Table) -> str:
    columns = [
        Column("Recording"), Column("Verdict"), Column("Position before", True), Column("after", True),
        Column("Tension before", True), Column("after", True), Column("In words", False, True),
    ]  # fmt: skip
    names = (
        ("position_rms_before", "m"),
        ("position_rms_after", "m"),
        ("tension_rms_before", "N"),
        ("tension_rms_after", "N"),
    )
    cells = [
        [
            text(row["recording"]),
            text(row["verdict"] or "failed"),
            *(number(engineering(row[name], unit)) for name, unit in names),
            text(row["sentence"] or row["failure"] or ""),
        ]
        for row in rows.to_pylist()
    ]
    return section("recordings", "Recording by recording", table("Recordings", columns, cells, "extremes", True))
