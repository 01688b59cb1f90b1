"""Runs all that the paper computes, and writes its figures, the ledger of claims and the page."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from ..estimation.worker_pool import WorkerPool, processors
from ..json_document import write_json
from ..materials import RobotMaterial
from ..provenance import Provenance, provenance_of
from . import helix_runs as helix
from . import open_claims as tried
from . import paper_extensions as beyond
from . import ramp_runs as ramps
from .figure_style import figure_style, write_figures
from .open_claims import examine_open_claims
from .paper_claims import LedgerEntry, axis_claims, judge_claims, table_1_entries, text_claims
from .paper_extensions import draw_extensions
from .paper_figures import axis_values, draw_rope_tests, draw_space_figures, draw_time_figures
from .paper_page import PageContent, paper_page
from .paper_parameters import PARAMETER_SETS, PaperParameters, ParameterSetName, read_parameters
from .rope_tests import RopeTestRuns, printed_rope, relaxing_rope, rope_test_values, run_tensile_and_dynamic_tests
from .simulation_records import ClaimValues, Progress, SimulationCase, SimulationRecord, run_case

SECTION_MODULES = (helix, ramps)
MAX_PROCESSES = 2


@dataclass(frozen=True)
class PaperRuns:
    """All runs of one parameter set, with the rope tests of section 3 and the numbers computed from them."""

    parameters: PaperParameters
    records: Mapping[str, SimulationRecord]
    rope_tests: RopeTestRuns
    values: ClaimValues


@dataclass(frozen=True)
class PaperReproduction:
    """Result of the reproduction: runs by parameter set, and the entries of the ledger."""

    runs: Mapping[ParameterSetName, PaperRuns] = field(repr=False)
    entries: tuple[LedgerEntry, ...] = field(repr=False)

    @property
    def counts(self) -> Mapping[str, int]:
        """Number of claims with each verdict."""
        return Counter(entry.verdict for entry in self.entries)


def write_paper(folder: Path, progress: Progress, provenance: Provenance | None = None) -> PaperReproduction:
    """Run everything and write ``claims.json``, ``claims.html``, ``provenance.json`` and all figures into a folder.

    Raises RunError where an FMU fails.
    """
    provenance = provenance or provenance_of()
    with WorkerPool(min(processors(), MAX_PROCESSES)) as workers:
        reproduction = run_paper(workers, progress)
    runs = reproduction.runs["corrected"]
    progress("comparing ropes on a drum", 0.0)
    size_study = beyond.compare_sizes(runs.parameters, runs.records)
    with figure_style():
        extensions = tuple(draw_extensions(runs.parameters, runs.records, size_study))
        figures = [
            *draw_rope_tests({name: each.rope_tests for name, each in reproduction.runs.items()}),
            *draw_time_figures(runs.records),
            *draw_space_figures(runs.parameters, runs.records),
            *(each.figure for each in extensions),
        ]
        svgs = write_figures(figures, folder, partial(progress, "drawing"))
    write_json(folder / "claims.json", [entry.document() for entry in reproduction.entries])
    write_json(folder / "provenance.json", provenance.document())
    claims = examine_open_claims(runs.parameters, runs.records)
    content = PageContent(reproduction.entries, figures, svgs, claims, extensions)
    page = paper_page(content, {"claims.json": "claims.json"}, provenance)
    (folder / "claims.html").write_text(page, encoding="utf-8")
    return reproduction


def run_paper(workers: WorkerPool, progress: Progress) -> PaperReproduction:
    """Run everything; with the corrected parameters also the open claims and the studies beyond the paper."""
    parameters = {name: read_parameters(name) for name in PARAMETER_SETS}
    ropes: dict[ParameterSetName, RobotMaterial] = {"printed": printed_rope(), "corrected": relaxing_rope()}
    cases = {(name, key): case for name in PARAMETER_SETS for key, case in _section_cases(parameters[name])}
    extra_cases = (*tried.cases(parameters["corrected"]), *beyond.cases(parameters["corrected"], ropes["corrected"]))
    cases |= {("corrected", key): case for key, case in extra_cases}
    rope_test_runs = {name: workers.submit(run_tensile_and_dynamic_tests, rope) for name, rope in ropes.items()}
    records = _run_cases(cases, workers, progress)
    runs = {}
    for name in PARAMETER_SETS:
        set_records = {key: record for (set_name, key), record in records.items() if set_name == name}
        runs[name] = _collect_runs(parameters[name], set_records, rope_test_runs[name].result())
    claims = (*text_claims(), *axis_claims())
    judged_entries = judge_claims(claims, runs["printed"].values, runs["corrected"].values)
    entries = sorted(
        (*judged_entries, *table_1_entries(runs["corrected"].rope_tests, parameters)), key=lambda row: row.claim.section
    )
    return PaperReproduction(runs, tuple(entries))


def _section_cases(parameters: PaperParameters) -> list[tuple[str, SimulationCase]]:
    return [case for section_module in SECTION_MODULES for case in section_module.cases(parameters)]


def _run_cases(
    cases: Mapping[tuple[ParameterSetName, str], SimulationCase], workers: WorkerPool, progress: Progress
) -> dict[tuple[ParameterSetName, str], SimulationRecord]:
    """Run all cases, in parallel where the workers have processes."""
    case_keys, records = list(cases), {}
    progress("co-simulating", 0.0)
    for number, record in workers.map_unordered(run_case, [(cases[name],) for name in case_keys]):
        records[case_keys[number]] = record
        progress("co-simulating", len(records) / len(case_keys))
    return records


def _collect_runs(
    parameters: PaperParameters, records: dict[str, SimulationRecord], rope_tests: RopeTestRuns
) -> PaperRuns:
    records |= ramps.mode_records(parameters, records)
    values = rope_test_values(rope_tests, parameters.error_share)
    for section_module in SECTION_MODULES:
        values |= section_module.quantities(parameters, records)
    return PaperRuns(parameters, records, rope_tests, values | axis_values(records, parameters.name))
