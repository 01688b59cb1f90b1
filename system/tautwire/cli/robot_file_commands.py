"""The commands ``new``, ``example`` and ``check``: files to begin with, and a check of robot file and recording."""

from __future__ import annotations

import math
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import InputError
from .console import (
    AsJson,
    Columns,
    CommandOutput,
    Quiet,
    RobotFile,
    TrackerFile,
    command_provenance,
    progress_bar,
    relative_links,
    shell_quoted,
    trace_command,
)

if TYPE_CHECKING:
    from ..provenance import Provenance
    from .input_checks import CheckResult

ROBOT_FILE_SUFFIX = ".toml"
EXIT_WRONG_INPUT = 2
EXAMPLES = {
    "three": "three cables of some 70 m, 300 kg; its recordings have more damping than the robot file",
    "eight": "eight cables in a hall, 60 kg; its recordings have nothing that the robot file lacks",
    "caroca": "three cables of some 4 m, 100 kg; its recordings have a payload that the robot file lacks",
    "cogiro": "CoGiRo, eight cables and a platform that turns, 91 kg; its recordings have a payload",
    "caroca8": "CAROCA with eight cables and a platform that turns, 150 kg; its centre of mass is elsewhere",
    "fast": "the cabin of FAST on six cables of some 300 m, 30 t; its recordings have more damping",
    "ipanema": "IPAnema 1, eight cables from above and below, 25 kg; nothing is missing",
}
EXAMPLE_FILES = ("robot.toml", "fit.csv", "check.csv", "plan.toml")


def new(
    context: typer.Context,
    name: Annotated[str, typer.Argument(metavar="NAME", help="The robot's name; the file is NAME.toml.")],
    cables: Annotated[int, typer.Option(help="Number of cables.", min=2, max=12)] = 3,
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
        scratch.write_text(command_provenance(context).comment() + new_robot_text(robot_name, cables), encoding="utf-8")
    output.result([target], {"robot": target})
    output.suggest_next(f"enter your robot's numbers in {target}, then tautwire check {shell_quoted(target)}")


def example(
    name: Annotated[str | None, typer.Argument(metavar="[NAME]", help="The example; absent: list all.")] = None,
    folder: Annotated[
        Path | None, typer.Argument(metavar="[FOLDER]", help="Output folder; by default NAME.", show_default=False)
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Copy a shipped example, or list all.

    The recordings are simulated: one to fit a model to, and one to check it on.

    Example: tautwire example three
    """
    from ..atomic_output import atomic_folder

    output = CommandOutput(as_json, quiet)
    if name is None:
        output.result([f"{each:<8}{text}" for each, text in EXAMPLES.items()], {"examples": EXAMPLES})
        output.suggest_next(f"tautwire example {next(iter(EXAMPLES))}")
        return
    if name not in EXAMPLES:
        raise InputError("NAME", f"{name!r} is not an example", f"give one of {', '.join(EXAMPLES)}")
    target = folder or Path(name)
    if target.exists() and not target.is_dir():
        raise InputError(str(target), "is a file", "choose another folder, as in tautwire example three FOLDER")
    robot, fit, check_recording, plan = paths = [target / file for file in EXAMPLE_FILES]
    for path in paths:
        if path.exists() or path.is_symlink():
            raise InputError(str(path), "exists already", f"choose another folder: tautwire example {name} FOLDER")
    with atomic_folder(target) as scratch:
        for file in EXAMPLE_FILES:
            shutil.copyfile(Path(__file__).parents[1] / "examples" / name / file, scratch / file)
    output.result(paths, {"robot": robot, "recordings": [fit, check_recording], "plan": plan})
    output.suggest_next(f"tautwire check {shell_quoted(robot)} {shell_quoted(fit)}")


def import_(
    context: typer.Context,
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="A CASPR model: NAME_bodies.xml, NAME_cables.xml.")],
    out: Annotated[Path, typer.Option(metavar="ROBOT.toml", help="Output file.")],
    cables: Annotated[
        str | None, typer.Option(metavar="SET", help="Cable set; by default the one that the model names.")
    ] = None,
    modulus: Annotated[float | None, typer.Option(help="Modulus of ropes that CASPR takes as ideal, Pa.")] = None,
    area: Annotated[float | None, typer.Option(help="Area of the ropes, m^2.")] = None,
    damping: Annotated[float | None, typer.Option(help="Damping of the ropes, Pa s.")] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Import a robot of CASPR as a robot file.

    It says what it assumes, as most models have ideal ropes, and what it leaves out.

    Example: tautwire import CoGiRo --out cogiro.toml
    """
    from ..atomic_output import atomic_file, refuse_other_formats, refuse_overwriting_inputs
    from ..robot.caspr_import import Rope, read_caspr_robot
    from ..robot.robot_file_text import robot_text

    output, files = CommandOutput(as_json, quiet), sorted(folder.glob("*.xml"))
    refuse_other_formats(out, ROBOT_FILE_SUFFIX)
    refuse_overwriting_inputs(files, [out])
    stated = {"modulus": modulus, "area": area, "damping": damping}
    for name, value in stated.items():
        if value is not None and not (math.isfinite(value) and value >= 0.0 and (value > 0.0 or name == "damping")):
            raise InputError(f"--{name}", f"{value} is not positive", "give a number in SI units")
    rope = replace(Rope(), **{name: value for name, value in stated.items() if value is not None})
    imported = read_caspr_robot(folder, cables, rope)
    lines = [command_provenance(context, *files).comment(), *(f"# {note}" for note in imported.notes), ""]
    with atomic_file(out) as scratch:
        scratch.write_text("\n".join([*lines, robot_text(imported.robot)]), encoding="utf-8")
    for note in imported.notes:
        output.note(note)
    output.result([out], {"robot": out, "notes": imported.notes})
    output.suggest_next(f"tautwire linearise {shell_quoted(out)} --out model.json --report modes.html")


def check(
    context: typer.Context,
    robot_file: RobotFile,
    recording: Annotated[
        Path | None,
        typer.Argument(metavar="RECORDING.csv", help="A recording of it; CSV, Parquet, MDF, .mat or a ROS bag."),
    ] = None,
    second: Annotated[
        Path | None, typer.Option("--check", metavar="CHECK.csv", help="The recording for validation, checked too.")
    ] = None,
    columns: Columns = None,
    tracker: TrackerFile = None,
    second_tracker: Annotated[
        Path | None, typer.Option("--check-tracker", metavar="TRACKER.csv", help="Tracker file of CHECK.csv.")
    ] = None,
    report: Annotated[
        Path | None, typer.Option(metavar="PAGE.html", help="Output page: what the check read, and its problems.")
    ] = None,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Check a robot file and a recording, and list every problem.

    Each problem is a line, which names the line of the file; the exit status is 2 if there are problems. Otherwise it
    says what a trace would do to the recording before looking at it. --check takes the second recording of a trace too,
    and tells whether it is another one. --report draws what was read of the first, also if there are problems.

    Example: tautwire check robot.toml recording.csv --report check.html
    """
    from ..atomic_output import refuse_other_formats, refuse_overwriting_inputs
    from .input_checks import check_both, check_files

    files = {"columns": columns, "tracker": tracker, "check": second, "check_tracker": second_tracker}
    _require_logs(recording, files)
    inputs = [path for path in (robot_file, recording, *files.values()) if path]
    refuse_other_formats(report, ".html", option="--report")
    refuse_overwriting_inputs(inputs, [report] if report else [])
    output = CommandOutput(as_json, quiet)
    with progress_bar(output) as progress:
        result = check_files(robot_file, recording, progress, columns, tracker)
        if second is not None:
            result = check_both(result, check_files(robot_file, second, progress, columns, second_tracker))
        # Of folders only a bag that was read has its files hashed.
        readable = (
            path
            for path in inputs
            if (path.is_file() and os.access(path, os.R_OK)) or (path.is_dir() and result.recording is not None)
        )
        is_reported = report is not None and _write_report(
            result, report, inputs, command_provenance(context, *readable)
        )
    problems = [asdict(problem) for problem in result.problems]
    for note in () if as_json else result.notes:
        output.note(note)
    if report is not None:
        output.note(str(report) if is_reported else f"{report} was not written: the robot file shows no geometry")
    # Problems are printed even with --quiet.
    written = {"report": report} if is_reported else {}
    CommandOutput(as_json).result(result.problems, {"problems": problems, "notes": result.notes, **written})
    if result.problems:
        file_count = len({problem.file for problem in result.problems})
        output.suggest_next(
            f"correct {_count_text(len(problems), 'problem')} in {_count_text(file_count, 'file')}, then run this again"
        )
        raise typer.Exit(EXIT_WRONG_INPUT)
    if not as_json:
        output.result(
            [f"{file}: no problems found" for file in (robot_file, recording, tracker, second, second_tracker) if file],
            {},
        )
    if recording is None:
        next_command = f"tautwire build {shell_quoted(robot_file)} --out build/"
        output.suggest_next(f"{next_command}; with a recording of the robot add RECORDING.csv to this check")
    elif result.recording and not (result.recording.has_position or result.recording.has_tension):
        output.suggest_next(
            f"tautwire simulate {shell_quoted(robot_file)} --speeds {shell_quoted(recording)} --out run.csv"
        )
    else:
        next_command = trace_command(robot_file, recording, **files)
        option = f"--check SECOND{recording.suffix}"
        option += f" --check-tracker ITS_TRACKER{tracker.suffix}" if tracker else ""
        hint = "" if second else f"; with a second recording of the robot add {option}"
        output.suggest_next(f"{next_command}{hint}")


def _require_logs(recording: Path | None, files: Mapping[str, Path | None]) -> None:
    """Raises InputError where an option is given without the recording that it belongs to."""
    if recording is None and files["columns"] is not None:
        raise InputError("--columns", "is given without a recording", "name the recording that has these columns")
    if recording is None and files["tracker"] is not None:
        raise InputError("--tracker", "is given without a recording", "name the winches' log of the same motion")
    if recording is None and files["check"] is not None:
        raise InputError("--check", "is given without a recording", "name the recording that is fitted before it")
    if files["check"] is None and files["check_tracker"] is not None:
        raise InputError("--check-tracker", "is given without --check", "name the winches' log of the same motion")


def _write_report(result: CheckResult, target: Path, inputs: Sequence[Path], provenance: Provenance) -> bool:
    """Writes the page of a check; False where the robot file shows no geometry to draw."""
    from ..atomic_output import atomic_file
    from ..reports.check_page import CheckedFiles, can_be_drawn, check_page

    robot = result.robot
    if robot is None or not can_be_drawn(robot):
        return False
    problems = tuple((problem.where, problem.problem, problem.hint) for problem in result.problems)
    checked = CheckedFiles(robot, result.recording, problems, result.notes, provenance)
    with atomic_file(target) as scratch:
        scratch.write_text(check_page(checked, relative_links(target, *inputs)), encoding="utf-8")
    return True


def _count_text(count: int, noun: str) -> str:
    return f"{count} {noun}" + ("" if count == 1 else "s")
