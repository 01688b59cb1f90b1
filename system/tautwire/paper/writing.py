"""Runs all that the paper computes, and writes figures, ledger and page."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from ..materials import RobotMaterial
from ..tracer.workers import Workers, processors
from . import beyond, helix, large_robots, ramps, tried
from .beyond_figures import draw_beyond
from .claims import Entry, axis_claims, judged, text_claims
from .material import MaterialRuns, printed_rope, quantities, relaxing_rope, run_material
from .material_figures import draw_material
from .page import Content, paper_page
from .panels import axis_values, draw_time_figures
from .parameters import SETS, Parameters, SetName, read_parameters
from .records import Case, Record, Tell, run_case
from .spaces import draw_spaces
from .style import style, write_figures
from .table_1 import table_entries
from .tried import Trials, trials
from .values import Values

PARTS = (helix, large_robots, ramps)
MOST_PROCESSES = 2


@dataclass(frozen=True)
class PaperRuns:
    """All runs of one set of parameters, with section 3 and the numbers that come of them."""

    parameters: Parameters
    records: Mapping[str, Record]
    material: MaterialRuns
    values: Values


@dataclass(frozen=True)
class Paper:
    """All that came out."""

    runs: Mapping[SetName, PaperRuns] = field(repr=False)
    entries: tuple[Entry, ...] = field(repr=False)

    @property
    def counts(self) -> Mapping[str, int]:
        """How many claims have each verdict."""
        return Counter(entry.verdict for entry in self.entries)


def write_paper(folder: Path, tell: Tell) -> Paper:
    """Run everything and write ``claims.json``, ``claims.html`` and all figures into an existing folder.

    Raises RunError where an FMU fails.
    """
    with Workers(min(processors(), MOST_PROCESSES)) as workers:
        paper = run_paper(workers, tell)
    runs = paper.runs["corrected"]
    tell("comparing ropes on a drum", 0.0)
    sizes = beyond.compare_sizes(runs.parameters, runs.records)
    with style():
        extra = tuple(draw_beyond(runs.records, sizes))
        drawn = [
            *draw_material({name: each.material for name, each in paper.runs.items()}),
            *draw_time_figures(runs.records),
            *draw_spaces(runs.parameters, runs.records),
            *(each.drawn for each in extra),
        ]
        svgs = write_figures(drawn, folder, partial(tell, "drawing"))
    _write(folder, paper.entries, Content(paper.entries, drawn, svgs, _trials(runs), extra))
    return paper


def run_paper(workers: Workers, tell: Tell) -> Paper:
    """All runs, those with the corrected parameters also of what was tried and of what goes beyond the paper."""
    parameters = {name: read_parameters(name) for name in SETS}
    ropes: dict[SetName, RobotMaterial] = {"printed": printed_rope(), "corrected": relaxing_rope()}
    cases = {(name, key): case for name in SETS for key, case in _cases(parameters[name])}
    extra = (*tried.cases(parameters["corrected"]), *beyond.cases(parameters["corrected"], ropes["corrected"]))
    cases |= {("corrected", key): case for key, case in extra}
    pulled = {name: workers.start(run_material, rope) for name, rope in ropes.items()}
    records = _run(cases, workers, tell)
    runs = {}
    for name in SETS:
        own = {key: record for (which, key), record in records.items() if which == name}
        runs[name] = _collected(parameters[name], own, pulled[name].result())
    claims = (*text_claims(), *axis_claims())
    rows = judged(claims, runs["printed"].values, runs["corrected"].values)
    entries = sorted((*rows, *table_entries(runs["corrected"].material, parameters)), key=lambda row: row.claim.section)
    return Paper(runs, tuple(entries))


def _cases(parameters: Parameters) -> list[tuple[str, Case]]:
    return [case for part in PARTS for case in part.cases(parameters)]


def _run(cases: Mapping[tuple[SetName, str], Case], workers: Workers, tell: Tell) -> dict[tuple[SetName, str], Record]:
    """All runs, side by side where the workers have processes."""
    names, records = list(cases), {}
    tell("co-simulating", 0.0)
    for number, record in workers.each(run_case, [(cases[name],) for name in names]):
        records[names[number]] = record
        tell("co-simulating", len(records) / len(names))
    return records


def _collected(parameters: Parameters, records: dict[str, Record], material: MaterialRuns) -> PaperRuns:
    records |= ramps.modes(parameters, records)
    values = quantities(material, parameters.error_share)
    for part in PARTS:
        values |= part.quantities(parameters, records)
    return PaperRuns(parameters, records, material, values | axis_values(records, parameters.name))


def _trials(runs: PaperRuns) -> tuple[Trials, ...]:
    return trials(runs.parameters, runs.records)


def _write(folder: Path, entries: tuple[Entry, ...], content: Content) -> None:
    document = json.dumps([entry.document() for entry in entries], indent=1, allow_nan=False)
    (folder / "claims.json").write_text(document + "\n", encoding="utf-8")
    page = paper_page(content, {"claims.json": "claims.json"})
    (folder / "claims.html").write_text(page, encoding="utf-8")
