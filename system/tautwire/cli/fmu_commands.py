"""The commands ``build``, ``simulate`` and ``fmus``: FMUs built, co-simulated and listed with their ports."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..errors import InputError
from ..provenance import Provenance
from ..robot.schema import Robot, fmu_slots
from .console import (
    AsJson,
    Columns,
    CommandOutput,
    Quiet,
    RobotFile,
    command_provenance,
    progress_bar,
    read_holdable_robot,
    relative_links,
    shell_quoted,
    with_columns,
)

if TYPE_CHECKING:
    from ..cosimulation.robot_wiring import Column
    from ..cosimulation.run_arguments import SimulationOptions
    from ..cosimulation.run_statistics import RunStatistics
    from ..fmus.fmu_ports import FmuPort

NON_TERMINAL_WIDTH = 160
SETTLING_TIME = 1.0  # s, after a path
PORT_COLUMNS = ("name", "causality", "unit", "start", "description")
C_HOSTS_HELP = (
    "Build FMUs that also run in importers that are not Python processes; needs a C compiler, and Python's headers "
    "and shared library (Debian: gcc, python3-dev)."
)
CONTROLLER_HELP = (
    "A controller in place of --speeds: an FMU, a state space (.json), or Python (.py), which is executed; with --path."
)
OWN_FMU_HELP = "A user FMU for a slot, such as platform=mine.fmu, cable_2=... or winch_1=...; may be repeated."


def build(
    robot_file: RobotFile,
    out: Annotated[Path, typer.Option(help="Output folder of the FMUs.")] = Path("build"),
    for_c_hosts: Annotated[bool, typer.Option("--for-c-hosts", help=C_HOSTS_HELP)] = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Build the FMUs of a robot, and an SSP archive of them.

    There is one for each cable and each winch, and one for the platform.

    Example: tautwire build robot.toml --out build/
    """
    from ..atomic_output import atomic_folder, refuse_overwriting_inputs
    from ..cosimulation.ssp_archive import ssp_name, write_ssp
    from ..fmus.c_hosts import embeddable_python, find_compiler, make_for_c_hosts
    from ..fmus.packaging import build_fmus, with_user_fmus_copied

    output = CommandOutput(as_json, quiet)
    robot = read_holdable_robot(robot_file)
    refuse_overwriting_inputs(
        [fmu.path for fmu in robot.fmus], [out / f"{slot}.fmu" for slot in fmu_slots(robot.cable_count)]
    )
    if for_c_hosts:
        embeddable_python()
        find_compiler()
    with atomic_folder(out) as scratch, progress_bar(output) as progress:
        fmus = with_user_fmus_copied(build_fmus(robot, scratch, partial(progress, "building")), scratch)
        if for_c_hosts:
            project_slots = sorted(fmus.by_component.keys() - fmus.user_start_values.keys())
            for index, slot in enumerate(project_slots):
                progress("building for C hosts", index / len(project_slots))
                make_for_c_hosts(fmus.by_component[slot])
        archive = write_ssp(robot, fmus, scratch / ssp_name(robot))
    paths = [out / path.name for path in (*fmus.paths, archive)]
    output.result(
        paths, {"fmus": {slot: out / path.name for slot, path in fmus.by_component.items()}, "ssp": paths[-1]}
    )
    output.suggest_next(f"tautwire fmus {shell_quoted(robot_file)}, for their ports; or load {paths[-1]} in your tool")


def simulate(
    context: typer.Context,
    robot_file: RobotFile,
    out: Annotated[Path, typer.Option(metavar="RESULT.csv", help="Output file of the result; Parquet if .parquet.")],
    speeds: Annotated[
        Path | None, typer.Option(metavar="RECORDING.csv", help="Winch speeds; CSV, Parquet, MDF or .mat.")
    ] = None,
    controller: Annotated[Path | None, typer.Option(metavar="FILE", help=CONTROLLER_HELP)] = None,
    path: Annotated[Path | None, typer.Option(metavar="PATH.toml", help="Path to follow with --controller.")] = None,
    step: Annotated[float, typer.Option(help="Longest macro step, s.")] = 0.01,
    tolerance: Annotated[
        float | None, typer.Option(help="Error tolerance, m; adaptive steps instead of --step.")
    ] = None,
    columns: Columns = None,
    until: Annotated[float | None, typer.Option(help="Stop at this time, s.")] = None,
    patience: Annotated[float, typer.Option(help="Timeout of one FMU call, s.")] = 60.0,
    fmu: Annotated[list[str] | None, typer.Option(metavar="SLOT=FILE", help=OWN_FMU_HELP)] = None,
    report: Annotated[Path | None, typer.Option(metavar="PAGE.html", help="Output page of the run, in 3D.")] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Co-simulate the FMUs over winch speeds, or with a controller.

    Winch speeds are recorded, or a --controller moves the platform along a --path.

    With [winch] in the robot file these are what is asked of the winches.

    Example: tautwire simulate robot.toml --speeds recording.csv --out result.csv --report run.html
    """
    from ..atomic_output import refuse_other_formats, refuse_overwriting_inputs, refuse_same_output
    from ..cosimulation.recording_simulation import read_recorded_inputs, simulate_recording
    from ..cosimulation.result_file import open_result_file
    from ..cosimulation.run_arguments import SimulationOptions, validate_numbers
    from ..fmus.fmu_slots import check_user_fmus, parse_user_fmus
    from ..reports.run_overview import RecorderPair, RunOverview
    from ..reports.run_page import PageFile, atomic_run_page

    validate_numbers("--", step, tolerance, patience, until)
    output = CommandOutput(as_json, quiet)
    robot = with_columns(read_holdable_robot(robot_file), columns)
    robot = robot.with_fmus(parse_user_fmus(fmu or [], robot.cable_count))
    refuse_other_formats(out, ".csv", ".parquet")
    refuse_other_formats(report, ".html", option="--report")
    if controller is not None or path is not None or speeds is None:
        open_loop_options = {"--report": report, "--tolerance": tolerance, "--columns": columns}
        _refuse_mixed_inputs(speeds, controller, path, open_loop_options)
        assert controller is not None and path is not None
        refuse_overwriting_inputs([robot_file, controller, path, *(own.path for own in robot.fmus)], [out])
        options = SimulationOptions(step, None, until, patience)
        _simulate_closed_loop(context, robot, LawFiles(robot_file, controller, path, out), options, output)
        return
    refuse_overwriting_inputs(
        [robot_file, speeds, *([columns] if columns else []), *(own.path for own in robot.fmus)],
        [out, *([report] if report else [])],
    )
    refuse_same_output(out, report)
    check_user_fmus(robot)
    recorded, result_columns = read_recorded_inputs(robot, speeds, until), _result_columns(robot)
    overview, provenance = RunOverview(), command_provenance(context, robot_file, speeds, columns, fmus=robot.fmus)
    page_file = None if report is None else PageFile(report, relative_links(report, robot_file, out), provenance)
    with (
        atomic_run_page(page_file, robot, result_columns, overview, speeds) as write_page,
        open_result_file(out, result_columns, provenance) as result,
        progress_bar(output) as progress,
    ):
        recorder = result if report is None else RecorderPair(result, overview)
        options = SimulationOptions(step, tolerance, until, patience)
        statistics, notes = simulate_recording(recorded, recorder, options, progress)
        write_page(statistics, notes)
    for note in notes:
        output.note(note)
    written = {"result": out} | ({"report": report} if report else {})
    _print_statistics(statistics, notes, written, provenance, output)
    named = "" if columns is None else f" --columns {shell_quoted(columns)}"
    trace_command = f"tautwire trace {shell_quoted(robot_file)} {shell_quoted(speeds)}{named} --out report/"
    output.suggest_next(f"{trace_command}, if positions or tensions were measured too")


def _refuse_mixed_inputs(
    speeds: Path | None, controller: Path | None, path: Path | None, open_loop_options: Mapping[str, object]
) -> None:
    """Refuse a run that is neither over recorded speeds nor, completely, with a controller."""
    if controller is None and path is None:
        raise InputError("--speeds", "is missing", "give it, or --controller and --path")
    if speeds is not None:
        raise InputError("--speeds", "is given beside --controller or --path", "give one of them")
    if controller is None or path is None:
        missing = "--controller" if controller is None else "--path"
        raise InputError(missing, "is missing", "give --controller and --path together")
    for name, value in open_loop_options.items():
        if value is not None:
            raise InputError(name, "is not available with --controller", "leave it out")


@dataclass(frozen=True)
class LawFiles:
    """The files of a closed loop: the robot's, the control law, its path, and the result."""

    robot: Path
    controller: Path
    path: Path
    out: Path


def _simulate_closed_loop(
    context: typer.Context, robot: Robot, files: LawFiles, options: SimulationOptions, output: CommandOutput
) -> None:
    """Co-simulate with a controller."""
    from ..campaigns.campaign_run import path_trajectory
    from ..campaigns.plan_file import read_path_file
    from ..control import ClosedLoopOptions, cosimulate_closed_loop
    from ..control.controller_file import read_controller
    from ..cosimulation.result_file import open_result_file
    from ..fmus.packaging import build_fmus

    trajectory = path_trajectory(robot, read_path_file(files.path, robot))
    law = read_controller(files.controller)
    provenance = command_provenance(context, files.robot, files.controller, files.path, fmus=robot.fmus)
    duration = trajectory.duration + SETTLING_TIME if options.until is None else options.until
    with (
        TemporaryDirectory(prefix="tautwire-simulate-") as folder,
        open_result_file(files.out, _result_columns(robot), provenance) as result,
        progress_bar(output) as progress,
    ):
        fmus = build_fmus(robot, Path(folder), partial(progress, "building"))
        loop_options = ClosedLoopOptions(
            step=options.step, progress=partial(progress, "co-simulating"), patience=options.call_timeout
        )
        motion = cosimulate_closed_loop(fmus, robot, law, trajectory, duration, loop_options)
        for row in motion.frame().to_numpy():
            result.add(float(row[0]), row[1:])
    notes = motion.statistics.warnings()
    for note in notes:
        output.note(note)
    _print_statistics(motion.statistics, notes, {"result": files.out}, provenance, output)


def _result_columns(robot: Robot) -> list[Column]:
    """Columns of the result file, without those of ports that user FMUs lack."""
    from ..cosimulation.robot_wiring import result_columns
    from ..fmus.fmu_slots import missing_user_fmu_ports

    missing_ports = missing_user_fmu_ports({own.slot: own.path for own in robot.fmus}, robot.cable_count)
    return result_columns(robot.cable_count, robot.winch_numbers, missing_ports)


def _print_statistics(
    statistics: RunStatistics,
    notes: Sequence[str],
    written: Mapping[str, Path],
    provenance: Provenance,
    output: CommandOutput,
) -> None:
    error_text = "" if statistics.estimated_error is None else f", estimated error {statistics.estimated_error:.2g} m"
    summary_lines = [
        f"{written['result']}: {statistics.steps} steps, {statistics.iterations} iterations, energy residual "
        f"{statistics.energy_residual:.2g} J{error_text}"
    ]
    statistics_record = {
        "steps": statistics.steps,
        "redos": statistics.iterations,
        "energy_made": statistics.energy_residual,
        "error": statistics.estimated_error,
    }
    pages = [written["report"]] if "report" in written else []
    output.result(
        [*summary_lines, *pages], {**written, **statistics_record, "notes": notes, "provenance": provenance.document()}
    )


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
