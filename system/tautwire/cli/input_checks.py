"""Checks of a robot file and a recording that collect all problems at once, and of what a trace would do to them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

from ..errors import InputError, RobotFileError, one_line
from ..estimation.preprocessing import prepare_recordings
from ..fmus.fmu_slots import check_user_fmus
from ..recordings.recording import Recording, read_recording, recording_errors
from ..recordings.start_position import start_position
from ..recordings.white_noise_estimate import white_noise_deviation
from ..robot.robot_file_reader import read_robot_with_sink, robot_file_text
from ..robot.schema import Robot, fmu_slots
from ..robot.static_equilibrium import static_tensions
from ..toml_text import line_of_key

# Per file; a recording with a wrong separator breaks rules in each of its cells.
MAX_PROBLEMS_PER_FILE = 1000
# Finding the line of each problem takes time, so line numbers are left out where the file is long.
MAX_ROBOT_FILE_PROBLEMS = 50
MAX_CHARACTERS_FOR_LINE_NUMBERS = 50_000  # characters
MIN_CABLE_COUNT = 3
# Keys that do not affect whether the cables hold the platform at the start.
KEYS_WITHOUT_INFLUENCE_ON_STATICS = frozenset((("name",), ("sensors",), ("winch",), ("fmu",)))


@dataclass(frozen=True)
class Problem:
    """One problem: ``file``, its ``line`` or row from 1 if it concerns a single one, and the texts of an InputError."""

    file: str
    line: int | None
    where: str
    problem: str
    hint: str

    def __str__(self) -> str:
        return one_line(f"{self.where}: {self.problem}; {self.hint}")


@dataclass(frozen=True)
class CheckResult:
    """The result of a check: ``problems`` in the order of lines; ``notes`` are remarks that are no problems."""

    problems: tuple[Problem, ...]
    notes: tuple[str, ...]


class _TooManyProblemsError(Exception):
    """The maximum number of problems per file is reached."""


def check_files(
    robot_file: Path,
    recording_file: Path | None = None,
    progress: Callable[[str, float], None] = lambda what, done: None,
) -> CheckResult:
    """Collects all problems of a robot file and, if there is one, of a recording of that robot; raises nothing.

    ``progress`` is called with the present activity and the fraction of it that is done.
    """
    problems: list[Problem] = []
    notes: list[str] = []
    progress("reading the robot file", 0.0)
    robot = _check_robot_file(robot_file, problems, notes)
    if recording_file is None:
        return CheckResult(tuple(problems), tuple(notes))
    if robot is None or robot.cable_count < MIN_CABLE_COUNT:
        notes.append(f"{recording_file} was not checked: the number of cables is unknown")
        return CheckResult(tuple(problems), tuple(notes))
    recording_problems: list[Problem] = []
    progress("reading the recording", 0.0)
    recording = _check_recording(recording_file, robot.cable_count, recording_problems, notes)
    if recording is not None and not problems:
        progress("checking both together", 0.0)
        _check_together(robot, recording, recording_problems, notes)
    return CheckResult((*problems, *recording_problems), tuple(notes))


def _check_robot_file(path: Path, problems: list[Problem], notes: list[str]) -> Robot | None:
    """The robot, invalid where there are problems; None where the file is not TOML."""
    errors: list[RobotFileError] = []
    try:
        text = robot_file_text(path)
        robot = read_robot_with_sink(path, _collect_up_to(errors, MAX_ROBOT_FILE_PROBLEMS))
    except RobotFileError as error:
        problems.append(Problem(str(path), error.line, error.where, error.problem, error.hint))
        return None
    except _TooManyProblemsError:
        notes.append(f"{path}: only the first {MAX_ROBOT_FILE_PROBLEMS} problems are listed")
        robot = None
    problems += sorted((_robot_file_problem(path, text, error) for error in errors), key=_line_order)
    if robot is not None:
        if not {error.key_path[:1] for error in errors} - KEYS_WITHOUT_INFLUENCE_ON_STATICS:
            with _collecting_problems(problems, path, _line_in_robot_file(text, ("platform", "start"))):
                static_tensions(robot)
        problems += _check_robot_fmus(path, text, robot)
    problems.sort(key=_line_order)
    return robot


def _check_robot_fmus(path: Path, text: str, robot: Robot) -> list[Problem]:
    """Problems of the user's FMUs in existing slots, independent of other problems."""
    problems: list[Problem] = []
    fmus_in_slots = tuple(fmu for fmu in robot.fmus if fmu.slot in fmu_slots(robot.cable_count))
    for fmu in fmus_in_slots:
        with _collecting_problems(problems, path, _line_in_robot_file(text, ("fmu", fmu.slot))):
            check_user_fmus(replace(robot, fmus=(fmu,)))
    if not problems:
        with _collecting_problems(problems, path, _line_in_robot_file(text, ("fmu",))):
            check_user_fmus(replace(robot, fmus=fmus_in_slots))
    return problems


def _check_recording(path: Path, cable_count: int, problems: list[Problem], notes: list[str]) -> Recording | None:
    with _collecting_problems(problems, path):
        faults = recording_errors(path, cable_count)
        problems.extend(
            Problem(str(path), e.line, e.where, e.problem, e.hint) for e in islice(faults, MAX_PROBLEMS_PER_FILE)
        )
        if next(faults, None) is not None:
            notes.append(f"{path}: only the first {MAX_PROBLEMS_PER_FILE} problems are listed")
        if not problems:
            return read_recording(path, cable_count)
    return None


def _check_together(robot: Robot, recording: Recording, problems: list[Problem], notes: list[str]) -> None:
    path = Path(recording.path)
    notes.extend(recording.notes)
    if not (recording.has_position or recording.has_tension):
        notes.append(f"{path}: no tension and no position was measured; simulate accepts it, trace does not")
        return
    with _collecting_problems(problems, path):
        noise = robot.sensors.position_noise or white_noise_deviation(recording.position)
        notes.extend(start_position(robot, noise, recording)[1])
        notes.extend(prepare_recordings(robot.as_modelled(), recording, None).notes)


def _collect_up_to(errors: list[RobotFileError], max_count: int) -> Callable[[RobotFileError], None]:
    def collect(error: RobotFileError) -> None:
        errors.append(error)
        if len(errors) == max_count:
            raise _TooManyProblemsError

    return collect


def _robot_file_problem(path: Path, text: str, error: RobotFileError) -> Problem:
    return _problem_at_line(path, _line_in_robot_file(text, error.key_path), error)


def _line_in_robot_file(text: str, key_path: tuple[str | int, ...]) -> int | None:
    return line_of_key(text, key_path) if len(text) <= MAX_CHARACTERS_FOR_LINE_NUMBERS else None


def _problem_at_line(path: Path, line: int | None, error: InputError) -> Problem:
    """The error as a problem, with the line number inserted after the file name."""
    file, key = str(path), error.where.removeprefix(f"{path}: ")
    if line is not None:
        where = f"{file}: line {line}" + (f", {key}" if key != file else "")
        return Problem(file, line, where, error.problem, error.hint)
    return Problem(file, None, error.where, error.problem, error.hint)


@contextmanager
def _collecting_problems(problems: list[Problem], path: Path, line: int | None = None) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        problems.append(_problem_at_line(path, line, error))


def _line_order(problem: Problem) -> int:
    return problem.line or 0
