"""Many runs by a plan, on this machine or on a Dask cluster."""

from __future__ import annotations

import csv
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError
from .shared import AsJson, Quiet, Voice, progress_bar

if TYPE_CHECKING:
    from ..campaign.plan import Plan

SCHEDULER = "Address of a Dask scheduler; a cluster of this machine's processors without."
WORKERS = "Worker processes on this machine; one a processor by default."


def campaign(
    plan_file: Annotated[Path, typer.Argument(metavar="PLAN.toml", help="What varies, and what is computed.")],
    out: Annotated[Path | None, typer.Option(metavar="FOLDER", help="Where rows, summary and page go.")] = None,
    scheduler: Annotated[str | None, typer.Option(metavar="ADDRESS", help=SCHEDULER)] = None,
    workers: Annotated[int | None, typer.Option(help=WORKERS, min=1, max=4096)] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Print the rows that would be run, and run none.")] = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Make many runs: samples, sweeps, recordings.

    Rows go to FOLDER as they come. Stopped, by whatever, the same command goes on where it was.

    Example: tautwire campaign plan.toml --out campaign/
    """
    from ..campaign.cluster import connected, dashboard
    from ..campaign.dataset import done_rows, opened
    from ..campaign.reading import read_plan
    from ..campaign.running import make_rows, run_count
    from ..campaign.writing import require_libraries, write_summary
    from ..output import refuse_inputs
    from ..tracer import processors

    voice = Voice(as_json, quiet)
    plan = read_plan(plan_file)
    for note in plan.notes:
        voice.note(note)
    if dry_run:
        _print_rows(plan, voice)
        return
    if out is None:
        raise InputError("--out", "is missing", "name a folder, as in --out campaign/, or add --dry-run")
    require_libraries(plan)
    refuse_inputs([plan_file, Path(plan.file)], [out / name for name in ("campaign.json", "summary.json")])
    made = 0
    with opened(out, plan):
        if not done_rows(out, run_count(plan)).all():
            with connected(scheduler, workers or processors()) as client, progress_bar(voice) as tell:
                voice.note(dashboard(client))
                if not client.nthreads():
                    voice.note("no worker is there yet; runs begin when one comes")
                made = make_rows(plan, out, client, tell)
        with progress_bar(voice) as tell:
            tell("summing up", 0.0)
            summary = write_summary(plan, out)
    said = f"{run_count(plan)} runs, {made} of them now, {summary['failed']} failed"
    written = {"rows": out / "runs", "summary": out / "summary.json", "page": out / "index.html"}
    voice.result([said, *written.values()], {**written, "made": made, **summary})
    voice.next(f"open {written['page']}; pandas.read_parquet('{written['rows']}') has a row a run")


def _print_rows(plan: Plan, voice: Voice) -> None:
    """All runs with their inputs, as CSV or JSON."""
    import numpy as np

    from ..campaign.running import jobs_of, run_count

    jobs = jobs_of(plan, np.ones(run_count(plan), dtype=bool))
    if plan.trace is not None:
        recordings = plan.trace.recordings
        rows: Any = ({"index": job.index, "recording": recordings[job.index]} for job in jobs)
    else:
        names = [("" if place < 0 else plan.paths[place].name, controller) for place, controller in plan.variants]
        rows = (
            {"index": job.index, "sample": job.sample}
            | (dict(zip(("path", "controller"), names[job.variant], strict=True)) if plan.paths else {})
            | dict(zip(plan.keys, job.values, strict=True))
            for job in jobs
        )
    if voice.as_json or voice.quiet:
        voice.result((), {"rows": list(rows)})
        return
    writer = csv.writer(sys.stdout, lineterminator="\n")
    for place, row in enumerate(rows):
        if place == 0:
            writer.writerow(row)
        writer.writerow(f"{value:.10g}" if isinstance(value, float) else value for value in row.values())
