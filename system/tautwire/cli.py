"""The command line: ``tautwire build | simulate | linearise | workspace | trace | material``."""

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
from .robot import Robot, slots
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
OWN_FMU = "An FMU of yours in place of ours, such as platform=mine.fmu, cable_2=... or winch_1=...; may be repeated."
DYNAMIC_TEST = "A dynamic test of the rope; if none, Table 1 of the paper, with the pair that it uses."
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
    """Build the FMUs, one a cable, one a winch and one for the platform, and the whole robot as an SSP archive.

    Example: tautwire build robot.toml --out build/
    """
    from .c_hosts import embeddable_python, find_compiler, make_for_c_hosts
    from .output import folder_in_place, refuse_inputs
    from .packaging import build_fmus, gathered
    from .ssp import ssp_name, write_ssp

    robot = _robot(robot_file)
    refuse_inputs([fmu.path for fmu in robot.fmus], [out / f"{slot}.fmu" for slot in slots(robot.cable_count)])
    if for_c_hosts:
        embeddable_python()
        find_compiler()
    with folder_in_place(out) as scratch:
        fmus = gathered(build_fmus(robot, scratch), scratch)
        if for_c_hosts:
            for slot in fmus.parts.keys() - fmus.own.keys():
                make_for_c_hosts(fmus.parts[slot])
        system = write_ssp(robot, fmus, scratch / ssp_name(robot))
    for path in (*fmus.paths, system):
        print(out / path.name)


@application.command()
def simulate(
    robot_file: RobotFile,
    speeds: Annotated[Path, typer.Option(metavar="RECORDING.csv", help="Winch speeds over time; CSV or Parquet.")],
    out: Annotated[Path, typer.Option(metavar="RESULT.csv", help="Where the result goes; Parquet if .parquet.")],
    step: Annotated[float, typer.Option(help="Longest macro step, s.")] = 0.01,
    tolerance: Annotated[
        float | None, typer.Option(help="Error allowed, m; chooses the steps, in place of --step.")
    ] = None,
    until: Annotated[float | None, typer.Option(help="Stop at this time, s.")] = None,
    patience: Annotated[float, typer.Option(help="An FMU in the same call for so long hangs, s.")] = 60.0,
    fmu: Annotated[list[str] | None, typer.Option(metavar="SLOT=FILE", help=OWN_FMU)] = None,
) -> None:
    """Co-simulate the FMUs over recorded winch speeds; with [winch] in the robot file these are what is asked of them.

    Example: tautwire simulate robot.toml --speeds recording.csv --out result.csv
    """
    from .output import refuse_inputs
    from .result_file import result_in_place
    from .robot_wiring import result_columns
    from .simulation import simulate_recording
    from .slots import check_own_fmus, lacking_ports, own_fmus

    if not step > 0.0:
        raise InputError("--step", f"{step:g} s is not positive", "give a step such as 0.01")
    if until is not None and math.isnan(until):
        raise InputError("--until", "nan is not a time", "give a time in s")
    if tolerance is not None and not tolerance > 0.0:
        raise InputError("--tolerance", f"{tolerance:g} m is not positive", "give an error such as 1e-6")
    if not patience > 0.0:
        raise InputError("--patience", f"{patience:g} s is not positive", "give a time such as 60, or inf")
    robot = _robot(robot_file)
    robot = robot.with_fmus(own_fmus(fmu or [], robot.cable_count))
    refuse_inputs([robot_file, speeds, *(own.path for own in robot.fmus)], [out])
    check_own_fmus(robot)
    lacking = lacking_ports({own.slot: own.path for own in robot.fmus}, robot.cable_count)
    columns = result_columns(robot.cable_count, robot.winch_numbers, lacking)
    with result_in_place(out, columns) as result, _progress() as tell:
        account, notes = simulate_recording(robot, speeds, result, step, tolerance, until, tell, patience)
    for note in notes:
        print(note, file=sys.stderr)
    estimated = "" if account.error is None else f", estimated error {account.error:.2g} m"
    print(f"{out}: {account.steps} steps, {account.redos} redos, coupling made {account.made:.2g} J{estimated}")


@application.command()
def linearise(
    robot_file: RobotFile,
    out: Annotated[Path, typer.Option(metavar="MODEL.json", help="Where the model goes.")],
    at: Annotated[str | None, typer.Option(metavar="X,Y,Z", help="Position, m; by default the start.")] = None,
) -> None:
    """Linearise the robot at rest: modes, and A, B, C, D with named signals.

    Inputs are the speeds of the drums: [winch] and [fmu] of the robot file have no part in it.

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
    _say_what_is_left_out(robot)
    for note in plant.notes:
        print(note, file=sys.stderr)
    pairs = zip(plant.modes.frequencies, plant.modes.damping_ratios, strict=True)
    for number, (frequency, ratio) in enumerate(pairs, start=1):
        print(f"mode {number}: {frequency:.4f} Hz, damping ratio {ratio:.5f}")
    print(out)


@application.command()
def workspace(
    robot_file: RobotFile,
    out: Annotated[Path, typer.Option(metavar="WORKSPACE.csv", help="Where the table goes.")],
    plot: Annotated[Path | None, typer.Option(metavar="FIGURE.png", help="Slices as a figure; or .pdf, .svg.")] = None,
    lower: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="Lower corner, m; by default of all exit points and the start.")
    ] = None,
    upper: Annotated[str | None, typer.Option(metavar="X,Y,Z", help="Upper corner, m.")] = None,
    spacing: Annotated[float | None, typer.Option(help="Grid spacing, m; by default a twentieth of the box.")] = None,
    acceleration: Annotated[float, typer.Option(help="Required along each axis beside the weight, m/s^2.")] = 0.0,
) -> None:
    """Where the cables, which only pull, hold the platform: margins and static tensions on a grid.

    Example: tautwire workspace robot.toml --out workspace.csv --plot workspace.png
    """
    from .output import file_in_place, refuse_inputs
    from .workspace import wrench_feasible_workspace
    from .workspace_figure import checked_format, workspace_figure

    refuse_inputs([robot_file], [out, *([plot] if plot else [])])
    if plot is not None:
        checked_format(plot)
    robot = read_robot(robot_file)
    least = None if lower is None else _position(lower, "--lower")
    most = None if upper is None else _position(upper, "--upper")
    found = wrench_feasible_workspace(robot, least, most, spacing, acceleration)
    with file_in_place(out) as scratch:
        found.frame().to_csv(scratch, index=False, float_format="%.10g")
        if plot is not None:
            with file_in_place(plot) as drawing:
                workspace_figure(robot, found).savefig(drawing)
    print(f"{int(found.feasible.sum())} of {found.feasible.size} positions are wrench-feasible")
    for path in (out, plot):
        if path is not None:
            print(path)


@application.command()
def trace(
    robot_file: RobotFile,
    fit: Annotated[Path, typer.Argument(metavar="FIT.csv", help="The recording to fit; CSV or Parquet.")],
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Where the report goes.")],
    check: Annotated[Path | None, typer.Option(metavar="CHECK.csv", help="A recording to judge on.")] = None,
    alpha: Annotated[float, typer.Option(help="Rate of false alarms allowed.")] = 0.01,
) -> None:
    """Find what the model lacks, add it, and report the error before and after.

    Recorded winch speeds are what the drums' encoders give: [winch] and [fmu] of the robot file have no part in it.

    Example: tautwire trace robot.toml fit.csv --check check.csv --out report/
    """
    from .output import folder_in_place, refuse_inputs
    from .recording import read_recording
    from .report import trace_table, write_report
    from .tracer import processors
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
            result = traced(robot, recording, judging, tell, alpha, processors())
        write_report(result, scratch)
    _say_what_is_left_out(robot)
    Console().print(trace_table(result))
    print(out / "index.html")


@application.command()
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
    from .excitation import default_limits
    from .excitation import excite as excited
    from .excitation.limits import named_effects
    from .output import file_in_place, refuse_inputs

    refuse_inputs([robot_file], [out])
    robot = _robot(robot_file)
    chosen = named_effects(robot, effects)
    with _progress() as tell:
        found = excited(robot, chosen, default_limits(robot, speed, reach), duration, 1.0 / rate, programs, seed, tell)
    with file_in_place(out) as scratch:
        found.frame().to_csv(scratch, index=False, float_format="%.10g")
    for pair in found.pairs[:5]:
        print(f"{pair.effect.label(robot)}, and {pair.other.label(robot)} in its place: {pair.nats:.3g} nats apart")
    print(f"closest pair of the median program: {found.typical:.3g} nats")
    print(out)


@application.command()
def material(
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Where fit.json and the figure go.")],
    table: Annotated[Path | None, typer.Argument(metavar="TABLE.csv", help=DYNAMIC_TEST)] = None,
    at: Annotated[float | None, typer.Option(help="The row, Hz, whose pair of E' and c is in use as constant.")] = None,
    robot_file: Annotated[
        Path | None, typer.Option("--robot", metavar="ROBOT.toml", help="A robot with this rope; written anew.")
    ] = None,
    shared: Annotated[float, typer.Option(help="Share of each variance that all rows have in common.")] = 0.0,
    coverage: Annotated[float, typer.Option(help="Standard deviations that the table's uncertainties are.")] = 1.0,
    alpha: Annotated[float, typer.Option(help="Rate of false alarms allowed.")] = 0.01,
) -> None:
    """Judge a constant modulus and damping by a dynamic test, and fit what the rope has besides.

    Example: tautwire material dma.csv --robot robot.toml --out material/
    """
    from .materials import PAPER_PAIR_AT, PAPER_TABLE, Options, pair_of_row, read_material_table, trace_material
    from .materials.output import FILES, write_material
    from .materials.robot_material import declared_material
    from .materials.terminal import material_table
    from .output import folder_in_place, refuse_inputs

    for name, value, least in (("--shared", shared, 0.0), ("--alpha", alpha, math.nextafter(0.0, 1.0))):
        if not least <= value < 1.0:
            raise InputError(name, f"{value:g} is not a share below 1", "give a number such as 0.01")
    if not 0.0 < coverage < math.inf:
        raise InputError("--coverage", f"{coverage:g} is not positive", "give 1, or 2 for intervals of 95 %")
    if at is not None and robot_file:
        raise InputError("--at", "the pair in use is the robot's", "give either --at or --robot")
    read = read_material_table(table or PAPER_TABLE)
    robot = _robot(robot_file) if robot_file else None
    refuse_inputs([path for path in (table, robot_file) if path], [out / name for name in FILES])
    declared = declared_material(robot, str(robot_file)) if robot else None
    if table is None and robot is None and at is None:
        at = PAPER_PAIR_AT
    if at is not None:
        declared = pair_of_row(read, at)
    with folder_in_place(out) as scratch:
        with _progress() as tell:
            verdict = trace_material(read, declared, Options(shared=shared, coverage=coverage, alpha=alpha), tell)
        write_material(verdict, scratch, robot)
    Console().print(material_table(verdict))
    print(out / "fit.json")


def _robot(path: Path) -> Robot:
    """Read a robot file and refuse a start that its cables cannot hold."""
    robot = read_robot(path)
    try:
        static_tensions(robot)
    except UnreachableError as error:
        where = f"{path}: platform.start"
        raise UnreachableError(where, error.position, error.cable, error.tension, error.reason) from error
    return robot


def _say_what_is_left_out(robot: Robot) -> None:
    tables = [name for name, content in (("[winch]", robot.winch), ("[fmu]", robot.fmus)) if content]
    if tables:
        said = "no part in this: winch speeds are those of the drums' encoders, and all components the project's own"
        print(f"{' and '.join(tables)}: {said}", file=sys.stderr)


def _position(text: str, option: str = "--at") -> tuple[float, float, float]:
    mend = f"give three numbers in m, such as {option} 10,5.5,4"
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(option, f"{text!r} is not a position", mend) from None
    if not all(map(math.isfinite, (x, y, z))):
        raise InputError(option, f"{text!r} is not a position", mend)
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
