"""What a model lacks, and the motion that would tell."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from ..errors import InputError
from .material import judge_rope
from .shared import RobotFile, progress_bar, robot_of, say_what_is_left_out


def trace(
    robot_file: RobotFile,
    fit: Annotated[Path, typer.Argument(metavar="FIT.csv", help="The recording to fit; CSV, Parquet or MDF.")],
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Where the report goes.")],
    check: Annotated[Path | None, typer.Option(metavar="CHECK.csv", help="A recording to judge on.")] = None,
    alpha: Annotated[float, typer.Option(help="Rate of false alarms allowed.")] = 0.01,
) -> None:
    """Find what the model lacks, add it, and report the error before and after.

    FIT may also be a dynamic test of the rope, a table with a column "frequency": see "tautwire material".

    Recorded winch speeds are what the drums' encoders give: [winch] and [fmu] of the robot file have no part in it.

    Example: tautwire trace robot.toml fit.csv --check check.csv --out report/
    """
    from ..materials.table import is_material_table
    from ..output import folder_in_place, refuse_inputs
    from ..recordings.recording import read_recording
    from ..report import trace_table, write_report
    from ..tracer import processors
    from ..tracer import trace as traced

    if not 0.0 < alpha < 1.0:
        raise InputError("--alpha", f"{alpha:g} is not a rate", "give a number between 0 and 1, such as 0.01")
    if is_material_table(fit):
        if check is not None:
            raise InputError("--check", f"{fit} is a dynamic test of a rope", "leave it out: its rows judge each other")
        judge_rope(fit, robot_file, out, alpha)
        return
    robot = robot_of(robot_file)
    recording = read_recording(fit, robot.cable_count)
    judging = None if check is None else read_recording(check, robot.cable_count)
    made = ["robot.toml", "report.json", "index.html"]
    refuse_inputs([robot_file, fit, *([check] if check else [])], [out / name for name in made])
    with folder_in_place(out) as scratch:
        with progress_bar() as tell:
            result = traced(robot, recording, judging, tell, alpha, processors())
        write_report(result, scratch)
    say_what_is_left_out(robot)
    Console().print(trace_table(result))
    print(out / "index.html")


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
) -> None:
    """A winch program after which effects can be told apart: the largest smallest separation within the limits.

    Example: tautwire excite robot.toml --effects damping,relaxation,hysteresis --out program.csv
    """
    from ..excitation import default_limits
    from ..excitation import excite as excited
    from ..excitation.limits import named_effects
    from ..output import file_in_place, refuse_inputs

    refuse_inputs([robot_file], [out])
    robot = robot_of(robot_file)
    chosen = named_effects(robot, effects)
    with progress_bar() as tell:
        found = excited(robot, chosen, default_limits(robot, speed, reach), duration, 1.0 / rate, programs, seed, tell)
    with file_in_place(out) as scratch:
        found.frame().to_csv(scratch, index=False, float_format="%.10g")
    for pair in found.pairs[:5]:
        print(f"{pair.effect.label(robot)}, and {pair.other.label(robot)} in its place: {pair.nats:.3g} nats apart")
    print(f"closest pair of the median program: {found.typical:.3g} nats")
    print(out)
