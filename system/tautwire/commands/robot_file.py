"""Robot files: a new one, and all that is wrong with one."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from ..errors import InputError
from .shared import AsJson, Quiet, RobotFile, Voice, progress_bar

SUFFIX = ".toml"
WRONG_INPUT = 2


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="The robot's name; the file is NAME.toml.")],
    cables: Annotated[int, typer.Option(help="How many cables.", min=3, max=12)] = 3,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Take the place of a file of that name.")] = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Write a commented robot file to begin with.

    It has every key with what it means, and can be run as it stands.

    Example: tautwire new hall --cables 4
    """
    from ..output import file_in_place
    from ..robots.template import new_robot_text

    voice = Voice(as_json, quiet)
    target = Path(name if name.endswith(SUFFIX) else f"{name}{SUFFIX}")
    robot = target.name.removesuffix(SUFFIX)
    if not robot.strip() or not robot.isprintable():
        raise InputError("NAME", f"{robot!r} is no name", "give one line of printable text, such as hall")
    if target.exists() and not overwrite:
        raise InputError(str(target), "is there already", "choose another name, or add --overwrite")
    with file_in_place(target) as scratch:
        scratch.write_text(new_robot_text(robot, cables), encoding="utf-8")
    voice.result([target], {"robot": target})
    voice.next(f"put your robot's numbers into {target}, then tautwire check {target}")


def check(
    robot_file: RobotFile,
    recording: Annotated[
        Path | None, typer.Argument(metavar="RECORDING.csv", help="A recording of it; CSV, Parquet or MDF.")
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Say all that is wrong with a robot file and a recording.

    Each problem is a line, which names the line of the file; the exit status is 2 if there are problems. Otherwise it
    says what a trace would do to the recording before looking at it.

    Example: tautwire check robot.toml recording.csv
    """
    from ..checking import check_files

    voice = Voice(as_json, quiet)
    with progress_bar(voice) as tell:
        checked = check_files(robot_file, recording, tell)
    problems = [asdict(problem) for problem in checked.problems]
    for note in () if as_json else checked.notes:
        voice.note(note)
    # What is wrong is said however quiet it is to be.
    Voice(as_json).result(checked.problems, {"problems": problems, "notes": checked.notes})
    if checked.problems:
        files = len({problem.file for problem in checked.problems})
        voice.next(f"mend {_count(len(problems), 'problem')} in {_count(files, 'file')}, then run this again")
        raise typer.Exit(WRONG_INPUT)
    if not as_json:
        voice.result([f"{file}: nothing is wrong" for file in (robot_file, recording) if file], {})
    commands = f"trace {robot_file} {recording} --out report/" if recording else f"build {robot_file} --out build/"
    voice.next(f"tautwire {commands}")


def _count(number: int, what: str) -> str:
    return f"{number} {what}" + ("" if number == 1 else "s")
