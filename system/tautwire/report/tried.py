"""The section of the page that ranks the candidates, with the evidence for each."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..runs.wiring import PLATFORM
from ..tracer.verdict import Candidate, Trace
from . import charts
from .markup import TableColumn, escape_text, number_html, section, table
from .summary import cables_text, candidates_by_round, format_evidence, values_text
from .units import format_significant

MAX_ROWS_SHOWN = 8
FITTED_COLUMNS = (
    TableColumn("Effect"), TableColumn("Where"), TableColumn("Evidence", True), TableColumn("On unseen data"), TableColumn("Left", True),
    TableColumn("Values", wide=True), TableColumn("Status"),
)  # fmt: skip
UNFITTED_COLUMNS = (TableColumn("Effect"), TableColumn("Where"), TableColumn("Values", wide=True))


def candidates_section(trace: Trace) -> str:
    """The candidates of each round of the search, the best first."""
    lead = (
        "One effect at a time, fitted on one part of the data and judged on another, by its evidence there. Left is "
        "what its predictions still miss there, as a mean square in times of what noise makes it: 1 is noise."
    )
    max_evidence = max((each.evidence for each in trace.candidates if math.isfinite(each.evidence)), default=0.0)
    content = "".join(
        _round_section(trace, round_number, group, max_evidence)
        for round_number, group in candidates_by_round(trace.candidates)
    )
    return section("candidates", "What was tried", content or "<p>Nothing was tried.</p>", lead)


def _round_section(trace: Trace, round_number: int, group: Sequence[Candidate], max_evidence: float) -> str:
    """One round: the fitted candidates as a table, the others folded away; ``max_evidence`` scales the bars."""
    fitted = [_fitted_row(trace, each, max_evidence) for each in group if math.isfinite(each.mean_square)]
    others = [_unfitted_row(trace, each) for each in group if not math.isfinite(each.mean_square)]
    content = ""
    if fitted:
        content += table(f"Round {round_number}", FITTED_COLUMNS, fitted[:MAX_ROWS_SHOWN], "candidates")
    else:
        content += f"<h3>Round {round_number}</h3><p>Nothing promised enough to be fitted.</p>"
    if hidden_rows := fitted[MAX_ROWS_SHOWN:]:
        folded = table(f"Round {round_number}, the others", FITTED_COLUMNS, hidden_rows, "candidates", True)
        content += f"<details><summary>{len(hidden_rows)} more with less evidence</summary>{folded}</details>"
    if others:
        folded = table(f"Round {round_number}, not fitted", UNFITTED_COLUMNS, others, "others", True)
        reason = "it promised" if len(others) == 1 else "they promised"
        content += f"<details><summary>{len(others)} not fitted, {reason} too little</summary>{folded}</details>"
    return content


def _fitted_row(trace: Trace, candidate: Candidate, max_evidence: float) -> list[str]:
    css_class = "after" if candidate.accepted else "before"
    return [
        escape_text(candidate.name),
        escape_text(_candidate_location(trace, candidate)),
        number_html(format_evidence(candidate.evidence)),
        charts.bar(candidate.evidence, max_evidence, css_class=css_class),
        number_html(format_significant(candidate.mean_square)),
        number_html(values_text(candidate.name, candidate.values)),
        '<span class="taken">taken</span>' if candidate.accepted else "",
    ]


def _unfitted_row(trace: Trace, candidate: Candidate) -> list[str]:
    return [
        escape_text(candidate.name),
        escape_text(_candidate_location(trace, candidate)),
        number_html(values_text(candidate.name, candidate.values)),
    ]


def _candidate_location(trace: Trace, candidate: Candidate) -> str:
    return cables_text(candidate.cables, trace.robot_before.cable_count) if candidate.cables else PLATFORM
