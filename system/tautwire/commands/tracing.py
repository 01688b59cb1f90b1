"""The commands ``trace`` and ``excite``: identification of missing effects, and the design of excitation for it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from ..errors import InputError
from .material import judge_rope_material
from .shared import AsJson, CommandOutput, Quiet, RobotFile, note_unused_tables, progress_bar, read_holdable_robot


def trace(
    robot_file: RobotFile,
    fit: Annotated[Path, typer.Argument(metavar="FIT.csv", help="The recording to fit; CSV, Parquet or MDF.")],
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Where the report goes.")],
    check: Annotated[Path | None, typer.Option(metavar="CHECK.csv", help="A recording to judge on.")] = None,
    alpha: Annotated[float, typer.Option(help="Rate of false alarms allowed.")] = 0.01,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Find what the model lacks, and add it to the FMUs.

    The report shows the error before and after.

    FIT may also be a dynamic test of the rope, a table with a column "frequency": see "tautwire material".

    Recorded winch speeds are what the drums' encoders give: [winch] and [fmu] of the robot file have no part in it.

    Example: tautwire trace robot.toml fit.csv --check check.csv --out report/
    """
    from ..materials.table import is_material_table
    from ..output import atomic_folder, refuse_overwriting_inputs
    from ..recordings.recording import read_recording
    from ..report import trace_document, trace_table, write_report
    from ..tracer import processors
    from ..tracer import trace as traced
    from ..tracer.asked import validated_false_alarm_rate

    validated_false_alarm_rate("--alpha", alpha)
    output = CommandOutput(as_json, quiet)
    if is_material_table(fit):
        if check is not None:
            raise InputError("--check", f"{fit} is a dynamic test of a rope", "leave it out: its rows judge each other")
        judge_rope_material(fit, robot_file, out, alpha, output)
        return
    robot = read_holdable_robot(robot_file)
    recording = read_recording(fit, robot.cable_count)
    check_recording = None if check is None else read_recording(check, robot.cable_count)
    file_names = ["robot.toml", "report.json", "index.html"]
    refuse_overwriting_inputs([robot_file, fit, *([check] if check else [])], [out / name for name in file_names])
    with atomic_folder(out) as scratch, progress_bar(output) as progress:
        trace_result = traced(robot, recording, check_recording, progress, alpha, processors())
        progress("writing the report", 0.0)
        write_report(trace_result, scratch)
    note_unused_tables(robot, output)
    if not (quiet or as_json):
        Console().print(trace_table(trace_result))
    output.result([out / "index.html"], {"folder": out, **trace_document(trace_result)})
    output.suggest_next(
        f"open {out / 'index.html'}; {out / 'robot.toml'} is the robot as found, its FMUs are beside it"
    )


def excite(
    robot_file: RobotFile,
    out: Annotated[Path, typer.Option(metavar="PROGRAM.csv", help="Where the winch speeds go; a recording's form.")],
    effects: Annotated[str | None, typer.Option(help="Effects to tell apart, with commas; all when absent.")] = None,
    speed: Annotated[float | None, typer.Option(help="Largest winch speed, m/s; [winch] or 0.5.", min=1e-6)] = None,
    reach: Annotated[float | None, typer.Option(help="Farthest from the start along an axis, m.", min=1e-6)] = None,
    duration: Annotated[float, typer.Option(help="s", min=1.0, max=3600.0)] = 30.0,
    rate: Annotated[float, typer.Option(help="Samples per second.", min=1.0, max=1000.0)] = 50.0,
    programs: Annotated[int, typer.Option(help="About how many programs are tried.", min=1, max=100_000)] = 64,
    seed: Annotated[int, typer.Option(help="The same seed gives the same program.", min=0)] = 0,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Design a motion after which effects can be told apart.

    The largest smallest separation within the limits, as winch speeds.

    Example: tautwire excite robot.toml --effects damping,relaxation,hysteresis --out program.csv
    """
    from ..excitation import default_limits
    from ..excitation import design_excitation as excited
    from ..excitation.limits import effects_by_name
    from ..output import atomic_file, refuse_overwriting_inputs

    output = CommandOutput(as_json, quiet)
    refuse_overwriting_inputs([robot_file], [out])
    robot = read_holdable_robot(robot_file)
    selected_effects = effects_by_name(robot, effects)
    with progress_bar(output) as progress:
        excitation = excited(
            robot, selected_effects, default_limits(robot, speed, reach), duration, 1.0 / rate, programs, seed, progress
        )
    with atomic_file(out) as scratch:
        excitation.frame().to_csv(scratch, index=False, float_format="%.10g")
    pairs = [(pair.effect.label(robot), pair.other.label(robot), pair.nats) for pair in excitation.pairs]
    lines = [f"{effect}, and {other} in its place: {nats:.3g} nats apart" for effect, other, nats in pairs[:5]]
    median_line = f"closest pair of the median program: {excitation.median_separation:.3g} nats"
    pair_records = [{"effect": effect, "other": other, "nats": nats} for effect, other, nats in pairs]
    output.result(
        [*lines, median_line, out], {"program": out, "pairs": pair_records, "median": excitation.median_separation}
    )
    trace_command = f"tautwire trace {robot_file} RECORDING.csv --out report/"
    output.suggest_next(f"run it on the robot, record positions and tensions, then {trace_command}")
