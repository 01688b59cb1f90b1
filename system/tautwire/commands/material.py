"""The command ``material``: identification of a rope from a dynamic test."""

from __future__ import annotations

import math
import shutil
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from ..errors import InputError
from ..robots.reading import read_robot
from .shared import AsJson, CommandOutput, Quiet, progress_bar, read_holdable_robot

DYNAMIC_TEST_HELP = "A dynamic test of the rope; if none, Table 1 of the paper, with the pair that it uses."


def material(
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Where fit.json and the figure go.")],
    table: Annotated[Path | None, typer.Argument(metavar="TABLE.csv", help=DYNAMIC_TEST_HELP)] = None,
    at: Annotated[float | None, typer.Option(help="The row, Hz, whose pair of E' and c is in use as constant.")] = None,
    robot_file: Annotated[
        Path | None, typer.Option("--robot", metavar="ROBOT.toml", help="A robot with this rope; written anew.")
    ] = None,
    shared: Annotated[float, typer.Option(help="Share of each variance that all rows have in common.")] = 0.0,
    coverage: Annotated[float, typer.Option(help="Standard deviations that the table's uncertainties are.")] = 1.0,
    alpha: Annotated[float, typer.Option(help="Rate of false alarms allowed.")] = 0.01,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Fit a rope's constants and relaxation to a dynamic test.

    Judges a constant modulus and damping, and fits what the rope has besides.

    Example: tautwire material dma.csv --robot robot.toml --out material/
    """
    from ..materials import (
        PAPER_PAIR_FREQUENCY,
        PAPER_TABLE,
        MaterialOptions,
        pair_of_row,
        read_material_table,
        trace_material,
    )
    from ..materials.document import material_document
    from ..materials.output import MATERIAL_FILES, write_material
    from ..materials.robot_material import declared_material
    from ..materials.terminal import material_verdict_table
    from ..output import atomic_folder, refuse_overwriting_inputs

    for name, value, minimum in (("--shared", shared, 0.0), ("--alpha", alpha, math.nextafter(0.0, 1.0))):
        if not minimum <= value < 1.0:
            raise InputError(name, f"{value:g} is not a share below 1", "give a number such as 0.01")
    if not 0.0 < coverage < math.inf:
        raise InputError("--coverage", f"{coverage:g} is not positive", "give 1, or 2 for intervals of 95 %")
    if at is not None and robot_file:
        raise InputError("--at", "the pair in use is the robot's", "give either --at or --robot")
    output = CommandOutput(as_json, quiet)
    measurements = read_material_table(table or PAPER_TABLE)
    robot = read_holdable_robot(robot_file) if robot_file else None
    refuse_overwriting_inputs([path for path in (table, robot_file) if path], [out / name for name in MATERIAL_FILES])
    declared = declared_material(robot, str(robot_file)) if robot else None
    if table is None and robot is None and at is None:
        at = PAPER_PAIR_FREQUENCY
    if at is not None:
        declared = pair_of_row(measurements, at)
    with atomic_folder(out) as scratch:
        with progress_bar(output) as progress:
            verdict = trace_material(
                measurements,
                declared,
                MaterialOptions(shared_variance=shared, coverage_factor=coverage, significance_level=alpha),
                progress,
            )
        write_material(verdict, scratch, robot)
    if not (quiet or as_json):
        Console().print(material_verdict_table(verdict))
    output.result([out / "fit.json"], {"folder": out, **material_document(verdict)})
    if robot is not None:
        output.suggest_next(
            f"tautwire check {out / 'robot.toml'} RECORDING.csv, and trace: does the robot move like that?"
        )


def judge_rope_material(table: Path, robot_file: Path, out: Path, alpha: float, output: CommandOutput) -> None:
    """Traces a robot's rope: its constants are tested against a dynamic test, and the extended robot gets its FMUs.

    Writes what :func:`material` writes, the same verdict as ``report.json``, and the FMUs.
    """
    from ..fmus.packaging import build_fmus
    from ..materials import MaterialOptions, read_material_table, trace_material
    from ..materials.document import material_document
    from ..materials.output import MATERIAL_FILES, write_material
    from ..materials.robot_material import declared_material
    from ..materials.terminal import material_verdict_table
    from ..output import atomic_folder, refuse_overwriting_inputs

    measurements, robot = read_material_table(table), read_holdable_robot(robot_file)
    refuse_overwriting_inputs([table, robot_file], [out / name for name in (*MATERIAL_FILES, "report.json")])
    declared = declared_material(robot, str(robot_file))
    with atomic_folder(out) as scratch:
        with progress_bar(output) as progress:
            verdict = trace_material(measurements, declared, MaterialOptions(significance_level=alpha), progress)
        write_material(verdict, scratch, robot)
        shutil.copyfile(scratch / "fit.json", scratch / "report.json")
        build_fmus(read_robot(scratch / "robot.toml"), scratch)
    if not (output.quiet or output.as_json):
        Console().print(material_verdict_table(verdict))
    output.result([out / "report.json"], {"folder": out, **material_document(verdict)})
