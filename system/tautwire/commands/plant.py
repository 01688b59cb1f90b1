"""The linear plant, and where the cables hold the platform."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from ..errors import UnreachableError
from ..robots.reading import read_robot
from .shared import RobotFile, position_of, robot_of, say_what_is_left_out


def linearise(
    robot_file: RobotFile,
    out: Annotated[Path, typer.Option(metavar="MODEL.json", help="Where the model goes.")],
    at: Annotated[str | None, typer.Option(metavar="X,Y,Z", help="Position, m; by default the start.")] = None,
) -> None:
    """Linearise the robot at rest: modes, and A, B, C, D with named signals.

    Inputs are the speeds of the drums: [winch] and [fmu] of the robot file have no part in it.

    Example: tautwire linearise robot.toml --at 10,5.5,4 --out model.json
    """
    from ..linear import linearise as linearised
    from ..linear import model_document
    from ..output import file_in_place, refuse_inputs

    refuse_inputs([robot_file], [out])
    robot = robot_of(robot_file)
    try:
        plant = linearised(robot, None if at is None else position_of(at))
    except UnreachableError as error:
        raise UnreachableError("--at", error.position, error.cable, error.tension, error.reason) from error
    with file_in_place(out) as scratch:
        scratch.write_text(json.dumps(model_document(plant), indent=1), encoding="utf-8")
    say_what_is_left_out(robot)
    for note in plant.notes:
        print(note, file=sys.stderr)
    pairs = zip(plant.modes.frequencies, plant.modes.damping_ratios, strict=True)
    for number, (frequency, ratio) in enumerate(pairs, start=1):
        print(f"mode {number}: {frequency:.4f} Hz, damping ratio {ratio:.5f}")
    print(out)


def workspace(
    robot_file: RobotFile,
    out: Annotated[Path, typer.Option(metavar="WORKSPACE.csv", help="Where the table goes.")],
    plot: Annotated[Path | None, typer.Option(metavar="FIGURE.png", help="Slices as a figure; or .pdf, .svg.")] = None,
    lower: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="Lower corner, m; by default of all exit points and the start.")
    ] = None,
    upper: Annotated[str | None, typer.Option(metavar="X,Y,Z", help="Upper corner, m.")] = None,
    spacing: Annotated[float | None, typer.Option(help="Grid spacing, m; by default a twentieth of the box.")] = None,
    acceleration: Annotated[float, typer.Option(help="Required along each axis beside the weight, m/s^2.")] = 0.0,
) -> None:
    """Where the cables, which only pull, hold the platform: margins and static tensions on a grid.

    Example: tautwire workspace robot.toml --out workspace.csv --plot workspace.png
    """
    from ..output import file_in_place, refuse_inputs
    from ..statics.workspace import wrench_feasible_workspace
    from ..statics.workspace_figure import checked_format, workspace_figure

    refuse_inputs([robot_file], [out, *([plot] if plot else [])])
    if plot is not None:
        checked_format(plot)
    robot = read_robot(robot_file)
    least = None if lower is None else position_of(lower, "--lower")
    most = None if upper is None else position_of(upper, "--upper")
    found = wrench_feasible_workspace(robot, least, most, spacing, acceleration)
    with file_in_place(out) as scratch:
        found.frame().to_csv(scratch, index=False, float_format="%.10g")
        if plot is not None:
            with file_in_place(plot) as drawing:
                workspace_figure(robot, found).savefig(drawing)
    print(f"{int(found.feasible.sum())} of {found.feasible.size} positions are wrench-feasible")
    for path in (out, plot):
        if path is not None:
            print(path)
