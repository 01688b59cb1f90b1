"""The rules that the cells of a recording keep, and the line and column where one is broken."""

import csv
import math
import re
from collections.abc import Iterator
from typing import NoReturn

from .errors import RecordingError, shown
from .recording_header import Header, as_text

HUGE = 1e12  # beyond any quantity of a cable robot in SI units
MISSING = ("", "nan", "NaN", "NAN", "NA")  # what loggers write where a sensor dropped out

_DECIMAL_COMMA = re.compile(r"[-+]?[0-9]+,[0-9]+([eE][-+]?[0-9]+)?")


def raise_first_fault(content: bytes, header: Header, file: str) -> NoReturn:
    """Raises RecordingError about the first broken rule of a recording that breaks one; takes its time."""
    count = 0
    before = -math.inf
    for where, row in _rows(content, file):
        time = _checked_time(where, row, header)
        if time <= before:
            problem = f"is {time!r} after {before!r}, must rise from line to line"
            raise _fault(where, "time", problem, "sort the samples, keep each once")
        before = time
        count += 1
    if count < 2:
        samples = "1 sample" if count else "no samples"
        raise RecordingError(file, f"has {samples}, must have at least 2", "record for longer")
    raise RecordingError(file, "is no table of numbers", "write one line per sample, one number per cell")


def _rows(content: bytes, file: str) -> Iterator[tuple[str, list[str]]]:
    """Rows below the header that are not blank, each with the file and the line on which it begins."""
    rows = csv.reader(as_text(content), skipinitialspace=True, strict=True)
    begin = 1
    try:
        next(rows)
        begin = rows.line_num + 1
        for row in rows:
            if len(row) > 1 or "".join(row).strip():
                yield f"{file}: line {begin}", row
            begin = rows.line_num + 1
    except csv.Error as problem:
        mend = "check the quotation marks from this line on"
        raise RecordingError(f"{file}: line {begin}", f"is no CSV ({problem})", mend) from problem


def _checked_time(where: str, row: list[str], header: Header) -> float:
    """The time of a row whose cells are all checked, in s."""
    if len(row) != len(header.names):
        mend = "complete the line or remove it"
        if len(row) > len(header.names):
            mend = "write numbers with a decimal point, and one cell for each column"
        raise RecordingError(where, f"has {len(row)} cells, the header has {len(header.names)}", mend)
    numbers = {
        name: _number(where, name, cell.strip(" "))
        for name, cell in zip(header.names, row, strict=True)
        if name not in header.unknown
    }
    return numbers["time"]


def _number(where: str, name: str, cell: str) -> float:
    """The number in a cell; NaN where an output is missing."""
    if cell in MISSING:
        if name == "time" or name.startswith("winch_speed_"):
            problem = f"is {shown(cell) if cell else 'empty'}, must be a number"
            raise _fault(where, name, problem, "write a number, or cut the recording before this line")
        return math.nan
    try:
        # Python's own float would take underscores and the digits of all scripts.
        number = math.nan if "_" in cell or not cell.isascii() else float(cell)
    except ValueError:
        number = math.nan
    if abs(number) <= HUGE:
        return number
    mend = "write a number, or leave the cell of an output empty where nothing was measured"
    if math.isinf(number):
        raise _fault(where, name, f"is {shown(cell)}, must be finite", mend)
    if _DECIMAL_COMMA.fullmatch(cell):
        mend = "write it with a decimal point"
    if math.isnan(number):
        raise _fault(where, name, f"is {shown(cell)}, not a number", mend)
    problem = f"is {shown(cell)}, must be at most {HUGE:g} in magnitude"
    raise _fault(where, name, problem, "give it in SI units")


def _fault(where: str, name: str, problem: str, mend: str) -> RecordingError:
    return RecordingError(f"{where}, column {name}", problem, mend)
