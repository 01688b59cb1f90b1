"""The commands ``campaign`` and ``paper``: batches of many co-simulations."""

from __future__ import annotations

import csv
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError
from ..provenance import Provenance, provenance_of
from .console import AsJson, CommandOutput, Quiet, command_provenance, progress_bar, shell_quoted

if TYPE_CHECKING:
    from ..campaigns.campaign_plan import Plan


SCHEDULER_HELP = "Address of a Dask scheduler; by default a local cluster."
WORKERS_HELP = "Worker processes on this machine; by default one per processor."


def campaign(
    context: typer.Context,
    plan_file: Annotated[
        Path, typer.Argument(metavar="PLAN.toml", help="The plan: what varies, and what is computed.")
    ],
    out: Annotated[Path | None, typer.Option(metavar="FOLDER", help="Output folder of rows, summary and page.")] = None,
    scheduler: Annotated[str | None, typer.Option(metavar="ADDRESS", help=SCHEDULER_HELP)] = None,
    workers: Annotated[int | None, typer.Option(help=WORKERS_HELP, min=1, max=4096)] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="List the runs without running them.")] = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Run a campaign: samples, grids, recordings.

    Rows are written to FOLDER as they come. The same command resumes a campaign that was stopped.

    Example: tautwire campaign plan.toml --out campaign/
    """
    from ..atomic_output import refuse_overwriting_inputs
    from ..campaigns.campaign_runner import input_files, require_libraries
    from ..campaigns.plan_file import read_plan
    from ..estimation import processors

    output = CommandOutput(as_json, quiet)
    if scheduler is not None and workers is not None:
        raise InputError("--workers", "is given with --scheduler, which has workers of its own", "omit one of them")
    plan = read_plan(plan_file)
    for note in plan.notes:
        output.note(note)
    if dry_run:
        _print_rows(plan, output)
        return
    if out is None:
        raise InputError("--out", "is missing", "name a folder, as in --out campaign/, or add --dry-run")
    require_libraries(plan)
    refuse_overwriting_inputs([plan_file, Path(plan.file)], [out / name for name in ("campaign.json", "summary.json")])
    provenance = provenance_of(input_files(plan, plan_file), context.obj)
    _run_and_summarise(plan, out, (scheduler, workers or processors()), provenance, output)


def _run_and_summarise(
    plan: Plan, out: Path, cluster: tuple[str | None, int], provenance: Provenance, output: CommandOutput
) -> None:
    """Runs what the dataset lacks, writes the summary and prints it; ``cluster``: scheduler or None, and workers."""
    from ..campaigns.campaign_dataset import completed_runs, open_dataset
    from ..campaigns.campaign_runner import run_campaign, run_count, write_summary
    from ..campaigns.controller_notes import with_controller_notes
    from ..campaigns.dask_cluster import dashboard_message, dask_client

    new_runs = 0
    with open_dataset(out, plan, provenance):
        with progress_bar(output) as progress:
            progress("checking controllers", 0.0)
            noted_plan = with_controller_notes(plan)
        for note in noted_plan.notes[len(plan.notes) :]:
            output.note(note)
        if not completed_runs(out, run_count(plan)).all():
            with dask_client(*cluster) as client, progress_bar(output) as progress:
                output.note(dashboard_message(client))
                if not client.nthreads():
                    output.note("no worker yet; runs begin when one connects")
                new_runs = run_campaign(plan, out, client, progress, provenance)
        with progress_bar(output) as progress:
            progress("summing up", 0.0)
            summary = write_summary(noted_plan, out, provenance)
    run_counts = f"{run_count(plan)} runs, {new_runs} of them now, {summary['failed']} failed"
    written = {"rows": out / "runs", "summary": out / "summary.json", "page": out / "index.html"}
    output.result([run_counts, *written.values()], {**written, "made": new_runs, **summary})
    output.suggest_next(
        f"open {shell_quoted(written['page'])}; pandas.read_parquet({str(written['rows'])!r}) has one row per run"
    )


def _print_rows(plan: Plan, output: CommandOutput) -> None:
    """Prints all runs with their inputs, as CSV or JSON."""
    import numpy as np

    from ..campaigns.campaign_runner import planned_jobs, run_count

    jobs = planned_jobs(plan, np.ones(run_count(plan), dtype=bool))
    if plan.trace is not None:
        recordings = plan.trace.recordings
        rows: Any = ({"index": job.index, "recording": recordings[job.index]} for job in jobs)
    else:
        variant_names = [
            ("" if path_index < 0 else plan.paths[path_index].name, controller)
            for path_index, controller in plan.variants
        ]
        rows = (
            {"index": job.index, "sample": job.sample}
            | (dict(zip(("path", "controller"), variant_names[job.variant], strict=True)) if plan.paths else {})
            | dict(zip(plan.keys, job.values, strict=True))
            for job in jobs
        )
    if output.as_json or output.quiet:
        output.result((), {"rows": list(rows)})
        return
    writer = csv.writer(sys.stdout, lineterminator="\n")
    for index, row in enumerate(rows):
        if index == 0:
            writer.writerow(row)
        writer.writerow(f"{value:.10g}" if isinstance(value, float) else value for value in row.values())


def paper(
    context: typer.Context,
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Output folder of claims.html, claims.json and figures.")],
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Recompute the paper by co-simulation, claim by claim.

    Draws its figures anew, and says of each number that the text claims whether it comes out.

    Example: tautwire paper --out paper/
    """
    from ..atomic_output import atomic_folder
    from ..paper import write_paper

    output = CommandOutput(as_json, quiet)
    with atomic_folder(out) as scratch, progress_bar(output) as progress:
        provenance = command_provenance(context)
        result = write_paper(scratch, progress, provenance)
    counts = dict(result.counts)
    output.note(", ".join(f"{count} {verdict}" for verdict, count in counts.items()))
    paths = [out / "claims.html", out / "claims.json"]
    document = {"claims": len(result.entries), "verdicts": counts, "page": paths[0], "ledger": paths[1]}
    output.result(paths, {**document, "provenance": provenance.document()})
    output.suggest_next(f"open {shell_quoted(paths[0])} in a browser")
