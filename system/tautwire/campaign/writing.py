"""The summary and the page of a campaign whose rows are all there."""

from __future__ import annotations

import json
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ..output import folder_in_place
from ..robots.reading import robot_from
from .dataset import read_rows
from .errors import MissingExtraError
from .page import campaign_page, season_page
from .plan import Plan
from .rows import columns_of
from .season import season_of
from .summary import summary_of

LINKS = {"summary.json": "summary.json"}


def require_libraries(plan: Plan) -> None:
    """Raises MissingExtraError where a campaign would want a library in the end that is not there."""
    for module, name in (("distributed", "dask[distributed]"), ("SALib", "SALib")):
        if find_spec(module) is None and (module != "SALib" or plan.inputs):
            raise MissingExtraError(name)


def write_summary(plan: Plan, folder: Path) -> dict[str, Any]:
    """Write ``summary.json`` and ``index.html`` into a campaign's folder; returns what the summary holds."""
    rows = read_rows(folder)
    if plan.trace is not None:
        season = season_of(rows)
        document, page = season.document(), season_page(plan, season, rows, LINKS)
    else:
        robot = robot_from(dict(plan.content), plan.file)
        columns = columns_of(plan, robot.cable_count)
        summary = summary_of(plan, columns, rows)
        document, page = summary.document(), campaign_page(plan, robot, columns, summary, rows, folder, LINKS)
    with folder_in_place(folder) as scratch:
        (scratch / "summary.json").write_text(json.dumps(document, indent=1), encoding="utf-8")
        (scratch / "index.html").write_text(page, encoding="utf-8")
    return document
