"""The command line: ``tautwire build | simulate | linearise | trace``."""

from __future__ import annotations

import json
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

from .errors import InputError, TautwireError, UnreachableError
from .robot import Robot
from .robot_file import read_robot
from .statics import static_tensions

# The base of all errors of usage; newer typer hides it in a private module.
UsageError: type[Exception] = typer.BadParameter.__bases__[0]

DONE, FAILED, WRONG_INPUT = 0, 1, 2

application = typer.Typer(
    name="tautwire",
    help="Cable-driven parallel robots as FMI components, and a tracer that finds what their model lacks.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

C_HOSTS = (
    "Make FMUs that also run in importers that are not Python processes; needs a C compiler, and Python's headers "
    "and shared library (Debian: gcc, python3-dev)."
)
RobotFile = Annotated[Path, typer.Argument(metavar="ROBOT.toml", help="The robot file.")]


def main() -> None:
    """Run the command line; the exit status is 0 done, 2 the input is wrong, 1 anything else."""
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run one command and return its exit status; errors go to standard error, one line each."""
    try:
        status = application(arguments, standalone_mode=False)
    except (InputError, UsageError) as error:
        message = str(error) if isinstance(error, InputError) else error.format_message()  # type: ignore[attr-defined]
        return _say(message, WRONG_INPUT)
    except (TautwireError, OSError) as error:
        return _say(str(error), FAILED)
    except (KeyboardInterrupt, typer.Abort):
        status = FAILED
    # Newer typer turns Ctrl-C into a status that it returns.
    return _say("interrupted; nothing was written", FAILED) if status else DONE


def _say(message: str, status: int) -> int:
    print("tautwire: " + " ".join(message.split()), file=sys.stderr)
    return status


@application.command()
def build(
    robot_file: RobotFile,
    out: Annotated[Path, typer.Option(help="Folder for the FMUs.")] = Path("build"),
    for_c_hosts: Annotated[bool, typer.Option("--for-c-hosts", help=C_HOSTS)] = False,
) -> None:
    """Build the FMUs, one a cable and one for the platform, and the whole robot as an SSP archive.

    Example: tautwire build robot.toml --out build/
    """
    from .c_hosts import embeddable_python, find_compiler, make_for_c_hosts
    from .output import folder_in_place
    from .packaging import build_fmus
    from .ssp import ssp_name, write_ssp

    robot = _robot(robot_file)
    if for_c_hosts:
        embeddable_python()
        find_compiler()
    with folder_in_place(out) as scratch:
        fmus = build_fmus(robot, scratch)
        if for_c_hosts:
            for path in (*fmus.cables, fmus.platform):
                make_for_c_hosts(path)
        system = write_ssp(robot, fmus, scratch / ssp_name(robot))
    for path in (*fmus.cables, fmus.platform, system):
        print(out / path.name)


@application.command()
def simulate(
    robot_file: RobotFile,
    speeds: Annotated[Path, typer.Option(metavar="RECORDING.csv", help="Winch speeds over time.")],
    out: Annotated[Path, typer.Option(metavar="RESULT.csv", help="Where the result goes.")],
    step: Annotated[float, typer.Option(help="Longest macro step, s.")] = 0.01,
    tolerance: Annotated[
        float | None, typer.Option(help="Error allowed, m; chooses the steps, in place of --step.")
    ] = None,
    until: Annotated[float | None, typer.Option(help="Stop at this time, s.")] = None,
) -> None:
    """Co-simulate the FMUs over recorded winch speeds.

    Example: tautwire simulate robot.toml --speeds recording.csv --out result.csv
    """
    from .cosimulation import RunError
    from .output import file_in_place, refuse_inputs
    from .simulation import simulate_recording

    if not step > 0.0:
        raise InputError("--step", f"{step:g} s is not positive", "give a step such as 0.01")
    if until is not None and math.isnan(until):
        raise InputError("--until", "nan is not a time", "give a time in s")
    if tolerance is not None and not tolerance > 0.0:
        raise InputError("--tolerance", f"{tolerance:g} m is not positive", "give an error such as 1e-6")
    refuse_inputs([robot_file, speeds], [out])
    robot = _robot(robot_file)
    try:
        with _progress() as tell:
            motion, notes = simulate_recording(robot, speeds, step, tolerance, until, tell)
    except RunError as failure:
        with file_in_place(out) as scratch:
            failure.motion.frame().to_csv(scratch, index=False)
        raise TautwireError(f"{failure}; the run until then is in {out}") from failure
    with file_in_place(out) as scratch:
        motion.frame().to_csv(scratch, index=False)
    for note in notes:
        print(note, file=sys.stderr)
    account = motion.account
    estimated = "" if account.error is None else f", estimated error {account.error:.2g} m"
    print(f"{out}: {account.steps} steps, {account.redos} redos, coupling made {account.made:.2g} J{estimated}")


@application.command()
def linearise(
    robot_file: RobotFile,
    out: Annotated[Path, typer.Option(metavar="MODEL.json", help="Where the model goes.")],
    at: Annotated[str | None, typer.Option(metavar="X,Y,Z", help="Position, m; by default the start.")] = None,
) -> None:
    """Linearise the robot at rest: modes, and A, B, C, D with named signals.

    Example: tautwire linearise robot.toml --at 10,5.5,4 --out model.json
    """
    from .linear import linearise as linearised
    from .linear import model_document
    from .output import file_in_place, refuse_inputs

    refuse_inputs([robot_file], [out])
    robot = _robot(robot_file)
    try:
        plant = linearised(robot, None if at is None else _position(at))
    except UnreachableError as error:
        raise UnreachableError("--at", error.position, error.cable, error.tension, error.reason) from error
    with file_in_place(out) as scratch:
        scratch.write_text(json.dumps(model_document(plant), indent=1), encoding="utf-8")
    pairs = zip(plant.modes.frequencies, plant.modes.damping_ratios, strict=True)
    for number, (frequency, ratio) in enumerate(pairs, start=1):
        print(f"mode {number}: {frequency:.4f} Hz, damping ratio {ratio:.5f}")
    print(out)


@application.command()
def trace(
    robot_file: RobotFile,
    fit: Annotated[Path, typer.Argument(metavar="FIT.csv", help="The recording to fit.")],
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Where the report goes.")],
    check: Annotated[Path | None, typer.Option(metavar="CHECK.csv", help="A recording to judge on.")] = None,
    alpha: Annotated[float, typer.Option(help="Rate of false alarms allowed.")] = 0.01,
) -> None:
    """Find what the model lacks, add it, and report the error before and after.

    Example: tautwire trace robot.toml fit.csv --check check.csv --out report/
    """
    from .output import folder_in_place, refuse_inputs
    from .recording import read_recording
    from .report import trace_table, write_report
    from .tracer import trace as traced

    if not 0.0 < alpha < 1.0:
        raise InputError("--alpha", f"{alpha:g} is not a rate", "give a number between 0 and 1, such as 0.01")
    robot = _robot(robot_file)
    recording = read_recording(fit, robot.cable_count)
    judging = None if check is None else read_recording(check, robot.cable_count)
    made = ["robot.toml", "report.json", "index.html"]
    refuse_inputs([robot_file, fit, *([check] if check else [])], [out / name for name in made])
    with folder_in_place(out) as scratch:
        with _progress() as tell:
            result = traced(robot, recording, judging, tell, alpha)
        write_report(result, scratch)
    Console().print(trace_table(result))
    print(out / "index.html")


def _robot(path: Path) -> Robot:
    """Read a robot file and refuse a start that its cables cannot hold."""
    robot = read_robot(path)
    try:
        static_tensions(robot)
    except UnreachableError as error:
        where = f"{path}: platform.start"
        raise UnreachableError(where, error.position, error.cable, error.tension, error.reason) from error
    return robot


def _position(text: str) -> tuple[float, float, float]:
    mend = "give three numbers in m, such as --at 10,5.5,4"
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError("--at", f"{text!r} is not a position", mend) from None
    if not all(map(math.isfinite, (x, y, z))):
        raise InputError("--at", f"{text!r} is not a position", mend)
    return x, y, z


@contextmanager
def _progress() -> Iterator[Callable[[str, float], None]]:
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


if __name__ == "__main__":
    main()
