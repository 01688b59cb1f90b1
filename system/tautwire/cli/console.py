"""Console of the commands: common options, output as lines or JSON, progress bar, robust standard streams."""

from __future__ import annotations

import json
import math
import os
import shlex
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, TextIO

import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    SpinnerColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from ..errors import InputError, UnreachableError
from ..json_document import json_value
from ..provenance import Provenance, provenance_of
from ..robot.robot_file_reader import read_columns_file, read_robot, read_tracker_file
from ..robot.schema import Robot, UserFmu
from .progress_lines import progress_lines

RobotFile = Annotated[Path, typer.Argument(metavar="ROBOT.toml", help="The robot file.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as one JSON object, and nothing else.")]
Columns = Annotated[
    Path | None, typer.Option(metavar="COLUMNS.toml", help="Columns by the laboratory's names, see tautwire columns.")
]
TrackerFile = Annotated[
    Path | None, typer.Option(metavar="TRACKER.csv", help="Positions in a file of their own, with its own clock.")
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print errors only.")]


@dataclass(frozen=True)
class CommandOutput:
    """Output of a command: results on standard output, notes on standard error; ``quiet`` suppresses both."""

    as_json: bool = False
    quiet: bool = False

    def result(self, lines: Iterable[object], document: Mapping[str, object]) -> None:
        """Prints the result, as lines or as one JSON object."""
        if self.as_json:
            print(json.dumps(json_value(document), default=str, allow_nan=False))
        elif not self.quiet:
            for line in lines:
                print(line)

    def note(self, text: str) -> None:
        """Prints a remark for the user."""
        if not self.quiet:
            print(text, file=sys.stderr)

    def suggest_next(self, text: str) -> None:
        """Prints what to do next; not with JSON output."""
        if not self.as_json:
            self.note(f"next: {text}")


def command_provenance(context: typer.Context, *inputs: Path | None, fmus: Iterable[UserFmu] = ()) -> Provenance:
    """Provenance of what a command computes from files; FMUs that fill slots are named after these."""
    files = {str(path): path for path in inputs if path is not None}
    files |= {f"{fmu.slot}={fmu.path.name}": fmu.path for fmu in fmus}
    return provenance_of(files, context.obj)


def shell_quoted(path: Path) -> str:
    """A path as one word of a shell command, to be pasted."""
    return shlex.quote(str(path))


def columns_command(recording: Path, source: str, tracker: Path | None = None) -> str:
    """A proposal of a recording's columns as a shell command; ``source`` is the robot file or ``--cables``."""
    of_tracker = f" --tracker {shell_quoted(tracker)}" if tracker else ""
    return f"tautwire columns {shell_quoted(recording)} {source}{of_tracker}"


def trace_command(robot_file: Path, recording: Path, **options: Path | None) -> str:
    """A trace of the recording as a shell command, to be pasted; options by name, such as ``check_tracker``."""
    files = {f"--{name.replace('_', '-')}": path for name, path in options.items()}
    given = "".join(f" {option} {shell_quoted(path)}" for option, path in files.items() if path is not None)
    return f"tautwire trace {shell_quoted(robot_file)} {shell_quoted(recording)}{given} --out report/"


QUATERNION_NORM_TOLERANCE = 1e-3
DEFAULT_OUTPUT = CommandOutput()
INTERRUPTED = "interrupted; nothing was written"


def read_holdable_robot(path: Path) -> Robot:
    """Reads a robot file; raises UnreachableError where its cables cannot hold the platform at the start."""
    return _require_holdable(read_robot(path), path)


def read_plausible_robot(path: Path) -> Robot:
    """Reads a robot file; raises RobotFileError where its units seem to be others, else as read_holdable_robot."""
    from ..robot.implausible_units import implausible_units

    robot = read_robot(path)
    for error in implausible_units(robot, str(path)):
        raise error
    return _require_holdable(robot, path)


def _require_holdable(robot: Robot, path: Path) -> Robot:
    from ..robot.static_equilibrium import static_tensions

    try:
        static_tensions(robot)
    except UnreachableError as error:
        where = f"{path}: platform.start"
        raise UnreachableError(where, error.position, error.cable, error.tension, error.reason) from error
    return robot


def with_columns(robot: Robot, columns: Path | None) -> Robot:
    """The robot with the columns of recordings that a file declares, in place of its own; as it is without a file."""
    if columns is None:
        return robot
    recorded_columns = read_columns_file(columns, robot.cable_count)
    return replace(robot, recorded_columns=recorded_columns, tracker=read_tracker_file(columns))


def note_unused_tables(robot: Robot, output: CommandOutput = DEFAULT_OUTPUT) -> None:
    """Notes which tables of the robot file a command does not use."""
    tables = [name for name, content in (("[winch]", robot.winch), ("[fmu]", robot.fmus)) if content]
    if tables:
        explanation = "not used here: winch speeds are those of the drums' encoders, and all FMUs are the project's own"
        output.note(f"{' and '.join(tables)}: {explanation}")


def relative_links(page: Path, *files: Path) -> dict[str, str]:
    """Relative paths from a page to files, by file name; URIs of files on other Windows drives."""
    return {file.name: _link(file.absolute(), page.absolute().parent) for file in files}


def _link(file: Path, folder: Path) -> str:
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    # On Windows no relative path leads to another drive.
    except ValueError:
        return file.as_uri()


def parse_position(text: str, option: str = "--at") -> tuple[float, float, float]:
    """Parses three finite numbers separated by commas; raises InputError that names the option."""
    hint = f"give three numbers in m, such as {option} 10,5.5,4"
    x, y, z = _parsed_numbers(text, 3, InputError(option, f"{text!r} is not a position", hint))
    return x, y, z


def parse_numbers(text: str, count: int, option: str, example: str) -> tuple[float, ...]:
    """Parses finite numbers separated by commas; raises InputError that names the option and shows an example."""
    problem = f"{text!r} is not {count} numbers"
    return _parsed_numbers(text, count, InputError(option, problem, f"write them as in {option} {example}"))


def parse_quaternion(text: str) -> list[float]:
    """Parses a unit quaternion w,x,y,z, which may be rounded; raises InputError that names ``--orientation``."""
    numbers = parse_numbers(text, 4, "--orientation", "1,0,0,0")
    norm = math.hypot(*numbers)
    if abs(norm - 1.0) > QUATERNION_NORM_TOLERANCE:
        raise InputError("--orientation", f"has norm {norm:.6g}, must have 1", "give the unit quaternion w,x,y,z")
    return [number / norm for number in numbers]


def _parsed_numbers(text: str, count: int, error: InputError) -> tuple[float, ...]:
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        raise error from None
    if len(numbers) != count or not all(map(math.isfinite, numbers)):
        raise error
    return numbers


@contextmanager
def progress_bar(
    output: CommandOutput = DEFAULT_OUTPUT, time_limit: float | None = None
) -> Iterator[Callable[[str, float], None]]:
    """Context manager for a progress bar on standard error; lines of text where that is no terminal.

    With ``quiet`` it shows nothing. Lines name the ``time_limit`` of the command, in s.
    """
    console = Console(stderr=True)
    if output.quiet:
        yield lambda activity, fraction: None
        return
    if not console.is_terminal:
        with progress_lines(print_error, time_limit) as report_progress:
            yield report_progress
        return
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description:<32}"),
        BarColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    # A campaign's runs may come minutes apart; the remaining time is estimated from the last hour.
    with Progress(*columns, console=console, transient=True, speed_estimate_period=3600.0) as bar:
        task = bar.add_task("", total=1.0)
        current_activity = ""

        def update_bar(activity: str, fraction: float) -> None:
            nonlocal current_activity
            if activity != current_activity:
                bar.reset(task, description=activity)
                current_activity = activity
            bar.update(task, completed=fraction)

        yield update_bar


def open_closed_streams() -> None:
    """Opens closed standard streams on the null device, so that no other file takes their descriptors."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            # The system assigns the lowest free descriptor, which is the missing one.
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, "w" if number else "r", encoding="utf-8", closefd=False))  # noqa: SIM115


def print_error(text: str) -> None:
    """Prints a line to standard error, if it can be written."""
    try:
        print(text, file=sys.stderr, flush=True)
    except OSError:
        flush_or_discard(sys.stderr)


def flush_or_discard(stream: TextIO) -> None:
    """Flushes a stream; where that fails redirects it to the null device, since Python would flush again at exit."""
    with suppress(OSError):
        try:
            stream.flush()
            return
        except OSError:
            pass
        null_device = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null_device, stream.fileno())
        os.close(null_device)
