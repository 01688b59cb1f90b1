"""Recordings: measured winch speeds, tensions and positions, sample by sample."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pandas as pd  # type: ignore[import-untyped,unused-ignore]
from numpy.typing import NDArray

from ..errors import (
    AbsentColumnsError,
    ArgumentError,
    RecordingError,
    describe_value,
    format_value,
    one_line,
    raise_error,
)
from ..input_files import validate_path
from ..robot.recorded_columns import TRACKER_TABLE
from ..robot.robot_file_reader import MAX_CABLES, read_columns_file
from ..robot.schema import AXES, QUATERNION_COLUMNS, RecordedColumn
from ..validation import validate_instance, validate_integer
from .column_map import ColumnMap, column_map
from .csv_file import CsvTable, open_csv
from .encoder_wrap import without_wraps
from .mat_file import is_mat, open_mat
from .mdf_file import is_mdf, open_mdf
from .missing_codes import without_missing_codes
from .parquet_file import is_parquet, open_parquet
from .placeholder_values import without_placeholders
from .quaternion_columns import are_valid, unit_quaternions
from .recording_table import MAX_MAGNITUDE, ColumnTable, ErrorSink, not_a_table_error, parse_header, row_errors
from .ros_bag import is_bag, open_bag
from .winch_gaps import WINCH_COLUMNS, bridge_winch_gaps, long_gap_error

CABLE_COUNT_HINT = "give the robot's cable_count"


@dataclass(frozen=True, eq=False)
class Recording:
    """N samples of a robot with n cables; the arrays are float64 and read-only where a file was read.

    ``time`` (N,) in s, strictly rising; ``winch_speed`` (N, n) in m/s, positive reels in; ``tension`` (N, n)
    in N and ``position`` (N, 3) in m, NaN where a cell or a column is missing. ``unknown_columns`` by name;
    ``read_as`` says what of the file differs from the standard, and which of its numbers are interpolated.
    ``rope_length`` (N, n) in m, smaller as it reels in, is NaN where no length of a cable was recorded; where it was,
    the winch speed is its rate. None where no cable has one. ``orientation`` (N, 4) is the unit quaternion w, x, y, z
    from the platform's frame to the world, its sign continuous along time; NaN where it was not measured, the default.
    ``winch_acceleration`` (N, n) in m/s^2 are the rates of the winch speeds where these are cubic between samples, see
    :mod:`tautwire.recordings.speed_interpolation`; None where they are linear, as those read from a file.
    ``columns`` are the names, units and scales of columns in the file, by their standard names, where it has any;
    ``has_time_column`` unless times are clock times, or those of the file's format.
    """

    path: str
    time: NDArray[np.float64]
    winch_speed: NDArray[np.float64]
    tension: NDArray[np.float64]
    position: NDArray[np.float64]
    unknown_columns: tuple[str, ...] = ()
    read_as: tuple[str, ...] = ()
    rope_length: NDArray[np.float64] | None = None
    orientation: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 4)))
    columns: Mapping[str, RecordedColumn] = field(default_factory=dict)
    has_time_column: bool = True
    winch_acceleration: NDArray[np.float64] | None = None

    def __post_init__(self) -> None:
        if not self.has_orientation:
            object.__setattr__(self, "orientation", np.full((len(self.time), 4), np.nan))

    @property
    def cable_count(self) -> int:
        """Number of cables, n."""
        return int(self.winch_speed.shape[1])

    @property
    def sample_count(self) -> int:
        """Number of samples, N."""
        return int(self.time.size)

    @property
    def duration(self) -> float:
        """Time from the first to the last sample, in s."""
        return float(self.time[-1] - self.time[0])

    @property
    def rope_lengths(self) -> tuple[int, ...]:
        """Numbers of the cables whose winch speed is the rate of a recorded rope length."""
        if self.rope_length is None:
            return ()
        return tuple((1 + np.flatnonzero(np.isfinite(self.rope_length).all(axis=0))).tolist())

    @property
    def has_position(self) -> bool:
        """Whether any coordinate of any sample was measured."""
        return bool(np.isfinite(self.position).any())

    @property
    def has_orientation(self) -> bool:
        """Whether the orientation was measured in any sample."""
        return bool(np.isfinite(self.orientation).any())

    @property
    def has_tension(self) -> bool:
        """Whether any tension of any sample was measured."""
        return bool(np.isfinite(self.tension).any())

    @property
    def notes(self) -> tuple[str, ...]:
        """Remarks on what was read: the file's dialect, unknown columns, and where winch speeds are from."""
        notes = list(self.read_as)
        notes += [f"not read: {', '.join(self.unknown_columns)}"] if self.unknown_columns else []
        if self.rope_lengths:
            cables = ", ".join(map(str, self.rope_lengths))
            notes.append(f"winch speeds are the rates of the recorded rope lengths, of cables {cables}")
        if self.winch_acceleration is not None:
            notes.append("winch speeds are cubic between samples, as those of a smooth motion")
        return tuple(f"{self.path}: {one_line(note)}" for note in notes)

    @property
    def channel_names(self) -> tuple[str, ...]:
        """Names of the outputs in the order of :meth:`measured`: x, y, z, tension_1 to tension_n."""
        return (*AXES, *(f"tension_{cable}" for cable in range(1, self.cable_count + 1)))

    def first(self, count: int) -> "Recording":
        """The first samples."""
        return self.part(0, count)

    def part(self, start: int, stop: int) -> "Recording":
        """The samples from ``start`` to before ``stop``."""
        rows = slice(start, stop)
        return replace(
            self,
            time=self.time[rows],
            winch_speed=self.winch_speed[rows],
            tension=self.tension[rows],
            position=self.position[rows],
            orientation=self.orientation[rows],
            rope_length=None if self.rope_length is None else self.rope_length[rows],
            winch_acceleration=None if self.winch_acceleration is None else self.winch_acceleration[rows],
        )

    def measured(self) -> NDArray[np.float64]:
        """All outputs, shape (N, 3 + n), in the order of ``channel_names``, in m and N; NaN where missing."""
        return np.hstack((self.position, self.tension))

    def wound_lengths(self) -> NDArray[np.float64]:
        """Lengths of rope that the winches have reeled in since the first sample, shape (N, n), in m."""
        wound = np.zeros_like(self.winch_speed)
        steps = np.diff(self.time)[:, None]
        travel = 0.5 * steps * (self.winch_speed[1:] + self.winch_speed[:-1])
        if self.winch_acceleration is not None:
            travel -= steps**2 / 12.0 * np.diff(self.winch_acceleration, axis=0)
        np.cumsum(travel, axis=0, out=wound[1:])
        return wound

    def with_winch_speed(self, winch_speed: NDArray[np.float64]) -> "Recording":
        """The recording with other winch speeds (N, n), linear between samples.

        Without the recorded lengths of cables whose speeds differ.
        """
        other = replace(self, winch_speed=winch_speed, winch_acceleration=None)
        if self.rope_length is None:
            return other
        is_same = np.all(winch_speed == self.winch_speed, axis=0)
        return replace(other, rope_length=np.where(is_same, self.rope_length, np.nan))

    def frame(self) -> pd.DataFrame:
        """The recording as a table with the columns of a recording file, NaN where missing; orientation if measured."""
        speeds = [f"winch_speed_{cable}" for cable in range(1, self.cable_count + 1)]
        tensions = [f"tension_{cable}" for cable in range(1, self.cable_count + 1)]
        frame = pd.DataFrame(
            np.column_stack([self.time, self.winch_speed, self.position, self.tension]),
            columns=["time", *speeds, *AXES, *tensions],
        )
        quaternion = dict(zip(QUATERNION_COLUMNS, self.orientation.T, strict=True))
        return frame.assign(**quaternion) if self.has_orientation else frame


def read_recording(
    path: str | Path, cable_count: int, columns: Sequence[RecordedColumn] | str | Path = ()
) -> Recording:
    """Read a recording from CSV, Parquet, MDF, MATLAB or a ROS bag, of n = ``cable_count`` cables, N samples.

    Columns are ``time`` (s), ``winch_speed_1`` ... (m/s), ``tension_1`` ... (N), ``x``, ``y``, ``z`` (m), and ``qw``,
    ``qx``, ``qy``, ``qz`` (unit quaternion, platform to world); where the length of a rope is recorded,
    ``rope_length_1`` ... (m, any zero, smaller as it reels in), its rate is the speed.
    Units that a CSV or MDF file states are converted to these; gaps of a few samples in a speed or length are
    interpolated. The recording's ``notes`` say so. ``columns`` are those of other names and scales: a robot's
    ``recorded_columns``, or a TOML file with a table [recording.columns].

    Raises RecordingError, which names the line or row, where the file is not a valid recording; RobotFileError where
    ``columns`` are not valid; ArgumentError where ``path`` is no path or ``cable_count`` no whole number from 1 to 100.
    """
    validate_path("read_recording: path", path)
    validate_integer("read_recording: cable_count", cable_count, 1, CABLE_COUNT_HINT, MAX_CABLES)
    declared = _declared_columns(columns, cable_count)
    table, notes = _open_table(path, column_map(declared, cable_count), raise_error)
    recording = _validated_recording(table, cable_count)
    return replace(recording, read_as=(*notes, *recording.read_as))


def read_tracker(path: str | Path, columns: Sequence[RecordedColumn] = ()) -> Recording:
    """Read a tracker's file, with the columns time, x, y, z, and qw to qz where it has them: a recording of no cables.

    Raises RecordingError where the file is not valid, RobotFileError where ``columns`` are not.
    """
    validate_path("read_tracker: path", path)
    table, notes = _open_table(path, column_map(columns, 0), raise_error)
    recording = _validated_recording(table, 0)
    recorded = {name: replace(column, table=TRACKER_TABLE) for name, column in recording.columns.items()}
    read_as = tuple(f"{path}: {note}" for note in (*notes, *recording.read_as))
    return replace(recording, columns=recorded, read_as=read_as)


def _declared_columns(columns: Sequence[RecordedColumn] | str | Path, cable_count: int) -> tuple[RecordedColumn, ...]:
    if isinstance(columns, str | Path):
        return read_columns_file(columns, cable_count)
    if not isinstance(columns, tuple | list) or not all(isinstance(column, RecordedColumn) for column in columns):
        hint = "give a robot's recorded_columns, or the path of a TOML file"
        raise ArgumentError("read_recording: columns", columns, f"is {describe_value(columns)}, no columns", hint)
    return tuple(columns)


def _validated_recording(table: CsvTable | ColumnTable, cable_count: int) -> Recording:
    numbers = table.numbers()
    if numbers is None:
        raise _first_error(table)
    numbers, code_notes = without_missing_codes(numbers, table.header)
    numbers, gap_notes = bridge_winch_gaps(numbers)
    numbers, wrap_notes = without_wraps(numbers, table.header)
    numbers, placeholder_notes = without_placeholders(numbers)
    cables = range(1, cable_count + 1)
    dialect = (f"read {table.header.dialect}",) if table.header.dialect else ()
    recording = Recording(
        path=table.file,
        time=_stacked_columns(numbers, ["time"])[:, 0],
        winch_speed=_winch_speeds(numbers, cables),
        tension=_stacked_columns(numbers, [f"tension_{cable}" for cable in cables]),
        position=_stacked_columns(numbers, AXES),
        orientation=_stacked_columns(numbers, QUATERNION_COLUMNS),
        unknown_columns=table.header.unknown_names,
        rope_length=_stacked_columns(numbers, [f"rope_length_{cable}" for cable in cables]),
        read_as=(*dialect, *code_notes, *gap_notes, *wrap_notes, *placeholder_notes),
        columns=table.header.recorded_columns,
        has_time_column=table.header.has_time_column and table.header.clock is None,
    )
    if not _is_valid(recording):
        raise _first_error(table, long_gap_error(numbers, table.file))
    return replace(recording, orientation=unit_quaternions(recording.orientation))


def _winch_speeds(numbers: Mapping[str, NDArray[np.float64]], cables: Iterable[int]) -> NDArray[np.float64]:
    """Winch speeds (N, n); of a rope whose length was recorded its rate, by central differences, which do not drift."""
    speeds = dict(numbers)
    for cable in cables:
        length = numbers.get(f"rope_length_{cable}")
        if length is not None and len(length) > 1 and np.all(np.diff(numbers["time"]) > 0.0):
            speeds[f"winch_speed_{cable}"] = -np.gradient(length, numbers["time"])
    return _stacked_columns(speeds, [f"winch_speed_{cable}" for cable in cables])


def recording_errors(
    path: str | Path, cable_count: int, columns: Sequence[RecordedColumn] = ()
) -> Iterator[RecordingError]:
    """All errors of a recording, in the file's order; none where it is valid. Slow if not: every cell is parsed.

    Raises RecordingError where the file cannot be read as a recording at all.
    """
    header_errors: list[RecordingError] = []
    table, _ = _open_table(path, column_map(columns, cable_count), header_errors.append)
    yield from header_errors
    if table.header.known_names and not _is_complete(table.numbers()):
        yield from row_errors(table.rows(), table.header, table.file)


def _is_complete(numbers: Mapping[str, NDArray[np.float64]] | None) -> bool:
    """Whether no cell of a table has an error; not where one of a winch is empty, of which some are bridged."""
    if not numbers or "time" not in numbers or len(numbers["time"]) < 2:
        return False
    quaternion = [numbers[name] for name in QUATERNION_COLUMNS if name in numbers]
    inputs = [values for name, values in numbers.items() if name == "time" or name.startswith(WINCH_COLUMNS)]
    return bool(
        all(np.isfinite(values).all() for values in inputs)
        and not any((np.abs(values) > MAX_MAGNITUDE).any() for values in numbers.values())
        and (np.diff(numbers["time"]) > 0.0).all()
        and (len(quaternion) < len(QUATERNION_COLUMNS) or are_valid(np.column_stack(quaternion)))
    )


def _open_table(
    path: str | Path, columns: ColumnMap, sink: ErrorSink
) -> tuple[CsvTable | ColumnTable, tuple[str, ...]]:
    """The table of a recording, and a note on its columns; one that has standard names alone is read by these."""
    formats = ((is_bag, open_bag), (is_parquet, open_parquet), (is_mdf, open_mdf), (is_mat, open_mat))
    open_table = next((open_format for is_format, open_format in formats if is_format(path)), open_csv)
    try:
        return open_table(path, columns, sink), ((columns.in_words(),) if columns.declared else ())
    except AbsentColumnsError as absent:
        try:
            table = open_table(path, ColumnMap(columns.cable_count), raise_error)
        except RecordingError:
            raise absent from None
        return table, ("has none of the columns that are declared, and is read by the standard names",)


def _first_error(table: CsvTable | ColumnTable, otherwise: RecordingError | None = None) -> RecordingError:
    """The first error that a rule on rows finds; ``otherwise`` one that concerns time between them."""
    error = next(row_errors(table.rows(), table.header, table.file), otherwise)
    return error or not_a_table_error(table.file)


def recording_from_frame(frame: pd.DataFrame, cable_count: int, name: str = "frame") -> Recording:
    """Make a recording from a pandas frame with the columns of a recording file, of n = ``cable_count`` cables.

    Columns are those of :func:`read_recording`, in SI units; one row a sample, N rows; NaN where an output was not
    measured. ``name`` is what messages call it.

    Raises RecordingError as :func:`read_recording` does, ArgumentError where ``frame`` is no frame.
    """
    validate_instance("recording_from_frame: frame", frame, pd.DataFrame, "give a pandas frame with a column time")
    validate_integer("recording_from_frame: cable_count", cable_count, 1, CABLE_COUNT_HINT, MAX_CABLES)
    validate_instance("recording_from_frame: name", name, str, "give a name for use in messages")
    header = parse_header([str(column) for column in frame.columns], name, cable_count)
    numbers = frame.set_axis(list(header.names), axis="columns")
    columns = {column: _float_column(numbers[column], f"{name}: column {column}") for column in header.known_names}
    return _validated_recording(ColumnTable(name, header, columns), cable_count)


def _float_column(column: pd.Series, where: str) -> NDArray[np.float64]:
    try:
        return column.to_numpy(dtype=np.float64, na_value=np.nan)
    except (TypeError, ValueError) as problem:
        message = f"holds {format_value(str(column.dtype))}, not numbers"
        raise RecordingError(where, message, "convert it to float64, in SI units") from problem


def require_outputs(recording: Recording) -> None:
    """Raises RecordingError where nothing at all was measured."""
    if recording.has_position or recording.has_tension:
        return
    hint = "record at least one of them"
    if recording.unknown_columns:
        hint += f" (not read: {format_value(', '.join(recording.unknown_columns), 200)})"
    last_tension = f"tension_{recording.cable_count}"
    problem = f"no number in any of the outputs x, y, z, tension_1 to {last_tension}"
    raise RecordingError(recording.path, problem, hint)


def _is_valid(recording: Recording) -> bool:
    """Whether the arrays are valid; :func:`row_errors` names the rule and the cell where they are not."""
    inputs, outputs = (recording.time, recording.winch_speed), (recording.position, recording.tension)
    return bool(
        recording.sample_count >= 2
        and all(np.isfinite(signals).all() for signals in inputs)
        and not any((np.abs(signals) > MAX_MAGNITUDE).any() for signals in (*inputs, *outputs))
        and (np.diff(recording.time) > 0.0).all()
        and are_valid(recording.orientation)
    )


def _stacked_columns(numbers: Mapping[str, NDArray[np.float64]], names: Sequence[str]) -> NDArray[np.float64]:
    """Columns side by side, shape (N, number of names); NaN where the file has none of that name."""
    columns = np.full((len(numbers["time"]), len(names)), np.nan)
    for index, name in enumerate(names):
        if name in numbers:
            columns[:, index] = numbers[name]
    columns.setflags(write=False)
    return columns
