"""The commands ``build`` and ``fmus``: FMUs built, and listed with their ports."""

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

from ..errors import InputError
from ..robot.schema import Robot, fmu_slots
from .console import (
    AsJson,
    CommandOutput,
    Quiet,
    RobotFile,
    progress_bar,
    read_holdable_robot,
    shell_quoted,
)

if TYPE_CHECKING:
    from ..fmus.fmu_ports import FmuPort

NON_TERMINAL_WIDTH = 160
PORT_COLUMNS = ("name", "causality", "unit", "start", "description")
C_HOSTS_HELP = (
    "Build FMUs that also run in importers that are not Python processes; needs a C compiler, and Python's headers "
    "and shared library (Debian: gcc, python3-dev)."
)
NATIVE_HELP = (
    'Build FMUs of machine code, which need no Python: by ziglang (pip install "tautwire[native]"), else by the '
    "machine's C compiler."
)
CO_SIMULATION_HELP = (
    "Build --native FMUs for co-simulation only, without model exchange, which some tools would prefer."
)
WHOLE_HELP = (
    "Build the whole robot as one --native FMU, robot.fmu: winch speeds and an external load in; pose, tensions and "
    "rope lengths out."
)
PLATFORMS_HELP = "Platforms of --native FMUs: linux64, win64, darwin64, aarch64-linux, aarch64-darwin, or all."


def build(
    robot_file: RobotFile,
    out: Annotated[Path, typer.Option(help="Output folder of the FMUs.")] = Path("build"),
    for_c_hosts: Annotated[bool, typer.Option("--for-c-hosts", help=C_HOSTS_HELP)] = False,
    native: Annotated[bool, typer.Option("--native", help=NATIVE_HELP)] = False,
    whole: Annotated[bool, typer.Option("--whole", help=WHOLE_HELP)] = False,
    platforms: Annotated[str, typer.Option(metavar="LIST", help=PLATFORMS_HELP)] = "",
    fmi: Annotated[int, typer.Option(help="Version of FMI, 2 or 3; the latter for --native FMUs.")] = 2,
    co_simulation_only: Annotated[bool, typer.Option("--co-simulation-only", help=CO_SIMULATION_HELP)] = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Build the FMUs of a robot, and an SSP archive of them.

    There is one for each cable and each winch, and one for the platform; with --whole there is one for all together.

    Example: tautwire build robot.toml --out build/
    """
    from ..atomic_output import atomic_folder, refuse_overwriting_inputs
    from ..cosimulation.ssp_archive import ssp_name, write_ssp
    from ..fmus.c_hosts import embeddable_python, find_compiler, make_for_c_hosts
    from ..fmus.packaging import build_fmus, with_user_fmus_copied
    from ..robot.rigid_equilibrium import orientation_notes

    output = CommandOutput(as_json, quiet)
    robot = read_holdable_robot(robot_file)
    targets = [name.strip() for name in platforms.split(",") if name.strip()]
    native_options = {"--whole": whole, "--platforms": bool(platforms), "--co-simulation-only": co_simulation_only}
    _refuse_mixed_kinds(for_c_hosts, native or robot.native_fmus, fmi, native_options)
    if whole:
        _build_whole(robot, out, targets, fmi, output)
        return
    refuse_overwriting_inputs(
        [fmu.path for fmu in robot.fmus], [out / f"{slot}.fmu" for slot in fmu_slots(robot.cable_count)]
    )
    if for_c_hosts:
        embeddable_python()
        find_compiler()
    with atomic_folder(out) as scratch, progress_bar(output) as progress:
        built = build_fmus(robot, scratch, partial(progress, "building"), native, targets, fmi, co_simulation_only)
        fmus = with_user_fmus_copied(built, scratch)
        if for_c_hosts:
            project_slots = sorted(fmus.by_component.keys() - fmus.user_start_values.keys())
            for index, slot in enumerate(project_slots):
                progress("building for C hosts", index / len(project_slots))
                make_for_c_hosts(fmus.by_component[slot])
        archive = write_ssp(robot, fmus, scratch / ssp_name(robot))
    for note in orientation_notes(robot):
        output.note(note)
    paths = [out / path.name for path in (*fmus.paths, archive)]
    output.result(
        paths, {"fmus": {slot: out / path.name for slot, path in fmus.by_component.items()}, "ssp": paths[-1]}
    )
    output.suggest_next(f"tautwire fmus {shell_quoted(robot_file)}, for their ports; or load {paths[-1]} in your tool")


def _build_whole(robot: Robot, out: Path, targets: Sequence[str], fmi: int, output: CommandOutput) -> None:
    """Build the one FMU of a whole robot."""
    from ..atomic_output import atomic_folder
    from ..fmus.packaging import build_whole_fmu
    from ..robot.rigid_equilibrium import orientation_notes

    with atomic_folder(out) as scratch, progress_bar(output) as progress:
        path = out / build_whole_fmu(robot, scratch, partial(progress, "building"), targets, fmi).name
    for note in orientation_notes(robot):
        output.note(note)
    output.result([path], {"fmus": {"robot": path}})
    output.suggest_next(f"load {path} in your tool")


def _refuse_mixed_kinds(for_c_hosts: bool, native: bool, fmi: int, native_options: Mapping[str, bool]) -> None:
    if native and for_c_hosts:
        raise InputError("--for-c-hosts", "is given beside native FMUs, which any program can run", "leave it out")
    for option, is_given in native_options.items():
        if is_given and not native:
            raise InputError(option, "is given without --native", "add --native")
    if fmi != 2 and not (native and fmi == 3):
        raise InputError("--fmi", f"is {fmi}" + ("" if native else " without --native"), "give 2, or --native --fmi 3")


def fmus(robot_file: RobotFile, as_json: AsJson = False, quiet: Quiet = False) -> None:
    """List the ports of each FMU with units and causality.

    Example: tautwire fmus robot.toml
    """
    from ..fmus.fmu_ports import fmu_ports
    from ..fmus.packaging import build_fmus

    output = CommandOutput(as_json, quiet)
    robot = read_holdable_robot(robot_file)
    with TemporaryDirectory(prefix="tautwire-fmus-") as folder, progress_bar(output) as progress:
        paths = build_fmus(robot, Path(folder), partial(progress, "building")).by_component
        ports = {slot: fmu_ports(path) for slot, path in paths.items()}
    listing = [{"fmu": slot, "ports": [asdict(port) for port in slot_ports]} for slot, slot_ports in ports.items()]
    output.result((), {"robot": robot.name, "fmus": listing})
    if as_json or quiet:
        return
    # Without a terminal rich would cut tables to a default width.
    console = Console(width=None if sys.stdout.isatty() else NON_TERMINAL_WIDTH)
    for table in port_tables(ports):
        console.print(table)
    output.suggest_next(f"tautwire build {shell_quoted(robot_file)} --out build/")


def port_tables(ports: Mapping[str, Sequence[FmuPort]]) -> list[Table]:
    """Tables of the ports of each FMU; FMUs with the same ports share one, with the start values of the first."""
    from ..fmus.fmu_ports import group_vectors

    slots_by_port_names: dict[tuple[str, ...], list[str]] = {}
    for slot, slot_ports in ports.items():
        slots_by_port_names.setdefault(tuple(port.name for port in slot_ports), []).append(slot)
    tables = []
    for names in slots_by_port_names.values():
        title = ", ".join(f"{slot}.fmu" for slot in names) + (", start values of the first" if len(names) > 1 else "")
        table = Table(*PORT_COLUMNS, title=title, title_justify="left", title_style="bold", box=None)
        for port in group_vectors(ports[names[0]]):
            start = "" if port.start is None else port.start
            table.add_row(port.name, port.causality, port.unit or "", start, Text(port.description))
        tables.append(table)
    return tables
