"""The linear plant, and where the cables hold the platform."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ..errors import InputError, UnreachableError
from ..robots.reading import read_robot
from ..robots.robot import Robot
from .shared import (
    AsJson,
    Quiet,
    RobotFile,
    Voice,
    links_beside,
    position_of,
    progress_bar,
    robot_of,
    say_what_is_left_out,
)

if TYPE_CHECKING:
    from ..linear.plant import LinearPlant
    from ..statics.workspace import Workspace


def linearise(
    robot_file: RobotFile,
    out: Annotated[
        Path | None, typer.Option(metavar="MODEL.json", help="Where the model goes; not needed with --json.")
    ] = None,
    at: Annotated[str | None, typer.Option(metavar="X,Y,Z", help="Position, m; by default the start.")] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="PAGE.html", help="Modes in motion and gains, as a page.")
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Linearise the robot at rest: modes, and A, B, C, D.

    Inputs are the speeds of the drums: [winch] and [fmu] of the robot file have no part in it.

    Example: tautwire linearise robot.toml --at 10,5.5,4 --out model.json --report modes.html
    """
    from ..linear import linearise as linearised
    from ..linear import model_document
    from ..output import refuse_inputs, refuse_same

    require_out(out, as_json, "model.json")
    refuse_inputs([robot_file], [path for path in (out, report) if path])
    refuse_same(out, report)
    voice = Voice(as_json, quiet)
    robot = robot_of(robot_file)
    try:
        with progress_bar(voice) as tell:
            tell("linearising", 0.0)
            plant = linearised(robot, None if at is None else position_of(at))
    except UnreachableError as error:
        raise UnreachableError("--at", error.position, error.cable, error.tension, error.reason) from error
    document = model_document(plant)
    written = _write_model(document, out, robot, plant, report, robot_file)
    say_what_is_left_out(robot, voice)
    for note in plant.notes:
        voice.note(note)
    voice.result([*_modes_told(plant), *written.values()], {**written, **document, "notes": plant.notes})


def _modes_told(plant: LinearPlant) -> list[str]:
    pairs = zip(plant.modes.frequencies, plant.modes.damping_ratios, strict=True)
    return [f"mode {i}: {hertz:.4f} Hz, damping ratio {ratio:.5f}" for i, (hertz, ratio) in enumerate(pairs, 1)]


def _write_model(
    document: Mapping[str, Any],
    out: Path | None,
    robot: Robot,
    plant: LinearPlant,
    report: Path | None,
    robot_file: Path,
) -> dict[str, Path]:
    """Write the model and its page where they are asked for, both or none; returns what was written, by name."""
    from ..output import file_in_place

    with ExitStack() as both:
        if out is not None:
            scratch = both.enter_context(file_in_place(out))
            scratch.write_text(json.dumps(document, indent=1), encoding="utf-8")
        if report is not None:
            from ..report.modes_page import modes_page

            links = links_beside(report, robot_file, *([out] if out else []))
            page = both.enter_context(file_in_place(report))
            page.write_text(modes_page(robot, plant, links), encoding="utf-8")
    return ({"model": out} if out else {}) | ({"report": report} if report else {})


def workspace(
    robot_file: RobotFile,
    out: Annotated[
        Path | None, typer.Option(metavar="WORKSPACE.csv", help="Where the table goes; not needed with --json.")
    ] = None,
    plot: Annotated[Path | None, typer.Option(metavar="FIGURE.png", help="Slices as a figure; or .pdf, .svg.")] = None,
    lower: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="Lower corner, m; by default of all exit points and the start.")
    ] = None,
    upper: Annotated[str | None, typer.Option(metavar="X,Y,Z", help="Upper corner, m.")] = None,
    spacing: Annotated[float | None, typer.Option(help="Grid spacing, m; by default a twentieth of the box.")] = None,
    acceleration: Annotated[float, typer.Option(help="Required along each axis beside the weight, m/s^2.")] = 0.0,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Find where the cables, which only pull, hold the platform.

    Margins and static tensions on a grid.

    Example: tautwire workspace robot.toml --out workspace.csv --plot workspace.png
    """
    from ..output import refuse_inputs, refuse_same
    from ..statics.workspace import wrench_feasible_workspace
    from ..statics.workspace_figure import checked_format

    require_out(out, as_json, "workspace.csv")
    refuse_inputs([robot_file], [path for path in (out, plot) if path])
    refuse_same(out, plot, "--plot")
    if plot is not None:
        checked_format(plot)
    voice = Voice(as_json, quiet)
    robot = read_robot(robot_file)
    least = None if lower is None else position_of(lower, "--lower")
    most = None if upper is None else position_of(upper, "--upper")
    with progress_bar(voice) as tell:
        ahead = partial(tell, "looking where the cables hold it")
        found = wrench_feasible_workspace(robot, least, most, spacing, acceleration, ahead)
    written = _write_workspace(found, out, robot, plot)
    counts = {"feasible": int(found.feasible.sum()), "positions": int(found.feasible.size)}
    said = "{feasible} of {positions} positions are wrench-feasible".format_map(counts)
    # What no file holds, a machine gets here.
    voice.result([said, *written.values()], {**written, **counts, **({} if out else {"rows": _rows(found)})})


def _write_workspace(found: Workspace, out: Path | None, robot: Robot, plot: Path | None) -> dict[str, Path]:
    """Write the table and the figure where they are asked for, both or none; returns what was written, by name."""
    from ..output import file_in_place
    from ..statics.workspace_figure import workspace_figure

    with ExitStack() as both:
        if out is not None:
            found.frame().to_csv(both.enter_context(file_in_place(out)), index=False, float_format="%.10g")
        if plot is not None:
            workspace_figure(robot, found).savefig(both.enter_context(file_in_place(plot)))
    return ({"workspace": out} if out else {}) | ({"plot": plot} if plot else {})


def require_out(out: Path | None, as_json: bool, name: str) -> None:
    """Raises InputError where the result would go nowhere."""
    if out is None and not as_json:
        raise InputError("--out", "is missing", f"name a file, as in --out {name}, or add --json")


def _rows(found: Workspace) -> list[dict[str, float | None]]:
    """A record a position, None where there is no number."""
    records = found.frame().to_dict("records")
    return [{str(key): value if math.isfinite(value) else None for key, value in record.items()} for record in records]
