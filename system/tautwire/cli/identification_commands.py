"""The commands ``trace``, ``excite`` and ``material``: identification of robots and ropes, and its excitation."""

from __future__ import annotations

import math
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from ..errors import InputError
from ..process_signals import exit_on_overdue_interrupt, own_temporary_folder
from ..provenance import Provenance
from ..robot.robot_file_reader import read_robot
from .console import (
    INTERRUPTED,
    AsJson,
    Columns,
    CommandOutput,
    Quiet,
    RobotFile,
    TrackerFile,
    command_provenance,
    note_unused_tables,
    print_error,
    progress_bar,
    read_holdable_robot,
    read_plausible_robot,
    shell_quoted,
    with_columns,
)

if TYPE_CHECKING:
    from ..estimation import Trace
    from ..estimation.hypotheses import Hypothesis
    from ..materials import MaterialOptions, MaterialVerdict
    from ..materials.material_table import MaterialTable
    from ..materials.viscoelastic_model import Material
    from ..recordings.recording import Recording
    from ..robot.schema import Robot

DYNAMIC_TEST_HELP = "A dynamic test of the rope; by default Table 1 of the paper, with its declared pair."


def material(
    context: typer.Context,
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Output folder of fit.json and the figure.")],
    table: Annotated[Path | None, typer.Argument(metavar="TABLE.csv", help=DYNAMIC_TEST_HELP)] = None,
    at: Annotated[
        float | None, typer.Option(help="Frequency, Hz, of the row whose E' and c are the declared pair.")
    ] = None,
    robot_file: Annotated[
        Path | None,
        typer.Option("--robot", metavar="ROBOT.toml", help="A robot with this rope; written with the fitted rope."),
    ] = None,
    shared: Annotated[float, typer.Option(help="Share of each variance common to all rows.")] = 0.0,
    coverage: Annotated[float, typer.Option(help="Coverage factor of the table's uncertainties.")] = 1.0,
    alpha: Annotated[float, typer.Option(help="False-alarm rate.")] = 0.01,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Fit a rope's constants and relaxation to a dynamic test.

    Tests a constant modulus and damping, and fits viscoelastic models.

    Example: tautwire material dma.csv --robot robot.toml --out material/
    """
    from ..atomic_output import atomic_folder, refuse_overwriting_inputs
    from ..materials import PAPER_PAIR_FREQUENCY, PAPER_TABLE, MaterialOptions, pair_of_row, read_material_table
    from ..materials.material_files import MATERIAL_FILES, write_material
    from ..materials.robot_material import declared_material

    _validate_material_options(shared, alpha, coverage)
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
    options = MaterialOptions(shared_variance=shared, coverage_factor=coverage, significance_level=alpha)
    provenance = command_provenance(context, table, robot_file)
    with atomic_folder(out) as scratch:
        verdict = _fit_material(measurements, declared, options, output)
        write_material(verdict, scratch, robot, provenance, robot_file)
    _print_material(verdict, out / "fit.json", provenance, output)
    if robot is not None:
        check_command = f"tautwire check {shell_quoted(out / 'robot.toml')} RECORDING.csv"
        output.suggest_next(f"{check_command}, and trace: does the robot move like that?")


def _validate_material_options(shared: float, alpha: float, coverage: float) -> None:
    for name, value, minimum in (("--shared", shared, 0.0), ("--alpha", alpha, math.nextafter(0.0, 1.0))):
        if not minimum <= value < 1.0:
            raise InputError(name, f"{value:g} is not a share below 1", "give a number such as 0.01")
    if not 0.0 < coverage < math.inf:
        raise InputError("--coverage", f"{coverage:g} is not positive", "give 1, or 2 for intervals of 95 %")


def _fit_material(
    measurements: MaterialTable,
    declared: Material | None,
    options: MaterialOptions,
    output: CommandOutput,
) -> MaterialVerdict:
    """Fits models to a dynamic test."""
    from ..materials import trace_material

    with progress_bar(output) as progress:
        return trace_material(measurements, declared, options, progress)


def _print_material(verdict: MaterialVerdict, path: Path, provenance: Provenance, output: CommandOutput) -> None:
    from ..materials.material_files import material_document
    from ..materials.material_report import material_verdict_table

    if not (output.quiet or output.as_json):
        Console().print(material_verdict_table(verdict))
    document = {**material_document(verdict), "provenance": provenance.document()}
    output.result([path], {"folder": path.parent, **document})


def judge_rope_material(
    context: typer.Context, table: Path, robot_file: Path, out: Path, alpha: float, output: CommandOutput
) -> None:
    """Traces a robot's rope: its constants are tested against a dynamic test, and the extended robot gets its FMUs.

    Writes what :func:`material` writes, the same verdict as ``report.json``, and the FMUs.
    """
    from ..atomic_output import atomic_folder, refuse_overwriting_inputs
    from ..fmus.packaging import build_fmus
    from ..materials import MaterialOptions, read_material_table
    from ..materials.material_files import MATERIAL_FILES, write_material
    from ..materials.robot_material import declared_material

    measurements, robot = read_material_table(table), read_holdable_robot(robot_file)
    refuse_overwriting_inputs([table, robot_file], [out / name for name in (*MATERIAL_FILES, "report.json")])
    declared = declared_material(robot, str(robot_file))
    provenance = command_provenance(context, robot_file, table)
    with atomic_folder(out) as scratch:
        options = MaterialOptions(significance_level=alpha)
        verdict = _fit_material(measurements, declared, options, output)
        write_material(verdict, scratch, robot, provenance, robot_file)
        shutil.copyfile(scratch / "fit.json", scratch / "report.json")
        build_fmus(read_robot(scratch / "robot.toml"), scratch)
    _print_material(verdict, out / "report.json", provenance, output)


def trace(
    context: typer.Context,
    robot_file: RobotFile,
    fit: Annotated[
        Path, typer.Argument(metavar="FIT.csv", help="The recording to fit; CSV, Parquet, MDF, .mat or a ROS bag.")
    ],
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Output folder of the report.")],
    check: Annotated[Path | None, typer.Option(metavar="CHECK.csv", help="A recording for validation.")] = None,
    columns: Columns = None,
    tracker: TrackerFile = None,
    check_tracker: Annotated[
        Path | None, typer.Option(metavar="TRACKER.csv", help="The tracker's file of the recording for validation.")
    ] = None,
    alpha: Annotated[float, typer.Option(help="False-alarm rate.")] = 0.01,
    time_limit: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", help="Time for the best answer; 600 s by default.", min=1.0),
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Identify what the model lacks, and add it to the FMUs.

    The report shows the error before and after.

    FIT may also be a dynamic test of the rope, a table with a column "frequency": see "tautwire material".

    Recorded winch speeds are those of the drums' encoders: [winch] and [fmu] of the robot file are not used.

    Example: tautwire trace robot.toml fit.csv --check check.csv --out report/
    """
    from ..atomic_output import atomic_folder, refuse_overwriting_inputs
    from ..estimation import processors
    from ..estimation import trace as traced
    from ..estimation.identification import validated_false_alarm_rate
    from ..estimation.time_limit import TimeLimit
    from ..materials.material_table import is_material_table
    from ..reports import write_report
    from ..reports.residual_file import RESIDUAL_FILE

    validated_false_alarm_rate("--alpha", alpha)
    if check_tracker is not None and check is None:
        raise InputError("--check-tracker", "is given without --check", "name the winches' log of the same motion")
    limit = TimeLimit() if time_limit is None else TimeLimit(time_limit)
    output = CommandOutput(as_json, quiet)
    if columns is None and tracker is None and is_material_table(fit):
        problem = f"{fit} is a dynamic test of a rope"
        if check is not None:
            raise InputError("--check", problem, "omit it: its rows are cross-validated")
        if time_limit is not None:
            raise InputError("--time-limit", problem, "omit it: the rope is fitted completely")
        judge_rope_material(context, fit, robot_file, out, alpha, output)
        return
    robot = with_columns(read_plausible_robot(robot_file), columns)
    recording = _read_recording(robot, fit, tracker)
    check_recording = None if check is None else _read_recording(robot, check, check_tracker)
    file_names = ["robot.toml", "report.json", RESIDUAL_FILE, "index.html"]
    refuse_overwriting_inputs(
        [robot_file, fit, *(path for path in (check, columns, tracker, check_tracker) if path)],
        [out / name for name in file_names],
    )
    provenance = command_provenance(context, robot_file, fit, check, columns, tracker, check_tracker)
    with (
        own_temporary_folder() as temporary,
        atomic_folder(out) as scratch,
        exit_on_overdue_interrupt(lambda: _end_interrupted(temporary, scratch)),
        progress_bar(output, limit.seconds) as progress,
    ):
        trace_result = traced(robot, recording, check_recording, progress, alpha, processors(), limit)
        progress("writing the report", 0.0)
        write_report(trace_result, scratch, provenance, robot_file)
    note_unused_tables(robot, output)
    _print_trace(trace_result, out, provenance, output)


def _read_recording(robot: Robot, path: Path, tracker: Path | None) -> Recording:
    """A recording, with the positions of a tracker's file where one is given."""
    from ..recordings.recording import read_recording
    from ..recordings.tracker import with_tracker

    recording = read_recording(path, robot.cable_count, robot.recorded_columns)
    return recording if tracker is None else with_tracker(robot, recording, tracker)


def _end_interrupted(temporary: Path, scratch: Path) -> None:
    """Ends a trace whose main thread does not return."""
    from ..atomic_output import remove_staging

    shutil.rmtree(temporary, ignore_errors=True)
    remove_staging(scratch.parent)
    if sys.stderr.isatty():
        # The progress bar has hidden it.
        Console(stderr=True).show_cursor()
    print_error(f"tautwire: {INTERRUPTED}")


def _print_trace(trace_result: Trace, out: Path, provenance: Provenance, output: CommandOutput) -> None:
    from ..reports import trace_document, trace_table

    if not (output.quiet or output.as_json):
        Console().print(trace_table(trace_result))
    document = {**trace_document(trace_result), "provenance": provenance.document()}
    output.result([out / "index.html"], {"folder": out, **document})
    page, completed = shell_quoted(out / "index.html"), shell_quoted(out / "robot.toml")
    output.suggest_next(f"open {page}; {completed} is the completed robot, with its FMUs beside it")


def excite(
    context: typer.Context,
    robot_file: RobotFile,
    out: Annotated[Path, typer.Option(metavar="PROGRAM.csv", help="Output file of the winch speeds, as a recording.")],
    effects: Annotated[str | None, typer.Option(help="Effects to separate, comma-separated; by default all.")] = None,
    speed: Annotated[float | None, typer.Option(help="Largest winch speed, m/s; [winch] or 0.5.", min=1e-6)] = None,
    reach: Annotated[float | None, typer.Option(help="Farthest from the start along an axis, m.", min=1e-6)] = None,
    duration: Annotated[float, typer.Option(help="s", min=1.0, max=3600.0)] = 30.0,
    rate: Annotated[float, typer.Option(help="Samples per second.", min=1.0, max=1000.0)] = 50.0,
    programs: Annotated[int, typer.Option(help="Approximate number of programs to try.", min=1, max=100_000)] = 96,
    seed: Annotated[int, typer.Option(help="Random seed.", min=0)] = 0,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Design a motion that separates effects.

    Maximises the smallest separation between effects, within the limits.

    Example: tautwire excite robot.toml --effects damping,relaxation,hysteresis --out program.csv
    """
    from ..atomic_output import atomic_file, refuse_other_formats, refuse_overwriting_inputs
    from ..cosimulation.result_file import write_csv_metadata
    from ..estimation.excitation_limits import default_limits
    from ..estimation.input_design import DesignOptions, design_excitation, effects_by_name
    from ..provenance import refuse_foreign_csv_metadata

    output = CommandOutput(as_json, quiet)
    refuse_other_formats(out, ".csv")
    refuse_foreign_csv_metadata(out)
    refuse_overwriting_inputs([robot_file], [out])
    robot = read_holdable_robot(robot_file)
    selected_effects = effects_by_name(robot, effects)
    with progress_bar(output) as progress:
        options = DesignOptions(default_limits(robot, speed, reach), duration, 1.0 / rate, programs, seed)
        excitation = design_excitation(robot, selected_effects, options, progress)
    provenance = command_provenance(context, robot_file)
    with atomic_file(out) as scratch:
        excitation.frame().to_csv(scratch, index=False, float_format="%.10g")
    write_csv_metadata(out, provenance)
    pairs = [(pair.effect.label(robot), pair.other.label(robot), pair.nats) for pair in excitation.pairs]
    lines = [
        f"{_with_parameters(pair.effect, robot)} and {_with_parameters(pair.other, robot)}: "
        f"separation {pair.nats:.3g} nats"
        for pair in excitation.pairs[:5]
    ]
    median_line = f"closest pair of the median program: {excitation.median_separation:.3g} nats"
    pair_records = [{"effect": effect, "other": other, "nats": nats} for effect, other, nats in pairs]
    document = {"program": out, "pairs": pair_records, "median": excitation.median_separation}
    output.result([*lines, median_line, out], {**document, "provenance": provenance.document()})
    trace_command = f"tautwire trace {shell_quoted(robot_file)} RECORDING.csv --out report/"
    output.suggest_next(f"run it on the robot, record positions and tensions, then {trace_command}")


def _with_parameters(hypothesis: Hypothesis, robot: Robot) -> str:
    """Its label with the parameters that are free: an effect can have several forms."""
    return f"{hypothesis.label(robot)} ({', '.join(hypothesis.form)})"
