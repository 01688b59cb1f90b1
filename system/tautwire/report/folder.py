"""The report folder of a trace: the robot with its effects, its FMUs, ``report.json`` and an HTML page."""

from __future__ import annotations

import json
from pathlib import Path

from ..arguments import validate_folder, validate_instance
from ..fmus.packaging import RobotFmus, build_fmus, with_user_fmus_copied
from ..robots.reading import write_robot
from ..tracer.verdict import Trace
from .document import trace_document
from .page import trace_page


def write_report(trace: Trace, folder: str | Path) -> RobotFmus:
    """Writes ``robot.toml``, its FMUs, ``report.json`` and ``index.html`` into a folder, which is created if absent.

    Returns the paths of the FMUs. Raises ArgumentError where ``trace`` is not what :func:`tautwire.trace` returns or
    ``folder`` names none, OSError where the disk refuses.
    """
    validate_instance("write_report: trace", trace, Trace, "give what trace returns")
    folder = validate_folder("write_report: folder", folder)
    folder.mkdir(parents=True, exist_ok=True)
    write_robot(trace.robot_after, folder / "robot.toml")
    fmus = with_user_fmus_copied(build_fmus(trace.robot_after, folder), folder)
    document = json.dumps(trace_document(trace), indent=1, allow_nan=False)
    (folder / "report.json").write_text(document + "\n", encoding="utf-8")
    links = {"robot.toml": "robot.toml", "report.json": "report.json"}
    links |= {path.name: path.name for path in fmus.paths}
    (folder / "index.html").write_text(trace_page(trace, links), encoding="utf-8")
    return fmus
