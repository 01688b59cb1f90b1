"""The part of the page that ranks what was tried, with the evidence for each."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..runs.wiring import PLATFORM
from ..tracer.verdict import Candidate, Trace
from . import charts
from .markup import Column, number, section, table, text
from .summary import cables_text, evidence_text, ranking, values_text
from .units import significant

SHOWN = 8
FITTED_COLUMNS = (
    Column("Effect"), Column("Where"), Column("Evidence", True), Column("On unseen data"), Column("Left", True),
    Column("Values", wide=True), Column("Status"),
)  # fmt: skip
OTHER_COLUMNS = (Column("Effect"), Column("Where"), Column("Values", wide=True))


def tried(trace: Trace) -> str:
    """What was tried in each round, the best first."""
    lead = (
        "One effect at a time, fitted on one part of the data and judged on another, by its evidence there. Left is "
        "what its predictions still miss there, as a mean square in times of what noise makes it: 1 is noise."
    )
    largest = max((each.evidence for each in trace.candidates if math.isfinite(each.evidence)), default=0.0)
    content = "".join(_round(trace, place, group, largest) for place, group in ranking(trace.candidates))
    return section("candidates", "What was tried", content or "<p>Nothing was tried.</p>", lead)


def _round(trace: Trace, place: int, group: Sequence[Candidate], largest: float) -> str:
    """One round: the table of what was fitted, and folded away what was not worth it; ``largest`` fills a bar."""
    fitted = [_fitted_row(trace, each, largest) for each in group if math.isfinite(each.mean_square)]
    others = [_other_row(trace, each) for each in group if not math.isfinite(each.mean_square)]
    content = ""
    if fitted:
        content += table(f"Round {place}", FITTED_COLUMNS, fitted[:SHOWN], "candidates")
    else:
        content += f"<h3>Round {place}</h3><p>Nothing promised enough to be fitted.</p>"
    if rest := fitted[SHOWN:]:
        folded = table(f"Round {place}, the others", FITTED_COLUMNS, rest, "candidates", True)
        content += f"<details><summary>{len(rest)} more with less evidence</summary>{folded}</details>"
    if others:
        folded = table(f"Round {place}, not fitted", OTHER_COLUMNS, others, "others", True)
        said = "it promised" if len(others) == 1 else "they promised"
        content += f"<details><summary>{len(others)} not fitted, {said} too little</summary>{folded}</details>"
    return content


def _fitted_row(trace: Trace, candidate: Candidate, largest: float) -> list[str]:
    name = "after" if candidate.accepted else "before"
    return [
        text(candidate.name),
        text(_where(trace, candidate)),
        number(evidence_text(candidate.evidence)),
        charts.bar(candidate.evidence, largest, name=name),
        number(significant(candidate.mean_square)),
        number(values_text(candidate.name, candidate.values)),
        '<span class="taken">taken</span>' if candidate.accepted else "",
    ]


def _other_row(trace: Trace, candidate: Candidate) -> list[str]:
    return [
        text(candidate.name),
        text(_where(trace, candidate)),
        number(values_text(candidate.name, candidate.values)),
    ]


def _where(trace: Trace, candidate: Candidate) -> str:
    return cables_text(candidate.cables, trace.robot_before.cable_count) if candidate.cables else PLATFORM
