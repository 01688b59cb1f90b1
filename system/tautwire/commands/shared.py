"""What commands share: the robot file, a position, a bar that names what is being done."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
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
from ..statics.equilibrium import static_tensions

RobotFile = Annotated[Path, typer.Argument(metavar="ROBOT.toml", help="The robot file.")]


def robot_of(path: Path) -> Robot:
    """Read a robot file and refuse a start that its cables cannot hold."""
    robot = read_robot(path)
    try:
        static_tensions(robot)
    except UnreachableError as error:
        where = f"{path}: platform.start"
        raise UnreachableError(where, error.position, error.cable, error.tension, error.reason) from error
    return robot


def say_what_is_left_out(robot: Robot) -> None:
    """Which tables of the robot file a command had no use for."""
    tables = [name for name, content in (("[winch]", robot.winch), ("[fmu]", robot.fmus)) if content]
    if tables:
        said = "no part in this: winch speeds are those of the drums' encoders, and all components the project's own"
        print(f"{' and '.join(tables)}: {said}", file=sys.stderr)


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
def progress_bar() -> Iterator[Callable[[str, float], None]]:
    """A bar on standard error that names what is being done."""
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description:<32}"),
        BarColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=1.0)
        current = ""

        def tell(what: str, done: float) -> None:
            nonlocal current
            if what != current:
                bar.reset(task, description=what)
                current = what
            bar.update(task, completed=done)

        yield tell
