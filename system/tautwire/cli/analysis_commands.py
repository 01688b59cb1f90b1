"""The commands ``linearise`` and ``workspace``: the linear plant, and where the cables can hold the platform."""

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
from ..json_document import json_value
from ..provenance import Provenance
from ..robot.robot_file_reader import read_robot
from ..robot.schema import Robot
from .console import (
    AsJson,
    CommandOutput,
    Quiet,
    RobotFile,
    command_provenance,
    note_unused_tables,
    parse_numbers,
    parse_position,
    parse_quaternion,
    progress_bar,
    read_holdable_robot,
    relative_links,
)

if TYPE_CHECKING:
    from ..linear.linear_plant import LinearPlant
    from ..robot.pose_grid import PoseGrid
    from ..robot.workspace import Workspace

COMPUTING = "computing the workspace"
CRITERION_WORDS = {"wrench-closure": "in wrench closure", "static": "in static equilibrium"}


def linearise(
    context: typer.Context,
    robot_file: RobotFile,
    out: Annotated[
        Path | None, typer.Option(metavar="MODEL.json", help="Output file of the model; not needed with --json.")
    ] = None,
    at: Annotated[str | None, typer.Option(metavar="X,Y,Z", help="Position, m; by default the start.")] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="PAGE.html", help="Output page: animated modes, and gains.")
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Linearise the robot at rest: modes, and A, B, C, D.

    Inputs are the speeds of the drums: [winch] and [fmu] of the robot file have no part in it.

    Example: tautwire linearise robot.toml --at 10,5.5,4 --out model.json --report modes.html
    """
    from ..atomic_output import refuse_other_formats, refuse_overwriting_inputs, refuse_same_output
    from ..linear import linearise as linearised
    from ..linear import model_document

    require_output(out, as_json, "model.json")
    refuse_other_formats(out, ".json")
    refuse_other_formats(report, ".html", option="--report")
    refuse_overwriting_inputs([robot_file], [path for path in (out, report) if path])
    refuse_same_output(out, report)
    output = CommandOutput(as_json, quiet)
    robot = read_holdable_robot(robot_file)
    try:
        with progress_bar(output) as progress:
            progress("linearising", 0.0)
            plant = linearised(robot, None if at is None else parse_position(at))
    except UnreachableError as error:
        raise UnreachableError("--at", error.position, error.cable, error.tension, error.reason) from error
    provenance = command_provenance(context, robot_file)
    document = {**model_document(plant), "provenance": provenance.document()}
    page = None
    if report is not None:
        from ..reports.modes_page import modes_page

        page = modes_page(robot, plant, relative_links(report, robot_file, *([out] if out else [])), provenance)
    written = _write_model(document, out, page, report)
    note_unused_tables(robot, output)
    for note in plant.notes:
        output.note(note)
    output.result([*_mode_lines(plant), *written.values()], {**written, **document, "notes": plant.notes})


def _mode_lines(plant: LinearPlant) -> list[str]:
    # Rounded first: an undamped mode has no negative zero.
    ratios = [round(float(ratio), 5) + 0.0 for ratio in plant.modes.damping_ratios]
    pairs = zip(plant.modes.frequencies, ratios, strict=True)
    return [f"mode {i}: {frequency:.4f} Hz, damping ratio {ratio:.5f}" for i, (frequency, ratio) in enumerate(pairs, 1)]


def _write_model(
    document: Mapping[str, Any],
    out: Path | None,
    page: str | None,
    report: Path | None,
) -> dict[str, Path]:
    """Writes the model and its page as requested, both or neither; returns the written files by name."""
    from ..atomic_output import atomic_file

    with ExitStack() as stack:
        if out is not None:
            scratch = stack.enter_context(atomic_file(out))
            scratch.write_text(json.dumps(json_value(document), indent=1, allow_nan=False), encoding="utf-8")
        if report is not None and page is not None:
            stack.enter_context(atomic_file(report)).write_text(page, encoding="utf-8")
    return ({"model": out} if out else {}) | ({"report": report} if report else {})


def workspace(
    context: typer.Context,
    robot_file: RobotFile,
    out: Annotated[
        Path | None, typer.Option(metavar="WORKSPACE.csv", help="Output file of the table; not needed with --json.")
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(metavar="FIGURE.png", help="Output figure of slices; also .pdf, .svg.")
    ] = None,
    lower: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="Lower corner, m; by default of all exit points and the start.")
    ] = None,
    upper: Annotated[str | None, typer.Option(metavar="X,Y,Z", help="Upper corner, m.")] = None,
    spacing: Annotated[
        float | None, typer.Option(help="Grid spacing, m, with --at rad; by default a twentieth of the longest side.")
    ] = None,
    acceleration: Annotated[float, typer.Option(help="Acceleration to provide along each axis, m/s^2.")] = 0.0,
    angular_acceleration: Annotated[
        float, typer.Option(help="Angular acceleration to provide about each axis of the platform, rad/s^2.")
    ] = 0.0,
    criterion: Annotated[
        str, typer.Option(help="wrench-feasible, wrench-closure or static.", show_default=True)
    ] = "wrench-feasible",
    orientation: Annotated[
        str | None, typer.Option(metavar="W,X,Y,Z", help="Orientation of the platform; by default that of the file.")
    ] = None,
    rotation_range: Annotated[
        str, typer.Option(metavar="RX,RY,RZ", help="Rotations from it, rad, both ways; all have to be possible.")
    ] = "0,0,0",
    at: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="Position, m: the grid is over the --rotation-range there.")
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Compute the workspace: where the cables can hold the platform.

    Margins and static tensions on a grid of positions, or with --at of orientations at one position.

    Example: tautwire workspace robot.toml --out workspace.csv --plot workspace.png
    """
    from ..atomic_output import refuse_other_formats, refuse_overwriting_inputs, refuse_same_output
    from ..provenance import refuse_foreign_csv_metadata
    from ..reports.workspace_figure import require_figure_format
    from ..robot.workspace import workspace_on
    from ..robot.workspace_criteria import RequiredMotion

    require_output(out, as_json, "workspace.csv")
    refuse_same_output(out, plot, "--plot")
    refuse_other_formats(out, ".csv")
    refuse_foreign_csv_metadata(out)
    refuse_overwriting_inputs([robot_file], [path for path in (out, plot) if path])
    if plot is not None:
        require_figure_format(plot)
    output = CommandOutput(as_json, quiet)
    robot = read_robot(robot_file)
    grid = _pose_grid(robot, at, (lower, upper, spacing), orientation, rotation_range)
    with progress_bar(output) as progress:
        motion, grid_progress = RequiredMotion(acceleration, angular_acceleration), partial(progress, COMPUTING)
        feasibility = workspace_on(grid, robot, criterion, motion, grid_progress)
    provenance = command_provenance(context, robot_file)
    written = _write_workspace(feasibility, out, robot, plot, provenance)
    counts = {"feasible": int(feasibility.feasible.sum()), "positions": int(feasibility.feasible.size)}
    kind = CRITERION_WORDS.get(criterion, criterion)
    points = "positions" if at is None else "orientations"
    summary_line = f"{counts['feasible']} of {counts['positions']} {points} are {kind}"
    # Without a table file, JSON output holds the rows.
    output.result(
        [summary_line, *written.values()],
        {
            **written,
            **counts,
            **({} if out else {"rows": _workspace_records(feasibility)}),
            "provenance": provenance.document(),
        },
    )


def _pose_grid(
    robot: Robot,
    at: str | None,
    box: tuple[str | None, str | None, float | None],
    orientation: str | None,
    rotation_range: str,
) -> PoseGrid:
    """The grid by the options of the command; ``box`` is its lower and upper corner and its spacing."""
    from ..robot.pose_grid import orientation_grid, position_grid

    lower, upper, spacing = box
    turned = None if orientation is None else parse_quaternion(orientation)
    rotations = parse_numbers(rotation_range, 3, "--rotation-range", "0.2,0.2,0.5")
    if at is None:
        lower_corner = None if lower is None else parse_position(lower, "--lower")
        upper_corner = None if upper is None else parse_position(upper, "--upper")
        return position_grid(robot, lower_corner, upper_corner, spacing, turned, rotations)
    if lower is not None or upper is not None:
        raise InputError("--at", "is given with a box of positions", "give --at, or --lower and --upper")
    if not any(rotations):
        raise InputError("--at", "is given without rotations", "add --rotation-range, such as 0.5,0.5,1")
    return orientation_grid(robot, rotations, parse_position(at), spacing, turned)


def _write_workspace(
    feasibility: Workspace, out: Path | None, robot: Robot, plot: Path | None, provenance: Provenance
) -> dict[str, Path]:
    """Writes the table and the figure as requested, both or neither; returns the written files by name."""
    from ..atomic_output import atomic_file
    from ..cosimulation.result_file import write_csv_metadata
    from ..reports.workspace_figure import workspace_figure

    with ExitStack() as stack:
        if out is not None:
            feasibility.frame().to_csv(stack.enter_context(atomic_file(out)), index=False, float_format="%.10g")
        if plot is not None:
            workspace_figure(robot, feasibility).savefig(stack.enter_context(atomic_file(plot)))
    if out is not None:
        write_csv_metadata(out, provenance)
    return ({"workspace": out} if out else {}) | ({"plot": plot} if plot else {})


def require_output(out: Path | None, as_json: bool, name: str) -> None:
    """Raises InputError where neither an output file nor JSON output is requested."""
    if out is None and not as_json:
        raise InputError("--out", "is missing", f"name a file, as in --out {name}, or add --json")


def _workspace_records(feasibility: Workspace) -> list[dict[str, float | None]]:
    """One record for each position; None for a number that is not finite."""
    records = feasibility.frame().to_dict("records")
    return [{str(key): value if math.isfinite(value) else None for key, value in record.items()} for record in records]
