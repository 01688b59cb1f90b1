"""All that is wrong with a robot file and a recording of its, at once, and what a trace would do to the recording."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

from .errors import InputError, RobotFileError, one_line
from .fmus.slots import check_own_fmus
from .recordings.recording import Recording, read_recording, recording_faults
from .recordings.roughness import roughness
from .robots.lines import line_of
from .robots.reading import read_robot_telling, robot_file_text
from .robots.robot import Robot, slots
from .runs.start import start_of
from .statics.equilibrium import static_tensions
from .tracer.preparation.preparation import prepare

# Of one file; a recording with a wrong separator breaks rules in each of its cells.
MOST = 1000
# Of a robot file; to find the line of each takes its time, and is left out where the file is long.
MOST_OF_ROBOT = 50
LONGEST_TEXT = 50_000  # characters
FEWEST_CABLES = 3
# What has no part in whether the cables hold the platform at the start.
APART = frozenset((("name",), ("sensors",), ("winch",), ("fmu",)))


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong: ``file``, its ``line`` or row from 1 if it is one's, and the words of an InputError."""

    file: str
    line: int | None
    where: str
    problem: str
    mend: str

    def __str__(self) -> str:
        return one_line(f"{self.where}: {self.problem}; {self.mend}")


@dataclass(frozen=True)
class Checked:
    """``problems`` in the order of the files' lines; ``notes`` is what a user should know though nothing is wrong."""

    problems: tuple[Problem, ...]
    notes: tuple[str, ...]


class _EnoughError(Exception):
    """There are as many problems as are told of one file."""


def check_files(
    robot_file: Path,
    recording_file: Path | None = None,
    tell: Callable[[str, float], None] = lambda what, done: None,
) -> Checked:
    """All that is wrong with a robot file and, if there is one, with a recording of that robot; raises nothing.

    ``tell`` gets what is being looked at, and the share of it that is done.
    """
    problems: list[Problem] = []
    notes: list[str] = []
    tell("reading the robot file", 0.0)
    robot = _checked_robot(robot_file, problems, notes)
    if recording_file is None:
        return Checked(tuple(problems), tuple(notes))
    if robot is None or robot.cable_count < FEWEST_CABLES:
        notes.append(f"{recording_file} was not looked at: how many cables there are is not known")
        return Checked(tuple(problems), tuple(notes))
    of_recording: list[Problem] = []
    tell("reading the recording", 0.0)
    recording = _checked_recording(recording_file, robot.cable_count, of_recording, notes)
    if recording is not None and not problems:
        tell("looking at both together", 0.0)
        _check_together(robot, recording, of_recording, notes)
    return Checked((*problems, *of_recording), tuple(notes))


def _checked_robot(path: Path, problems: list[Problem], notes: list[str]) -> Robot | None:
    """The robot; not to be used where there are problems. None where the file is no TOML."""
    faults: list[RobotFileError] = []
    try:
        text = robot_file_text(path)
        robot = read_robot_telling(path, _at_most(faults, MOST_OF_ROBOT))
    except RobotFileError as error:
        problems.append(Problem(str(path), error.line, error.where, error.problem, error.mend))
        return None
    except _EnoughError:
        notes.append(f"{path}: no more than {MOST_OF_ROBOT} problems are told")
        robot = None
    problems += sorted((_in_robot_file(path, text, error) for error in faults), key=_by_line)
    if robot is not None:
        if not {error.place[:1] for error in faults} - APART:
            with _gathered(problems, path, _line(text, ("platform", "start"))):
                static_tensions(robot)
        problems += _of_fmus(path, text, robot)
    problems.sort(key=_by_line)
    return robot


def _of_fmus(path: Path, text: str, robot: Robot) -> list[Problem]:
    """What is wrong with FMUs of the user's in slots that there are, whatever else is wrong."""
    problems: list[Problem] = []
    there = tuple(fmu for fmu in robot.fmus if fmu.slot in slots(robot.cable_count))
    for fmu in there:
        with _gathered(problems, path, _line(text, ("fmu", fmu.slot))):
            check_own_fmus(replace(robot, fmus=(fmu,)))
    if not problems:
        with _gathered(problems, path, _line(text, ("fmu",))):
            check_own_fmus(replace(robot, fmus=there))
    return problems


def _checked_recording(path: Path, cable_count: int, problems: list[Problem], notes: list[str]) -> Recording | None:
    with _gathered(problems, path):
        found = recording_faults(path, cable_count)
        problems.extend(Problem(str(path), e.line, e.where, e.problem, e.mend) for e in islice(found, MOST))
        if next(found, None) is not None:
            notes.append(f"{path}: no more than {MOST} problems are told")
        if not problems:
            return read_recording(path, cable_count)
    return None


def _check_together(robot: Robot, recording: Recording, problems: list[Problem], notes: list[str]) -> None:
    path = Path(recording.path)
    if recording.unknown_columns:
        notes.append(f"{path}: not read: {', '.join(recording.unknown_columns)}")
    if not (recording.has_position or recording.has_tension):
        notes.append(f"{path}: no tension and no position was measured; simulate takes it, trace does not")
        return
    with _gathered(problems, path):
        noise = robot.sensors.position_noise or roughness(recording.position)
        notes.extend(start_of(robot, noise, recording)[1])
        notes.extend(prepare(robot.as_modelled(), recording, None).notes)


def _at_most(faults: list[RobotFileError], most: int) -> Callable[[RobotFileError], None]:
    def note(error: RobotFileError) -> None:
        faults.append(error)
        if len(faults) == most:
            raise _EnoughError

    return note


def _in_robot_file(path: Path, text: str, error: RobotFileError) -> Problem:
    return _problem(path, _line(text, error.place), error)


def _line(text: str, place: tuple[str | int, ...]) -> int | None:
    return line_of(text, place) if len(text) <= LONGEST_TEXT else None


def _problem(path: Path, line: int | None, error: InputError) -> Problem:
    """With the line in the place that the error names."""
    file, key = str(path), error.where.removeprefix(f"{path}: ")
    if line is not None:
        where = f"{file}: line {line}" + (f", {key}" if key != file else "")
        return Problem(file, line, where, error.problem, error.mend)
    return Problem(file, None, error.where, error.problem, error.mend)


@contextmanager
def _gathered(problems: list[Problem], path: Path, line: int | None = None) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        problems.append(_problem(path, line, error))


def _by_line(problem: Problem) -> int:
    return problem.line or 0
