"""Checks of a robot file and a recording that collect all problems at once, and of what a trace would do to them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

from ..errors import InputError, RecordingError, RobotFileError, UnknownColumnsError, one_line
from ..estimation.preprocessing import prepare_recordings
from ..fmus.fmu_slots import check_user_fmus
from ..recordings.column_map import unit_errors
from ..recordings.mdf_file import is_mdf
from ..recordings.mistaken_orientation import orientation_notes
from ..recordings.mistaken_robot import robot_file_mistakes
from ..recordings.recording import Recording, read_recording, recording_errors
from ..recordings.recording_notes import recording_notes
from ..recordings.shared_samples import require_unseen
from ..recordings.start_position import start_pose
from ..recordings.tracker import with_tracker
from ..recordings.white_noise_estimate import white_noise_deviation
from ..recordings.winch_columns import ESTIMATED_FACTOR
from ..robot.implausible_units import implausible_units
from ..robot.mistaken_vertical import require_held_at_start
from ..robot.robot_file_reader import MIN_CABLES, read_robot_with_sink, robot_file_text
from ..robot.schema import Robot, fmu_slots
from ..robot.uncertain_parameters import uncertain_parameters
from ..toml_text import line_of_key
from .console import columns_command, shell_quoted, with_columns

MAX_PROBLEMS_PER_FILE = 1000
# A recording may break a rule in each of its cells; alike errors are counted as one problem.
MAX_COUNTED_ERRORS = 100_000
# Finding the line of each problem takes time, so line numbers are left out where the file is long.
MAX_ROBOT_FILE_PROBLEMS = 50
MAX_CHARACTERS_FOR_LINE_NUMBERS = 50_000  # characters
# Keys that do not affect whether the cables hold the platform at the start.
KEYS_WITHOUT_INFLUENCE_ON_STATICS = frozenset((("name",), ("sensors",), ("winch",), ("fmu",), ("recording",)))
# Where one of these is in another unit, statics says nothing of its own.
POINTS = frozenset(("anchor", "attachment", "centre_of_mass", "start"))

_LINE_OR_ROW = re.compile(r"(?<=: )((?:line|row) [0-9]+)(?=$|,)")
_QUOTED_OR_NUMBER = re.compile(r"'(?:[^'\\]|\\.)*'|\"[^\"]*\"|(?<!\w)[-+]?[0-9][-+.0-9e]*")


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
    """The result of a check: ``problems`` in the order of lines; ``notes`` are remarks that are no problems.

    ``robot`` and ``recording`` are what was read, None where it could not be.
    """

    problems: tuple[Problem, ...]
    notes: tuple[str, ...]
    robot: Robot | None = None
    recording: Recording | None = None


class _TooManyProblemsError(Exception):
    """The maximum number of problems per file is reached."""


def check_files(
    robot_file: Path,
    recording_file: Path | None = None,
    progress: Callable[[str, float], None] = lambda what, done: None,
    columns_file: Path | None = None,
    tracker_file: Path | None = None,
) -> CheckResult:
    """Collects all problems of a robot file and, if there is one, of a recording of that robot; raises nothing.

    ``columns_file`` declares the recording's columns in place of the robot file, and ``tracker_file`` has the positions
    where the recording has none. ``progress`` is called with the
    present activity and the fraction of it that is done.
    """
    problems: list[Problem] = []
    notes: list[str] = []
    progress("reading the robot file", 0.0)
    robot = _check_robot_file(robot_file, problems, notes)
    if recording_file is None:
        return CheckResult(tuple(problems), tuple(notes), robot)
    if robot is None or robot.cable_count < MIN_CABLES:
        notes.append(f"{recording_file} was not checked: the number of cables is unknown")
        return CheckResult(tuple(problems), tuple(notes), robot)
    recording_problems: list[Problem] = []
    progress("reading the recording", 0.0)
    reader = _with_columns(robot, columns_file, recording_problems)
    command = columns_command(recording_file, shell_quoted(robot_file), tracker_file)
    recording = None
    if reader is not None:
        recording = _check_recording(recording_file, reader, recording_problems, notes, command)
    if recording is not None and reader is not None and tracker_file is not None:
        recording = _with_tracker(reader, recording, tracker_file, recording_problems, notes, command)
    if recording is not None:
        notes.extend(_estimated_factors(columns_file or robot_file))
    if recording is not None and not problems:
        progress("checking both together", 0.0)
        cleaned = _check_together(robot, recording, recording_problems, notes)
        if cleaned is not None:
            text = robot_file_text(robot_file)
            mistakes = robot_file_mistakes(robot.as_modelled(), cleaned, str(robot_file))
            problems += [_robot_file_problem(robot_file, text, error) for error in mistakes]
    return CheckResult((*problems, *recording_problems), tuple(notes), robot, recording)


def check_both(fit: CheckResult, check: CheckResult) -> CheckResult:
    """The results of both recordings of a trace, and whether the second was seen in the first."""
    problems = list(dict.fromkeys((*fit.problems, *check.problems)))
    if fit.recording is not None and check.recording is not None:
        with _collecting_problems(problems, Path(check.recording.path)):
            require_unseen(fit.recording, check.recording)
    return replace(fit, problems=tuple(problems), notes=tuple(dict.fromkeys((*fit.notes, *check.notes))))


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
        problems += [_robot_file_problem(path, text, error) for error in _unit_errors(robot)]
        implausible = [] if errors else list(implausible_units(robot, str(path)))
        problems += [_robot_file_problem(path, text, error) for error in implausible]
        has_wrong_points = any(error.key_path[-1] in POINTS for error in implausible)
        if not (has_wrong_points or {error.key_path[:1] for error in errors} - KEYS_WITHOUT_INFLUENCE_ON_STATICS):
            with _collecting_problems(problems, path, _line_in_robot_file(text, ("platform", "start"))):
                require_held_at_start(robot)
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


def _with_columns(robot: Robot, columns_file: Path | None, problems: list[Problem]) -> Robot | None:
    """The robot with the columns that a file declares; None where it does not, or any unit of columns is wrong."""
    if columns_file is not None:
        with _collecting_problems(problems, columns_file):
            robot = with_columns(robot, columns_file)
            text = robot_file_text(columns_file)
            problems += [_robot_file_problem(columns_file, text, e) for e in _unit_errors(robot)]
    return None if problems or any(_unit_errors(robot)) else robot


def _unit_errors(robot: Robot) -> Iterator[RobotFileError]:
    return unit_errors((*robot.recorded_columns, *robot.tracker.columns))


def _check_recording(
    path: Path, robot: Robot, problems: list[Problem], notes: list[str], command: str
) -> Recording | None:
    with _collecting_problems(problems, path):
        errors = recording_errors(path, robot.cable_count, robot.recorded_columns)
        _list_errors(path, _with_command(errors, path, command), problems, notes)
        if not problems:
            return read_recording(path, robot.cable_count, robot.recorded_columns)
    return None


def _with_command(errors: Iterator[RecordingError], path: Path, command: str) -> Iterator[RecordingError]:
    """The errors, of which that of unknown columns ends with the command that proposes what they are."""
    for error in errors:
        if isinstance(error, UnknownColumnsError) and not is_mdf(path):
            yield RecordingError(
                error.where, error.problem, f"let this propose what the columns are: {command}", error.line
            )
        else:
            yield error


def _with_tracker(
    robot: Robot, recording: Recording, path: Path, problems: list[Problem], notes: list[str], command: str
) -> Recording | None:
    """The recording with a tracker's positions; None where there are problems."""
    with _collecting_problems(problems, path):
        errors = recording_errors(path, 0, robot.tracker.columns)
        _list_errors(path, _with_command(errors, path, command), problems, notes)
        if not problems:
            return with_tracker(robot, recording, path)
    return None


def _list_errors(path: Path, faults: Iterator[RecordingError], problems: list[Problem], notes: list[str]) -> None:
    groups = _alike_errors(islice(faults, MAX_COUNTED_ERRORS))
    problems.extend(_grouped_problem(path, group) for group in groups[:MAX_PROBLEMS_PER_FILE])
    if len(groups) > MAX_PROBLEMS_PER_FILE:
        notes.append(f"{path}: only the first {MAX_PROBLEMS_PER_FILE} problems are listed")
    if next(faults, None) is not None:
        notes.append(f"{path}: only the first {MAX_COUNTED_ERRORS} wrong cells are counted")


@dataclass(frozen=True)
class _AlikeErrors:
    """Errors of one kind in one column: the first and the last, and their number."""

    first: RecordingError
    last: RecordingError
    count: int


def _alike_errors(errors: Iterable[RecordingError]) -> list[_AlikeErrors]:
    """Errors grouped by column and kind, in the order of the first of each."""
    groups: dict[tuple[str, ...], _AlikeErrors] = {}
    for error in errors:
        # Lines and cells differ between errors of one kind.
        kind = tuple(_QUOTED_OR_NUMBER.sub("", text) for text in (error.problem, error.hint))
        key = (_LINE_OR_ROW.sub("", error.where), *kind)
        group = groups.get(key)
        groups[key] = _AlikeErrors(group.first if group else error, error, group.count + 1 if group else 1)
    return list(groups.values())


def _grouped_problem(path: Path, group: _AlikeErrors) -> Problem:
    first, problem = group.first, group.first.problem
    last_place = _LINE_OR_ROW.search(group.last.where)
    if group.count > 1:
        last = f", last in {last_place.group(1)}" if last_place else ""
        problem += f" (and {group.count - 1} more like it{last})"
    return Problem(str(path), first.line, first.where, problem, first.hint)


def _check_together(robot: Robot, recording: Recording, problems: list[Problem], notes: list[str]) -> Recording | None:
    """The recording as a trace cleans it; None where it would not trace it."""
    path = Path(recording.path)
    notes.extend((*recording.notes, *orientation_notes(robot, recording)))
    if not (recording.has_position or recording.has_tension):
        notes.append(f"{path}: no tension and no position was measured; simulate accepts it, trace does not")
        return None
    with _collecting_problems(problems, path):
        prepared = prepare_recordings(robot.as_modelled(), recording, None)
        noise = robot.sensors.position_noise or white_noise_deviation(recording.position)
        notes.extend(start_pose(robot, noise, recording)[1])
        notes.extend(recording_notes(robot.as_modelled(), recording))
        notes.extend(_without_uncertainties(robot))
        notes.extend(prepared.notes)
        return prepared.fit
    return None


def _estimated_factors(path: Path) -> tuple[str, ...]:
    """A note where a file still has factors that were estimated for a proposal, as their remarks say."""
    lines = [number for number, line in enumerate(robot_file_text(path).splitlines(), 1) if ESTIMATED_FACTOR in line]
    if not lines:
        return ()
    where = f"line {lines[0]}" if len(lines) == 1 else f"lines {', '.join(map(str, lines))}"
    problem = "factors that were estimated from a recording hold the errors of drum and rope, which no trace then finds"
    return (f"{path}: {where}: {problem}; write those of the data sheet, without the remark",)


def _without_uncertainties(robot: Robot) -> tuple[str, ...]:
    """A note where no number of the robot file has an uncertainty, so that a trace takes all of them as exact."""
    if uncertain_parameters(robot):
        return ()
    keys = "mass_uncertainty, modulus_uncertainty, damping_uncertainty, anchor_uncertainty"
    return (f"no number of the robot has an uncertainty: a trace takes them as exact; state {keys} where they are not",)


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
