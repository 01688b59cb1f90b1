"""What commands share: the robot file, a position, how they speak, a bar that names what is being done."""

from __future__ import annotations

import json
import math
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

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
from ..robots.reading import read_robot
from ..robots.robot import Robot

RobotFile = Annotated[Path, typer.Argument(metavar="ROBOT.toml", help="The robot file.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print the result as one JSON object, and nothing else.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but what is wrong.")]


@dataclass(frozen=True)
class Voice:
    """How a command speaks: results on standard output, all else on standard error; ``quiet`` leaves out both."""

    as_json: bool = False
    quiet: bool = False

    def result(self, lines: Iterable[object], document: Mapping[str, object]) -> None:
        """What came out, as lines or as one JSON object."""
        if self.as_json:
            print(json.dumps(document, default=str))
        elif not self.quiet:
            for line in lines:
                print(line)

    def note(self, text: str) -> None:
        """What the user should know."""
        if not self.quiet:
            print(text, file=sys.stderr)

    def next(self, text: str) -> None:
        """What to do next; not for machines."""
        if not self.as_json:
            self.note(f"next: {text}")


ALOUD = Voice()


def robot_of(path: Path) -> Robot:
    """Read a robot file and refuse a start that its cables cannot hold."""
    from ..statics.equilibrium import static_tensions

    robot = read_robot(path)
    try:
        static_tensions(robot)
    except UnreachableError as error:
        where = f"{path}: platform.start"
        raise UnreachableError(where, error.position, error.cable, error.tension, error.reason) from error
    return robot


def say_what_is_left_out(robot: Robot, voice: Voice = ALOUD) -> None:
    """Which tables of the robot file a command had no use for."""
    tables = [name for name, content in (("[winch]", robot.winch), ("[fmu]", robot.fmus)) if content]
    if tables:
        said = "no part in this: winch speeds are those of the drums' encoders, and all components the project's own"
        voice.note(f"{' and '.join(tables)}: {said}")


def links_beside(page: Path, *files: Path) -> dict[str, str]:
    """Relative paths from a page to files, by their names."""
    folder = page.absolute().parent
    return {file.name: Path(os.path.relpath(file.absolute(), folder)).as_posix() for file in files}


def position_of(text: str, option: str = "--at") -> tuple[float, float, float]:
    """Three finite numbers with commas; raises InputError that names the option."""
    mend = f"give three numbers in m, such as {option} 10,5.5,4"
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(option, f"{text!r} is not a position", mend) from None
    if not all(map(math.isfinite, (x, y, z))):
        raise InputError(option, f"{text!r} is not a position", mend)
    return x, y, z


@contextmanager
def progress_bar(voice: Voice = ALOUD) -> Iterator[Callable[[str, float], None]]:
    """A bar on standard error that names what is being done; none where that is no terminal, or all is to be quiet."""
    console = Console(stderr=True)
    if voice.quiet or not console.is_terminal:
        yield lambda what, done: None
        return
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description:<32}"),
        BarColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    # A campaign's runs may come minutes apart; what is left of time is told from the last hour.
    with Progress(*columns, console=console, transient=True, speed_estimate_period=3600.0) as bar:
        task = bar.add_task("", total=1.0)
        current = ""

        def tell(what: str, done: float) -> None:
            nonlocal current
            if what != current:
                bar.reset(task, description=what)
                current = what
            bar.update(task, completed=done)

        yield tell
