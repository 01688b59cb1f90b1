"""FMUs built, and co-simulated."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..robots.robot import slots
from .shared import AsJson, Quiet, RobotFile, Voice, links_beside, progress_bar, robot_of

if TYPE_CHECKING:
    from ..fmus.ports import FmuPort

WIDE = 160
PORT_COLUMNS = ("name", "causality", "unit", "start", "description")
C_HOSTS = (
    "Make FMUs that also run in importers that are not Python processes; needs a C compiler, and Python's headers "
    "and shared library (Debian: gcc, python3-dev)."
)
OWN_FMU = "An FMU of yours in place of ours, such as platform=mine.fmu, cable_2=... or winch_1=...; may be repeated."


def build(
    robot_file: RobotFile,
    out: Annotated[Path, typer.Option(help="Folder for the FMUs.")] = Path("build"),
    for_c_hosts: Annotated[bool, typer.Option("--for-c-hosts", help=C_HOSTS)] = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Build the FMUs of a robot, and an SSP archive of them.

    There is one for each cable and each winch, and one for the platform.

    Example: tautwire build robot.toml --out build/
    """
    from ..fmus.c_hosts import embeddable_python, find_compiler, make_for_c_hosts
    from ..fmus.packaging import build_fmus, gathered
    from ..output import folder_in_place, refuse_inputs
    from ..runs.ssp import ssp_name, write_ssp

    voice = Voice(as_json, quiet)
    robot = robot_of(robot_file)
    refuse_inputs([fmu.path for fmu in robot.fmus], [out / f"{slot}.fmu" for slot in slots(robot.cable_count)])
    if for_c_hosts:
        embeddable_python()
        find_compiler()
    with folder_in_place(out) as scratch, progress_bar(voice) as tell:
        fmus = gathered(build_fmus(robot, scratch, partial(tell, "building")), scratch)
        if for_c_hosts:
            ours = sorted(fmus.parts.keys() - fmus.own.keys())
            for place, slot in enumerate(ours):
                tell("making them for C hosts", place / len(ours))
                make_for_c_hosts(fmus.parts[slot])
        system = write_ssp(robot, fmus, scratch / ssp_name(robot))
    paths = [out / path.name for path in (*fmus.paths, system)]
    voice.result(paths, {"fmus": {slot: out / path.name for slot, path in fmus.parts.items()}, "ssp": paths[-1]})
    voice.next(f"tautwire fmus {robot_file}, for their ports; or load {paths[-1]} in your tool")


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
    report: Annotated[Path | None, typer.Option(metavar="PAGE.html", help="The run as a page, in 3D.")] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Co-simulate the FMUs over recorded winch speeds.

    With [winch] in the robot file these are what is asked of the winches.

    Example: tautwire simulate robot.toml --speeds recording.csv --out result.csv --report run.html
    """
    from ..fmus.slots import check_own_fmus, lacking_ports, own_fmus
    from ..output import refuse_inputs, refuse_same
    from ..report.overview import Both, Overview
    from ..report.run_in_place import page_in_place
    from ..runs.asked import require_numbers
    from ..runs.result_file import result_in_place
    from ..runs.simulation import simulate_recording
    from ..runs.wiring import result_columns

    require_numbers("--", step, tolerance, patience, until)
    voice = Voice(as_json, quiet)
    robot = robot_of(robot_file)
    robot = robot.with_fmus(own_fmus(fmu or [], robot.cable_count))
    refuse_inputs([robot_file, speeds, *(own.path for own in robot.fmus)], [out, *([report] if report else [])])
    refuse_same(out, report)
    check_own_fmus(robot)
    lacking = lacking_ports({own.slot: own.path for own in robot.fmus}, robot.cable_count)
    columns = result_columns(robot.cable_count, robot.winch_numbers, lacking)
    overview, links = Overview(), {} if report is None else links_beside(report, robot_file, out)
    with (
        page_in_place(report, robot, columns, overview, speeds, links) as finish,
        result_in_place(out, columns) as result,
        progress_bar(voice) as tell,
    ):
        recorder = result if report is None else Both(result, overview)
        account, notes = simulate_recording(robot, speeds, recorder, step, tolerance, until, tell, patience)
        finish(account, notes)
    for note in notes:
        voice.note(note)
    estimated = "" if account.error is None else f", estimated error {account.error:.2g} m"
    said = [f"{out}: {account.steps} steps, {account.redos} redos, coupling made {account.made:.2g} J{estimated}"]
    written = {"result": out} | ({"report": report} if report else {})
    books = {"steps": account.steps, "redos": account.redos, "energy_made": account.made, "error": account.error}
    voice.result([*said, *([report] if report else [])], {**written, **books, "notes": notes})
    voice.next(f"tautwire trace {robot_file} {speeds} --out report/, if positions or tensions were measured too")


def fmus(robot_file: RobotFile, as_json: AsJson = False, quiet: Quiet = False) -> None:
    """List the ports of each FMU with units and causality.

    Example: tautwire fmus robot.toml
    """
    from ..fmus.packaging import build_fmus
    from ..fmus.ports import fmu_ports

    voice = Voice(as_json, quiet)
    robot = robot_of(robot_file)
    with TemporaryDirectory(prefix="tautwire-fmus-") as folder, progress_bar(voice) as tell:
        paths = build_fmus(robot, Path(folder), partial(tell, "building")).parts
        ports = {slot: fmu_ports(path) for slot, path in paths.items()}
    listed = [{"fmu": slot, "ports": [asdict(port) for port in shown]} for slot, shown in ports.items()]
    voice.result((), {"robot": robot.name, "fmus": listed})
    if as_json or quiet:
        return
    # A table that is cut to the width of no terminal helps nobody.
    console = Console(width=None if sys.stdout.isatty() else WIDE)
    for table in port_tables(ports):
        console.print(table)
    voice.next(f"tautwire build {robot_file} --out build/")


def port_tables(ports: Mapping[str, Sequence[FmuPort]]) -> list[Table]:
    """A table for the ports of each FMU; one for all FMUs that show the same ones, then with the first one's starts."""
    from ..fmus.ports import vectors_together

    alike: dict[tuple[str, ...], list[str]] = {}
    for slot, shown in ports.items():
        alike.setdefault(tuple(port.name for port in shown), []).append(slot)
    tables = []
    for names in alike.values():
        title = ", ".join(f"{slot}.fmu" for slot in names) + (", starts of the first" if len(names) > 1 else "")
        table = Table(*PORT_COLUMNS, title=title, title_justify="left", title_style="bold", box=None)
        for port in vectors_together(ports[names[0]]):
            start = "" if port.start is None else port.start
            table.add_row(port.name, port.causality, port.unit or "", start, Text(port.description))
        tables.append(table)
    return tables
