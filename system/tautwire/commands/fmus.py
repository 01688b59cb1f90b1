"""FMUs built, and co-simulated."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from ..robots.robot import slots
from .shared import RobotFile, progress_bar, robot_of

C_HOSTS = (
    "Make FMUs that also run in importers that are not Python processes; needs a C compiler, and Python's headers "
    "and shared library (Debian: gcc, python3-dev)."
)
OWN_FMU = "An FMU of yours in place of ours, such as platform=mine.fmu, cable_2=... or winch_1=...; may be repeated."


def build(
    robot_file: RobotFile,
    out: Annotated[Path, typer.Option(help="Folder for the FMUs.")] = Path("build"),
    for_c_hosts: Annotated[bool, typer.Option("--for-c-hosts", help=C_HOSTS)] = False,
) -> None:
    """Build the FMUs, one a cable, one a winch and one for the platform, and the whole robot as an SSP archive.

    Example: tautwire build robot.toml --out build/
    """
    from ..fmus.c_hosts import embeddable_python, find_compiler, make_for_c_hosts
    from ..fmus.packaging import build_fmus, gathered
    from ..output import folder_in_place, refuse_inputs
    from ..runs.ssp import ssp_name, write_ssp

    robot = robot_of(robot_file)
    refuse_inputs([fmu.path for fmu in robot.fmus], [out / f"{slot}.fmu" for slot in slots(robot.cable_count)])
    if for_c_hosts:
        embeddable_python()
        find_compiler()
    with folder_in_place(out) as scratch:
        fmus = gathered(build_fmus(robot, scratch), scratch)
        if for_c_hosts:
            for slot in fmus.parts.keys() - fmus.own.keys():
                make_for_c_hosts(fmus.parts[slot])
        system = write_ssp(robot, fmus, scratch / ssp_name(robot))
    for path in (*fmus.paths, system):
        print(out / path.name)


def simulate(
    robot_file: RobotFile,
    speeds: Annotated[Path, typer.Option(metavar="RECORDING.csv", help="Winch speeds over time; CSV, Parquet or MDF.")],
    out: Annotated[Path, typer.Option(metavar="RESULT.csv", help="Where the result goes; Parquet if .parquet.")],
    step: Annotated[float, typer.Option(help="Longest macro step, s.")] = 0.01,
    tolerance: Annotated[
        float | None, typer.Option(help="Error allowed, m; chooses the steps, in place of --step.")
    ] = None,
    until: Annotated[float | None, typer.Option(help="Stop at this time, s.")] = None,
    patience: Annotated[float, typer.Option(help="An FMU in the same call for so long hangs, s.")] = 60.0,
    fmu: Annotated[list[str] | None, typer.Option(metavar="SLOT=FILE", help=OWN_FMU)] = None,
) -> None:
    """Co-simulate the FMUs over recorded winch speeds; with [winch] in the robot file these are what is asked of them.

    Example: tautwire simulate robot.toml --speeds recording.csv --out result.csv
    """
    from ..fmus.slots import check_own_fmus, lacking_ports, own_fmus
    from ..output import refuse_inputs
    from ..runs.result_file import result_in_place
    from ..runs.simulation import simulate_recording
    from ..runs.wiring import result_columns

    if not step > 0.0:
        raise InputError("--step", f"{step:g} s is not positive", "give a step such as 0.01")
    if until is not None and math.isnan(until):
        raise InputError("--until", "nan is not a time", "give a time in s")
    if tolerance is not None and not tolerance > 0.0:
        raise InputError("--tolerance", f"{tolerance:g} m is not positive", "give an error such as 1e-6")
    if not patience > 0.0:
        raise InputError("--patience", f"{patience:g} s is not positive", "give a time such as 60, or inf")
    robot = robot_of(robot_file)
    robot = robot.with_fmus(own_fmus(fmu or [], robot.cable_count))
    refuse_inputs([robot_file, speeds, *(own.path for own in robot.fmus)], [out])
    check_own_fmus(robot)
    lacking = lacking_ports({own.slot: own.path for own in robot.fmus}, robot.cable_count)
    columns = result_columns(robot.cable_count, robot.winch_numbers, lacking)
    with result_in_place(out, columns) as result, progress_bar() as tell:
        account, notes = simulate_recording(robot, speeds, result, step, tolerance, until, tell, patience)
    for note in notes:
        print(note, file=sys.stderr)
    estimated = "" if account.error is None else f", estimated error {account.error:.2g} m"
    print(f"{out}: {account.steps} steps, {account.redos} redos, coupling made {account.made:.2g} J{estimated}")
