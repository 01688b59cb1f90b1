"""Validation rules for the cells of a recording, and errors that name the row and column."""

import math
import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from ..errors import RecordingError, format_value
from .header import Header


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
            yield _cell_error(row, "time", problem, "sort the samples, keep each once")
        previous_time = time if time > previous_time else previous_time
    if count < 2:
        samples = "1 sample" if count else "no samples"
        yield RecordingError(file, f"has {samples}, must have at least 2", "record for longer")


def not_a_table_error(file: str) -> RecordingError:
    """The error of a file that is no table of numbers for another reason than the rules name."""
    return RecordingError(file, "is no table of numbers", "write one line per sample, one number per cell")


def _width_error(row: Row, width: int) -> RecordingError:
    hint = "complete the line or remove it"
    if len(row.cells) > width:
        hint = "write numbers with a decimal point, and one cell for each column"
    return RecordingError(row.where, f"has {len(row.cells)} cells, the header has {width}", hint, row.number)


def _parse_cell(row: Row, name: str, cell: str) -> float | RecordingError:
    """The number in a cell, NaN where an output is missing; or what is wrong with it."""
    if cell in MISSING_CELLS:
        if name == "time" or name.startswith("winch_speed_"):
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
