"""Recordings as tables: their header, their rows, and the validation rules of their cells."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError, UnknownColumnsError, format_value, raise_error
from ..name_suggestions import closest_name, join_names
from ..robot.recorded_columns import column_line
from ..robot.schema import AXES, QUATERNION_COLUMNS, RecordedColumn
from .clock_time import ClockFormat
from .near_names import columns_of_absent_kinds, near_name_errors
from .number_hints import hint_for_number
from .quaternion_columns import missing_quaternion_columns, quaternion_problem
from .units import Number, Unit
from .winch_gaps import MAX_GAP_SAMPLES, WINCH_COLUMNS, CellError, is_winch_column_used, without_bridged_gaps

# A larger file is no recording of a cable robot, or does not fit into memory.
MAX_COLUMNS = 10_000
MAX_SAMPLES = 20_000_000

ErrorSink = Callable[[RecordingError], None]

# As LabVIEW and others call it; near names are suggested anyway.
_NAMES_OF_TIME = frozenset(
    {"x_value", "t", "timestamp", "zeit", "temps", "tiempo", "seconds", "elapsed", "rosbagtimestamp"}
)
_CABLE_COLUMN = re.compile(r"(?:winch_speed|rope_length|tension)_(0|[1-9][0-9]{0,5})")


@dataclass(frozen=True)
class Header:
    """Columns of a recording: ``names`` are all in the file's order, each once; ``unknown_names`` are not read.

    Numbers are written with ``decimal_mark``; ``units`` are those that are stated of columns, ``scales`` what is
    declared of them; ``clock`` is the format of times that are no numbers. ``dialect`` says in words what differs
    from the standard. ``recorded_columns`` are names, units and scales in the file, whatever the numbers here are in;
    ``has_time_column`` unless times are those of its format, as in MDF.
    """

    names: tuple[str, ...]
    unknown_names: tuple[str, ...]
    decimal_mark: str = "."
    units: Mapping[str, Unit] = field(default_factory=dict)
    scales: Mapping[str, RecordedColumn] = field(default_factory=dict)
    clock: ClockFormat | None = None
    dialect: str = ""
    recorded_columns: Mapping[str, RecordedColumn] = field(default_factory=dict)
    has_time_column: bool = True

    @property
    def known_names(self) -> tuple[str, ...]:
        """The columns that are read, in the file's order."""
        return tuple(name for name in self.names if name not in self.unknown_names)

    def with_recorded_columns(self, scaled: Header) -> Header:
        """The header of numbers in SI units, which knows how another scales them."""
        stated = {name: RecordedColumn(name, name, unit.symbol) for name, unit in scaled.units.items()}
        declared = {
            name: replace(column, unit=stated[name].unit) if name in stated else column
            for name, column in scaled.scales.items()
        }
        return replace(self, recorded_columns=stated | declared)

    def number(self, name: str, cell: str) -> float:
        """The number in a cell of a known column, in SI units; NaN where it is none."""
        if name == "time" and self.clock is not None:
            return self.clock.seconds(cell)
        # Python's float also accepts underscores and the digits of all scripts.
        if "_" in cell or not cell.isascii() or (self.decimal_mark == "," and "." in cell):
            return math.nan
        try:
            number = float(cell.replace(self.decimal_mark, "."))
        except ValueError:
            return math.nan
        return self.to_si(name, number)

    def to_si(self, name: str, recorded: Number) -> Number:
        """The recorded numbers of a known column in SI units."""
        unit, scale = self.units.get(name), self.scales.get(name)
        if scale is None:
            return recorded if unit is None else unit.to_si(recorded)
        from_zero = recorded - scale.offset
        return scale.sign * scale.factor * (from_zero if unit is None else unit.to_si(from_zero))


def parse_header(
    cells: Sequence[str], where: str, cable_count: int, sink: ErrorSink = raise_error, line: int | None = None
) -> Header:
    """Parse the header in these cells; raises RecordingError unless time and every winch have a column.

    A winch has its speed, or the length of its rope; a quaternion has all four columns or none. A tracker's file has no
    cables, and columns of any are not read.

    Errors go to the ``sink``; where it does not raise, so do those that follow.
    """
    if len(cells) > MAX_COLUMNS:
        problem = f"has {len(cells)} columns, at most {MAX_COLUMNS} are read"
        raise RecordingError(where, problem, "keep those of the robot", line)
    allowed_names = known_columns(cable_count)
    names = tuple(cell or f"(column {index})" for index, cell in enumerate(cells, 1))
    for index, name in enumerate(names):
        if name in names[:index]:
            sink(RecordingError(where, f"the column {format_value(name)} appears twice", "keep one of the two", line))
        cable_match = _CABLE_COLUMN.fullmatch(name)
        if cable_match and cable_count and not 1 <= int(cable_match.group(1)) <= cable_count:
            problem = f"the column {name} belongs to no cable, the robot has cables 1 to {cable_count}"
            hint = "give the robot file that belongs to this recording"
            if int(cable_match.group(1)) == 0:
                first, second = f"{name[:-1]}1", f"{name[:-1]}2"
                hint = f"count cables from 1: rename {name} {first}, {first} {second}, and so on"
            sink(RecordingError(where, problem, hint, line))
    unknown_names = tuple(name for name in names if name not in allowed_names)
    for error in _missing_column_errors(names, unknown_names, where, cable_count, line):
        sink(error)
    return Header(names, unknown_names)


def _missing_column_errors(
    names: Sequence[str], unknown_names: Sequence[str], where: str, cable_count: int, line: int | None
) -> Iterator[RecordingError]:
    """The required columns that a recording lacks: each, or all in one error where there is none of any winch."""
    winches = [f"winch_speed_{cable}" for cable in range(1, cable_count + 1)]
    required = ["time", *winches]
    missing = [each for each in required if not {each, each.replace("winch_speed", "rope_length")} & set(names)]
    # The only file without cables is a tracker's.
    table = "recording.columns], see tautwire columns" if cable_count else "recording.tracker.columns]"
    has_similar = any(closest_name(each, unknown_names) for each in winches)
    if winches and missing[-len(winches) :] == winches and not has_similar:
        has = f", it has {format_value(join_names(unknown_names), 120)}" if unknown_names else ""
        problem = f"has none of the columns {join_names(missing)}{has}"
        yield UnknownColumnsError(where, problem, f"declare their names in [{table}", line)
        return
    for each in missing:
        similar = closest_name(each, unknown_names)
        renamed = "" if similar is None else f"rename {format_value(similar)}, "
        error_class = RecordingError if cable_count else UnknownColumnsError
        hint = f"add it, {renamed}or declare its name in [{table}"
        times = [name for name in unknown_names if name.lower() in _NAMES_OF_TIME]
        if each == "time" and times:
            line_of_time = column_line(RecordedColumn("time", times[0]))
            hint = f"write into [{table.partition(']')[0]}] {line_of_time}, or rename {format_value(times[0])}"
        yield error_class(where, f"the column {each} is missing", hint, line)
    lacking = missing_quaternion_columns(names)
    if lacking:
        problem = f"the orientation has no column {join_names(lacking)}, of {join_names(QUATERNION_COLUMNS)}"
        hint = "add it, declare its name in [recording.columns], or rename the others so that they are not read"
        yield RecordingError(where, problem, hint, line)
    if missing and not cable_count:
        # The command that the error of a tracker names proposes its other columns too.
        return
    absent = columns_of_absent_kinds(known_columns(cable_count), names)
    yield from near_name_errors(unknown_names, absent, where, table.partition("]")[0], line)


def require_samples(count: int, where: str) -> None:
    """Raises RecordingError where a file has, or claims to have, more samples than are read."""
    if count > MAX_SAMPLES:
        problem = f"has {count} samples, at most {MAX_SAMPLES} are read"
        raise RecordingError(where, problem, "cut it into several recordings")


def known_columns(cable_count: int) -> frozenset[str]:
    """Names of all columns that a recording may have."""
    cables = range(1, cable_count + 1)
    cable_columns = (f"{kind}_{cable}" for kind in ("winch_speed", "rope_length", "tension") for cable in cables)
    return frozenset(("time", *AXES, *QUATERNION_COLUMNS, *cable_columns))


def is_column_name(name: str) -> bool:
    """Whether a column of a recording of some robot may have this name, whatever its number of cables."""
    return name == "time" or name in (*AXES, *QUATERNION_COLUMNS) or _CABLE_COLUMN.fullmatch(name) is not None


class Row(NamedTuple):
    """The cells of one sample; ``where`` names the file and the line or row, ``number`` is that, from 1."""

    where: str
    number: int
    cells: list[str]


MIN_PLACEHOLDER = 1e30  # what programs write for a number that is missing, as the largest one or 9.96921e36
MAX_MAGNITUDE = 1e12  # beyond any quantity of a cable robot in SI units
# What loggers, spreadsheets and databases write where a sensor dropped out.
_NOT_A_NUMBER = ("nan", "NaN", "NAN", "-nan", "-NaN", "-nan(ind)", "1.#QNAN", "-1.#QNAN", "1.#IND", "-1.#IND")
# As C writes it on Windows in six digits, and spreadsheets in English, German and French where a formula fails.
_OF_FORMULAS = ("1.#QNAN0", "-1.#IND00", "#N/A", "#NV", "#N/D", "#DIV/0!", "#VALUE!", "#WERT!", "#VALEUR!", "#NUM!")
_WORDS = ("NA", "N/A", "n/a", "N.A.", "<NA>", "NULL", "null", "None", "nil")
MISSING_CELLS = ("", *_NOT_A_NUMBER, *_OF_FORMULAS, *_WORDS, *("-" * count for count in range(1, 7)))
# A time beyond this many seconds is an epoch in a smaller unit; in s, epochs of today are 1.8e9.
_MAX_EPOCH = 1e10
# Counters of times, and the largest step of one that begins anew, in its period.
_COUNTER_BITS, _MAX_COUNTER_STEP = (16, 32), 0.02
_EPOCH_UNITS = {"ms": 1e3, "us": 1e6, "ns": 1e9}


def row_errors(rows: Iterable[Row], header: Header, file: str) -> Iterator[RecordingError]:
    """Validation errors of all samples of a recording, in the file's order; parses every cell, so it is slow."""
    winch_columns = [name for name in header.known_names if name.startswith(WINCH_COLUMNS)]
    yield from without_bridged_gaps(_sample_errors(rows, header, file), winch_columns)


def _sample_errors(rows: Iterable[Row], header: Header, file: str) -> Iterator[list[CellError]]:
    """Validation errors of each sample, and at the end of their number."""
    count, previous_time = 0, -math.inf
    for row in rows:
        if tuple(cell.strip() for cell in row.cells) == header.names:
            hint = "cut the file there, a second recording begins, or remove the line"
            yield [CellError(RecordingError(row.where, "repeats the names of the columns", hint, row.number))]
            continue
        count += 1
        if len(row.cells) != len(header.names):
            yield [CellError(_width_error(row, len(header.names)))]
            continue
        errors, time, quaternion = [], math.nan, dict[str, float]()
        for name, cell in zip(header.names, row.cells, strict=True):
            if name not in header.unknown_names:
                value = _parse_cell(row, header, name, cell.strip(" "))
                if isinstance(value, RecordingError):
                    is_bridgeable = name.startswith(WINCH_COLUMNS) and cell.strip(" ") in MISSING_CELLS
                    errors.append(CellError(value, name if is_bridgeable else None))
                elif name == "time":
                    time = value
                elif name in QUATERNION_COLUMNS:
                    quaternion[name] = value
        if time <= previous_time:
            errors.append(CellError(_time_error(row, header, time, previous_time)))
        problem_and_hint = quaternion_problem(quaternion) if len(quaternion) == len(QUATERNION_COLUMNS) else None
        if problem_and_hint:
            errors.append(CellError(RecordingError(row.where, *problem_and_hint, row.number)))
        previous_time = time if time > previous_time else previous_time
        yield errors
    if count < 2:
        samples = "1 sample" if count else "no samples"
        yield [CellError(RecordingError(file, f"has {samples}, must have at least 2", "record for longer"))]


def _time_error(row: Row, header: Header, time: float, previous_time: float) -> RecordingError:
    """The error of a time that does not rise: it repeats, goes back, or begins anew, also as a counter does."""
    problem = f"is {time!r} after {previous_time!r}, must rise from sample to sample"
    hint = "sort the samples; where the clock was set or a second run begins, cut the recording there"
    if time == previous_time:
        hint = "remove duplicates; of times that are rounded write more digits"
    for bits in _COUNTER_BITS:
        period = header.to_si("time", 2.0**bits) - header.to_si("time", 0.0)
        if 1.0 - _MAX_COUNTER_STEP <= (previous_time - time) / period <= 1.0:
            problem += f", as a counter of {bits} bits does where it begins anew"
            hint = f"add {2**bits} to all times from this line on, and as much more wherever it begins anew again"
    return _cell_error(row, "time", problem, hint)


def not_a_table_error(file: str) -> RecordingError:
    """The error of a file that is not a table of numbers for another reason than the rules name."""
    return RecordingError(file, "is not a table of numbers", "write one line per sample, one number per cell")


def _width_error(row: Row, width: int) -> RecordingError:
    hint = "complete the line or remove it"
    if len(row.cells) > width:
        hint = "write numbers with a decimal point, and one cell for each column"
    cells = "1 cell" if len(row.cells) == 1 else f"{len(row.cells)} cells"
    return RecordingError(row.where, f"has {cells}, the header has {width}", hint, row.number)


def _parse_cell(row: Row, header: Header, name: str, cell: str) -> float | RecordingError:
    """The number in a cell, NaN where an output is missing; or what is wrong with it."""
    if cell in MISSING_CELLS:
        if name == "time" or is_winch_column_used(name, header.known_names):
            problem = f"is {format_value(cell) if cell else 'empty'}, must be a number"
            hint = "write a number, or cut the recording before this sample"
            if name.startswith(WINCH_COLUMNS):
                hint += f"; at most {MAX_GAP_SAMPLES} in a row are interpolated, between numbers"
            return _cell_error(row, name, problem, hint)
        return math.nan
    number = header.number(name, cell)
    if abs(number) <= MAX_MAGNITUDE:
        return number
    hint = "write a number, or leave the cell of an output empty where nothing was measured"
    if math.isinf(number):
        return _cell_error(row, name, f"is {format_value(cell)}, must be finite", hint)
    if math.isnan(number):
        return _cell_error(row, name, *_not_a_number(header, name, cell, hint))
    problem = f"is {format_value(cell)}, must be at most {MAX_MAGNITUDE:g} in magnitude"
    epoch = next(
        (unit for unit, size in _EPOCH_UNITS.items() if name == "time" and 0.0 < number / size < _MAX_EPOCH), None
    )
    if epoch is not None:
        problem = f"is {format_value(cell)}, as {epoch} since 1970 are"
        line = f'time = {{ unit = "{epoch}" }} in [recording.columns], of a tracker in [recording.tracker.columns]'
        return _cell_error(row, name, problem, f"write time [{epoch}] in the header, or {line}")
    is_placeholder = abs(number) >= MIN_PLACEHOLDER
    return _cell_error(row, name, problem, hint if is_placeholder else "give it in SI units")


def _not_a_number(header: Header, name: str, cell: str, hint: str) -> tuple[str, str]:
    """The problem of a cell that holds no number, and the hint."""
    if name == "time" and header.clock is not None:
        return f"is {format_value(cell)}, not a time in {header.clock.style}", "write all times as the first"
    number_hint = hint_for_number(cell, header.decimal_mark)
    if name == "time" and any(map(str.isdigit, cell)) and (":" in cell or not number_hint):
        hint = "write seconds, hh:mm:ss, or ISO 8601 as in 2024-05-31T12:00:00.25Z"
    else:
        hint = number_hint or hint
    return f"is {format_value(cell)}, not a number", hint


def _cell_error(row: Row, name: str, problem: str, hint: str) -> RecordingError:
    return RecordingError(f"{row.where}, column {name}", problem, hint, row.number)


@dataclass(frozen=True)
class ColumnTable:
    """The known columns of a columnar file or a frame, in memory."""

    file: str
    header: Header
    columns: Mapping[str, NDArray[np.float64]]

    def numbers(self) -> Mapping[str, NDArray[np.float64]]:
        """The known columns, each of shape (N,), NaN where a cell is null."""
        return self.columns

    def rows(self) -> Iterator[Row]:
        """The samples, counted from 1, each with the file and its number, as a CSV file would have them."""
        sample_count = len(next(iter(self.columns.values()), ()))
        missing = np.full(sample_count, math.nan)
        columns = [self.columns.get(name, missing) for name in self.header.names]
        for number, row in enumerate(zip(*columns, strict=True), 1):
            yield Row(f"{self.file}: row {number}", number, [repr(float(value)) for value in row])
