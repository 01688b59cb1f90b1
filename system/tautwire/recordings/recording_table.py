"""Recordings as tables: their header, their rows, and the validation rules of their cells."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import repeat
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError, format_value, raise_error
from ..name_suggestions import closest_name
from ..robot.schema import AXES

# A larger file is no recording of a cable robot, or does not fit into memory.
MAX_COLUMNS = 10_000
MAX_SAMPLES = 20_000_000

ErrorSink = Callable[[RecordingError], None]

_CABLE_COLUMN = re.compile(r"(?:winch_speed|rope_length|tension)_(0|[1-9][0-9]{0,5})")


@dataclass(frozen=True)
class Header:
    """Columns of a recording: ``names`` are all in the file's order, each once; ``unknown_names`` are not read."""

    names: tuple[str, ...]
    unknown_names: tuple[str, ...]

    @property
    def known_names(self) -> tuple[str, ...]:
        """The columns that are read, in the file's order."""
        return tuple(name for name in self.names if name not in self.unknown_names)


def parse_header(
    cells: Sequence[str], where: str, cable_count: int, sink: ErrorSink = raise_error, line: int | None = None
) -> Header:
    """Parse the header in these cells; raises RecordingError unless time and every winch have a column.

    A winch has its speed, or the length of its rope.

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
        if cable_match and not 1 <= int(cable_match.group(1)) <= cable_count:
            problem = f"the column {name} belongs to no cable, the robot has cables 1 to {cable_count}"
            sink(RecordingError(where, problem, "give the robot file that belongs to this recording", line))
    unknown_names = tuple(name for name in names if name not in allowed_names)
    for required in ("time", *(f"winch_speed_{cable}" for cable in range(1, cable_count + 1))):
        if required not in names and required.replace("winch_speed", "rope_length") not in names:
            similar = closest_name(required, unknown_names)
            hint = "add it" if similar is None else f"add it, or rename {format_value(similar)}"
            sink(RecordingError(where, f"the column {required} is missing", hint, line))
    return Header(names, unknown_names)


def require_samples(count: int, where: str) -> None:
    """Raises RecordingError where a file has, or claims to have, more samples than are read."""
    if count > MAX_SAMPLES:
        problem = f"has {count} samples, at most {MAX_SAMPLES} are read"
        raise RecordingError(where, problem, "cut it into several recordings")


def known_columns(cable_count: int) -> frozenset[str]:
    """Names of all columns that a recording may have."""
    cables = range(1, cable_count + 1)
    cable_columns = (f"{kind}_{cable}" for kind in ("winch_speed", "rope_length", "tension") for cable in cables)
    return frozenset(("time", *AXES, *cable_columns))


class Row(NamedTuple):
    """The cells of one sample; ``where`` names the file and the line or row, ``number`` is that, from 1."""

    where: str
    number: int
    cells: list[str]


MAX_MAGNITUDE = 1e12  # beyond any quantity of a cable robot in SI units
MISSING_CELLS = ("", "nan", "NaN", "NAN", "NA")  # what loggers write where a sensor dropped out

_DECIMAL_COMMA = re.compile(r"[-+]?[0-9]+,[0-9]+([eE][-+]?[0-9]+)?")


def row_errors(rows: Iterable[Row], header: Header, file: str) -> Iterator[RecordingError]:
    """Validation errors of all samples of a recording, in the file's order; parses every cell, so it is slow."""
    count, previous_time = 0, -math.inf
    for row in rows:
        count += 1
        if len(row.cells) != len(header.names):
            yield _width_error(row, len(header.names))
            continue
        time = math.nan
        for name, cell in zip(header.names, row.cells, strict=True):
            if name not in header.unknown_names:
                value = _parse_cell(row, name, cell.strip(" "))
                if isinstance(value, RecordingError):
                    yield value
                elif name == "time":
                    time = value
        if time <= previous_time:
            problem = f"is {time!r} after {previous_time!r}, must rise from sample to sample"
            yield _cell_error(row, "time", problem, "sort the samples and remove duplicates")
        previous_time = time if time > previous_time else previous_time
    if count < 2:
        samples = "1 sample" if count else "no samples"
        yield RecordingError(file, f"has {samples}, must have at least 2", "record for longer")


def not_a_table_error(file: str) -> RecordingError:
    """The error of a file that is not a table of numbers for another reason than the rules name."""
    return RecordingError(file, "is not a table of numbers", "write one line per sample, one number per cell")


def _width_error(row: Row, width: int) -> RecordingError:
    hint = "complete the line or remove it"
    if len(row.cells) > width:
        hint = "write numbers with a decimal point, and one cell for each column"
    return RecordingError(row.where, f"has {len(row.cells)} cells, the header has {width}", hint, row.number)


def _parse_cell(row: Row, name: str, cell: str) -> float | RecordingError:
    """The number in a cell, NaN where an output is missing; or what is wrong with it."""
    if cell in MISSING_CELLS:
        if name == "time" or name.startswith(("winch_speed_", "rope_length_")):
            problem = f"is {format_value(cell) if cell else 'empty'}, must be a number"
            return _cell_error(row, name, problem, "write a number, or cut the recording before this sample")
        return math.nan
    try:
        # Python's float also accepts underscores and the digits of all scripts.
        number = math.nan if "_" in cell or not cell.isascii() else float(cell)
    except ValueError:
        number = math.nan
    if abs(number) <= MAX_MAGNITUDE:
        return number
    hint = "write a number, or leave the cell of an output empty where nothing was measured"
    if math.isinf(number):
        return _cell_error(row, name, f"is {format_value(cell)}, must be finite", hint)
    if _DECIMAL_COMMA.fullmatch(cell):
        hint = "write it with a decimal point"
    if math.isnan(number):
        return _cell_error(row, name, f"is {format_value(cell)}, not a number", hint)
    problem = f"is {format_value(cell)}, must be at most {MAX_MAGNITUDE:g} in magnitude"
    return _cell_error(row, name, problem, "give it in SI units")


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
        columns = [self.columns.get(name, repeat(math.nan)) for name in self.header.names]
        for number, row in enumerate(zip(*columns, strict=False), 1):
            yield Row(f"{self.file}: row {number}", number, [repr(float(value)) for value in row])
