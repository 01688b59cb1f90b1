"""A trace on the terminal: tables that need neither colour nor more than 80 columns."""

from __future__ import annotations

import math

from rich import box
from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from ..errors import one_line
from ..estimation.trace_result import Candidate, Trace
from ..number_format import format_percent, format_significant
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

MAX_CANDIDATES_SHOWN = 5
CANDIDATES_CAPTION = """\
values and evidence are those of each round; above are those of all effects together
NIV: normalised innovation variance on unseen data, 1 for white noise
needs: evidence that one more effect needs there, if it acts where the first one does
less simple: more parameters than the one taken, or offsets in place of one load"""


def trace_table(trace: Trace) -> RenderableType:
    """The result of a trace, for a rich console."""
    blocks: list[RenderableType] = [
        Text(f"{VERDICTS[trace.verdict]}: {one_line(headline(trace))}", style="bold"),
        Text(noise_sentence(trace) + "\n"),
        _error_table(trace),
        _paragraph("Where, before any effect is fitted", [trace.components.sentence]),
    ]
    if trace.effects:
        blocks.append(_effect_table(trace))
        if rivals := runners_up(trace):
            blocks.append(_paragraph("Next best in the round of each, by its evidence there", rivals))
    if trace.formula:
        blocks.append(_paragraph("Formula", [trace.formula]))
    if trace.also_possible:
        blocks.append(_paragraph("The data fit these as well", alternative_texts(trace)))
    if commands := separating_commands(trace):
        blocks.append(_paragraph("A motion that would tell them apart", commands))
    if trace.verdict == "none" and trace.identifiability.detectable:
        never = undetectable_effects(trace)
        sizes = [*detectable_texts(trace), *([f"Never, whatever the size: {', '.join(never)}"] if never else [])]
        sizes += ["More shows in a motion by: tautwire excite robot.toml --out program.csv"]
        blocks.append(_paragraph("Visible would have been, nine times out of ten, at least", sizes))
    if trace.candidates:
        blocks.append(_candidate_table(trace))
    if trace.untried:
        blocks.append(_paragraph("Untried", list(trace.untried)))
    if trace.notes:
        blocks.append(_paragraph("Notes", list(trace.notes)))
    return Group(*blocks)


def _new_table(title: str) -> Table:
    return Table(
        title=title, title_justify="left", title_style="bold", box=box.SIMPLE, pad_edge=False, collapse_padding=True
    )


def _error_table(trace: Trace) -> Table:
    """Root mean square errors before and after on each recording, against the noise floor."""
    roles = [role for role in ROLES if comparison_by_role(trace, role)]
    table = _new_table("Error of the co-simulation (root mean square)")
    table.add_column("output", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    for role in roles:
        table.add_column(f"{role}\nbefore", justify="right", no_wrap=True)
        table.add_column("\nafter", justify="right", no_wrap=True)
    table.add_column("noise\nfloor", justify="right", no_wrap=True)
    table.add_column(f"{roles[-1]}:\nexplained" if roles else "explained", justify="right", no_wrap=True)
    for total_output, part_outputs in output_groups(trace.robot_before):
        for output in (total_output, *part_outputs):
            label = output.label if output is total_output else f"  {output.label}"
            table.add_row(label, output.unit, *_error_cells(trace, output, roles))
    return table


def _error_cells(trace: Trace, output: MeasuredOutput, roles: list[str]) -> list[str]:
    cells: list[str] = []
    share: float | None = None
    floor = output.error_of(trace.noise_floor)
    for role in roles:
        comparison = comparison_by_role(trace, role)
        if comparison:
            before, after = output.error_of(comparison.errors_before), output.error_of(comparison.errors_after)
            cells += [format_significant(before), format_significant(after)]
            share = explained_share(before, after, floor)
    return [*cells, format_significant(floor), format_percent(share)]


def _effect_table(trace: Trace) -> Table:
    table = _new_table("Found, with 95 % intervals")
    for heading in ("effect", "cables", "parameter"):
        table.add_column(heading, overflow="fold")
    for heading in ("value", "from", "to", "declared"):
        table.add_column(heading, justify="right", no_wrap=True)
    table.add_column("unit", no_wrap=True)
    for effect in trace.effects:
        cables = cables_text(effect.cables, trace.robot_before.cable_count).removesuffix(" cables")
        leading_cells = [Text(one_line(effect.name)), Text(cables.removeprefix("cables ").removeprefix("cable "))]
        for name, estimate in effect.parameters.items():
            text = format_estimate(estimate)
            numbers = (text.value, text.low, text.high, text.declared, text.unit)
            table.add_row(*leading_cells, Text(one_line(name)), *numbers)
            leading_cells = [Text(""), Text("")]
    return table


def _candidate_table(trace: Trace) -> Table:
    """The best few of each round; evidence in natural logarithms."""
    table = _new_table("What was tried (evidence: ln of the likelihood ratio on unseen data)")
    table.add_column("round", justify="right")
    table.add_column("added", overflow="fold")
    table.add_column("cables", overflow="fold")
    table.add_column("evidence", justify="right", no_wrap=True)
    table.add_column("NIV", justify="right", no_wrap=True)
    table.add_column("", no_wrap=True)
    table.add_column("values", overflow="fold", ratio=1)
    caption = CANDIDATES_CAPTION
    hidden_count = 0
    for round_number, candidates in candidates_by_round(trace.candidates):
        fitted = [candidate for candidate in candidates if math.isfinite(candidate.mean_square)][:MAX_CANDIDATES_SHOWN]
        for index, candidate in enumerate(fitted):
            label = str(round_number) if index == 0 else ""
            status = candidate_status(candidate, candidates)
            table.add_row(label, *_candidate_cells(candidate, status, trace.robot_before.cable_count))
        if not fitted:
            table.add_row(str(round_number), *["-"] * 5, "no predicted gain was large enough for a fit")
        hidden_count += len(candidates) - len(fitted)
    if hidden_count:
        caption += f"\n{hidden_count} more with less evidence, or not fitted: in report.json and on the page"
    table.caption, table.caption_justify = caption, "left"
    return table


def _candidate_cells(candidate: Candidate, status: str, cable_count: int) -> list[Text]:
    cables = cables_text(candidate.cables, cable_count).removesuffix(" cables")
    return [
        Text(one_line(candidate.name)),
        Text(cables.removeprefix("cables ").removeprefix("cable ")),
        Text(format_evidence(candidate.evidence)),
        Text(format_significant(candidate.mean_square)),
        Text(status),
        Text(one_line(values_text(candidate.name, candidate.form_values))),
    ]


def _paragraph(title: str, lines: list[str]) -> Group:
    """A heading with one point a line."""
    points = [Padding(Text(f"- {one_line(line)}"), (0, 0, 0, 2)) for line in lines]
    return Group(Text(f"\n{title}", style="bold"), *points)
