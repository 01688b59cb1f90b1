"""The commands ``new`` and ``check``: a robot file to begin with, and a check of robot file and recording."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from .console import AsJson, CommandOutput, Quiet, RobotFile, progress_bar

ROBOT_FILE_SUFFIX = ".toml"
EXIT_WRONG_INPUT = 2


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="The robot's name; the file is NAME.toml.")],
    cables: Annotated[int, typer.Option(help="Number of cables.", min=3, max=12)] = 3,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace a file of that name.")] = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Write a commented robot file to fill in.

    It has every key with what it means, and can be run as it stands.

    Example: tautwire new hall --cables 4
    """
    from ..atomic_output import atomic_file
    from ..robot.robot_template import new_robot_text

    output = CommandOutput(as_json, quiet)
    target = Path(name if name.endswith(ROBOT_FILE_SUFFIX) else f"{name}{ROBOT_FILE_SUFFIX}")
    robot_name = target.name.removesuffix(ROBOT_FILE_SUFFIX)
    if not robot_name.strip() or not robot_name.isprintable():
        raise InputError("NAME", f"{robot_name!r} is not a valid name", "give one line of printable text, such as hall")
    if target.exists() and not overwrite:
        raise InputError(str(target), "exists already", "choose another name, or add --overwrite")
    with atomic_file(target) as scratch:
        scratch.write_text(new_robot_text(robot_name, cables), encoding="utf-8")
    output.result([target], {"robot": target})
    output.suggest_next(f"enter your robot's numbers in {target}, then tautwire check {target}")


def check(
    robot_file: RobotFile,
    recording: Annotated[
        Path | None, typer.Argument(metavar="RECORDING.csv", help="A recording of it; CSV, Parquet or MDF.")
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Check a robot file and a recording, and list every problem.

    Each problem is a line, which names the line of the file; the exit status is 2 if there are problems. Otherwise it
    says what a trace would do to the recording before looking at it.

    Example: tautwire check robot.toml recording.csv
    """
    from .input_checks import check_files

    output = CommandOutput(as_json, quiet)
    with progress_bar(output) as progress:
        result = check_files(robot_file, recording, progress)
    problems = [asdict(problem) for problem in result.problems]
    for note in () if as_json else result.notes:
        output.note(note)
    # Problems are printed even with --quiet.
    CommandOutput(as_json).result(result.problems, {"problems": problems, "notes": result.notes})
    if result.problems:
        file_count = len({problem.file for problem in result.problems})
        output.suggest_next(
            f"correct {_count_text(len(problems), 'problem')} in {_count_text(file_count, 'file')}, then run this again"
        )
        raise typer.Exit(EXIT_WRONG_INPUT)
    if not as_json:
        output.result([f"{file}: no problems found" for file in (robot_file, recording) if file], {})
    if recording is None:
        output.suggest_next(f"tautwire build {robot_file} --out build/")
    else:
        trace_command = f"tautwire trace {robot_file} {recording} --out report/"
        output.suggest_next(f"{trace_command}; with a second recording of the robot add --check SECOND.csv")


def _count_text(count: int, noun: str) -> str:
    return f"{count} {noun}" + ("" if count == 1 else "s")
