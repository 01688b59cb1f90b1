"""The command ``simulate``: FMUs co-simulated over recorded winch speeds, or with a controller on a path."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError
from ..provenance import Provenance
from ..robot.schema import Robot
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
    trace_command,
    with_columns,
)

if TYPE_CHECKING:
    from ..cosimulation.result_file import ResultFile
    from ..cosimulation.robot_cosimulation import CosimulationResult
    from ..cosimulation.robot_wiring import Column
    from ..cosimulation.run_arguments import SimulationOptions
    from ..cosimulation.run_statistics import RunStatistics

SETTLING_TIME = 1.0  # s, after a path
CONTROLLER_HELP = (
    "A controller in place of --speeds: an FMU, a state space (.json), or Python (.py), which is executed; with --path."
)
OWN_FMU_HELP = "A user FMU for a slot, such as platform=mine.fmu, cable_2=... or winch_1=...; may be repeated."
NATIVE_HELP = "Run the FMUs as machine code; needs ziglang or a C compiler."


@dataclass(frozen=True)
class SimulationFiles:
    """The files of a run: robot and result, and either recorded speeds, or a control law with its path."""

    robot: Path
    out: Path
    speeds: Path | None
    columns: Path | None
    controller: Path | None
    path: Path | None
    report: Path | None

    @property
    def inputs(self) -> list[Path]:
        """What is read, in the order in which provenance names it."""
        paths = (self.robot, self.speeds, self.columns, self.controller, self.path)
        return [path for path in paths if path is not None]


def simulate(
    context: typer.Context,
    robot_file: RobotFile,
    out: Annotated[Path, typer.Option(metavar="RESULT.csv", help="Output file of the result; Parquet if .parquet.")],
    speeds: Annotated[
        Path | None, typer.Option(metavar="RECORDING.csv", help="Winch speeds; CSV, Parquet, MDF, .mat or a ROS bag.")
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
    native: Annotated[bool, typer.Option("--native", help=NATIVE_HELP)] = False,
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
    from ..cosimulation.run_arguments import SimulationOptions, validate_numbers
    from ..fmus.fmu_slots import parse_user_fmus

    validate_numbers("--", step, tolerance, patience, until)
    output = CommandOutput(as_json, quiet)
    files = SimulationFiles(robot_file, out, speeds, columns, controller, path, report)
    robot = with_columns(read_holdable_robot(robot_file), columns)
    robot = robot.with_fmus(parse_user_fmus(fmu or [], robot.cable_count))
    refuse_other_formats(out, ".csv", ".parquet")
    refuse_other_formats(report, ".html", option="--report")
    is_open_loop = speeds is not None and controller is None and path is None
    if not is_open_loop:
        _refuse_mixed_inputs(files, tolerance)
    refuse_overwriting_inputs([*files.inputs, *(own.path for own in robot.fmus)], [out, *([report] if report else [])])
    refuse_same_output(out, report)
    options = SimulationOptions(step, tolerance, until, patience, native)
    # Only after reading, since a file that cannot be read has its own message.
    describe_origin = partial(command_provenance, context, *files.inputs, fmus=robot.fmus)
    (_simulate_recording if is_open_loop else _simulate_closed_loop)(robot, files, options, describe_origin, output)


def _refuse_mixed_inputs(files: SimulationFiles, tolerance: float | None) -> None:
    """Refuse a run that is neither over recorded speeds nor, completely, with a controller."""
    if files.controller is None and files.path is None:
        raise InputError("--speeds", "is missing", "give it, or --controller and --path")
    if files.speeds is not None:
        raise InputError("--speeds", "is given beside --controller or --path", "give one of them")
    if files.controller is None or files.path is None:
        missing = "--controller" if files.controller is None else "--path"
        raise InputError(missing, "is missing", "give --controller and --path together")
    open_loop_options = {"--report": files.report, "--tolerance": tolerance, "--columns": files.columns}
    for name, value in open_loop_options.items():
        if value is not None:
            raise InputError(name, "is not available with --controller", "leave it out")


def _simulate_recording(
    robot: Robot,
    files: SimulationFiles,
    options: SimulationOptions,
    describe_origin: Callable[[], Provenance],
    output: CommandOutput,
) -> None:
    """Co-simulate over recorded winch speeds."""
    from ..cosimulation.recording_simulation import read_recorded_inputs, simulate_recording
    from ..cosimulation.result_file import open_result_file
    from ..fmus.fmu_slots import check_user_fmus
    from ..reports.run_overview import RecorderPair, RunOverview
    from ..reports.run_page import PageFile, atomic_run_page

    assert files.speeds is not None
    check_user_fmus(robot)
    recorded = read_recorded_inputs(robot, files.speeds, options.until)
    provenance = describe_origin()
    result_columns, overview, report = _result_columns(robot), RunOverview(), files.report
    page_file = None if report is None else PageFile(report, relative_links(report, files.robot, files.out), provenance)
    with (
        atomic_run_page(page_file, robot, result_columns, overview, files.speeds) as write_page,
        open_result_file(files.out, result_columns, provenance) as result,
        progress_bar(output) as progress,
    ):
        recorder = result if report is None else RecorderPair(result, overview)
        statistics, notes = simulate_recording(recorded, recorder, options, progress)
        write_page(statistics, notes)
    written = {"result": files.out} | ({"report": report} if report else {})
    _print_statistics(statistics, notes, written, provenance, output)
    if not robot.platform.is_rigid_body:
        next_command = trace_command(files.robot, files.speeds, columns=files.columns)
        output.suggest_next(f"{next_command}, if positions or tensions were measured too")


def _simulate_closed_loop(
    robot: Robot,
    files: SimulationFiles,
    options: SimulationOptions,
    describe_origin: Callable[[], Provenance],
    output: CommandOutput,
) -> None:
    """Co-simulate with a controller."""
    from ..campaigns.plan_file import read_path_file
    from ..campaigns.reference_input import at_path_start, path_trajectory
    from ..control import ClosedLoopOptions, cosimulate_closed_loop
    from ..control.controller_file import read_controller
    from ..cosimulation.result_file import open_result_file
    from ..cosimulation.robot_cosimulation import RunError
    from ..fmus.fmu_slots import check_user_fmus
    from ..fmus.packaging import build_fmus

    assert files.controller is not None and files.path is not None
    check_user_fmus(robot)
    path = read_path_file(files.path, robot)
    robot = at_path_start(robot, path)
    trajectory = path_trajectory(robot, path)
    law = read_controller(files.controller, robot.cable_count, robot.platform.is_rigid_body)
    provenance = describe_origin()
    duration = trajectory.duration + SETTLING_TIME if options.until is None else options.until
    with (
        TemporaryDirectory(prefix="tautwire-simulate-") as folder,
        open_result_file(files.out, _result_columns(robot), provenance) as result,
        progress_bar(output) as progress,
    ):
        fmus = build_fmus(robot, Path(folder), partial(progress, "building"), native=options.native)
        loop_options = ClosedLoopOptions(
            step=options.step, progress=partial(progress, "co-simulating"), patience=options.call_timeout
        )
        try:
            motion = cosimulate_closed_loop(fmus, robot, law, trajectory, duration, loop_options)
        except RunError as error:
            _add_rows(result, error.result)
            raise
        _add_rows(result, motion)
    notes = _closed_loop_notes(robot, motion)
    _print_statistics(motion.statistics, notes, {"result": files.out}, provenance, output)


def _add_rows(result: ResultFile, motion: CosimulationResult) -> None:
    for row in motion.frame().to_numpy():
        result.add(float(row[0]), row[1:])


def _closed_loop_notes(robot: Robot, motion: CosimulationResult) -> tuple[str, ...]:
    """Notes on a run with a controller: on units, columns, and what the FMUs lack."""
    from ..cosimulation.recording_simulation import missing_column_notes
    from ..fmus.fmu_slots import notes_on_user_fmus

    missing = missing_column_notes(motion.missing_columns)
    statistics = motion.statistics
    return (*notes_on_user_fmus(robot), *missing, *statistics.fallback_notes(), *statistics.warnings())


def _result_columns(robot: Robot) -> list[Column]:
    """Columns of the result file, without those of ports that user FMUs lack."""
    from ..cosimulation.robot_wiring import result_columns
    from ..fmus.fmu_slots import missing_user_fmu_ports

    is_rigid = robot.platform.is_rigid_body
    missing_ports = missing_user_fmu_ports({own.slot: own.path for own in robot.fmus}, robot.cable_count, is_rigid)
    return result_columns(robot.cable_count, robot.winch_numbers, missing_ports, is_rigid)


def _print_statistics(
    statistics: RunStatistics,
    notes: Sequence[str],
    written: Mapping[str, Path],
    provenance: Provenance,
    output: CommandOutput,
) -> None:
    """Print notes, and the run's statistics as the result."""
    for note in notes:
        output.note(note)
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
