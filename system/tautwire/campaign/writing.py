"""Writes the summary and the page of a completed campaign."""

from __future__ import annotations

import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ..output import atomic_folder
from ..robots.reading import robot_from_content
from .dataset import read_rows
from .errors import MissingExtraError
from .page import campaign_page, trace_summary_page
from .plan import Plan
from .rows import row_columns
from .season import summarise_traces
from .summary import summarise_runs

PAGE_LINKS = {"summary.json": "summary.json"}


def require_libraries(plan: Plan) -> None:
    """Raises MissingExtraError where a library is not installed that the campaign will need."""
    for module, name in (("distributed", "dask[distributed]"), ("SALib", "SALib")):
        if find_spec(module) is None and (module != "SALib" or plan.inputs):
            raise MissingExtraError(name)


def write_summary(plan: Plan, folder: Path) -> dict[str, Any]:
    """Write ``summary.json`` and ``index.html`` into a campaign's folder, and return the summary."""
    rows = read_rows(folder)
    if plan.trace is not None:
        traces = summarise_traces(rows)
        document, page = traces.document(), trace_summary_page(plan, traces, rows, PAGE_LINKS)
    else:
        robot = robot_from_content(dict(plan.content), plan.file)
        columns = row_columns(plan, robot.cable_count)
        summary = summarise_runs(plan, columns, rows)
        document, page = summary.document(), campaign_page(plan, robot, columns, summary, rows, folder, PAGE_LINKS)
    with atomic_folder(folder) as scratch:
        (scratch / "summary.json").write_text(json.dumps(document, indent=1), encoding="utf-8")
        (scratch / "index.html").write_text(page, encoding="utf-8")
    return document
