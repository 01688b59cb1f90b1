"""The rules that the cells of a recording keep, and the row and column where one is broken."""

import math
import re
from collections.abc import Iterable
from typing import NoReturn

from ..errors import RecordingError, shown
from .header import Header

Row = tuple[str, list[str]]  # the file and the row's place in it, then the cells

HUGE = 1e12  # beyond any quantity of a cable robot in SI units
MISSING = ("", "nan", "NaN", "NAN", "NA")  # what loggers write where a sensor dropped out

_DECIMAL_COMMA = re.compile(r"[-+]?[0-9]+,[0-9]+([eE][-+]?[0-9]+)?")


def raise_first_fault(rows: Iterable[Row], header: Header, file: str) -> NoReturn:
    """Raises RecordingError about the first broken rule of a recording that breaks one; takes its time."""
    count = 0
    before = -math.inf
    for where, row in rows:
        time = _checked_time(where, row, header)
        if time <= before:
            problem = f"is {time!r} after {before!r}, must rise from sample to sample"
            raise _fault(where, "time", problem, "sort the samples, keep each once")
        before = time
        count += 1
    if count < 2:
        samples = "1 sample" if count else "no samples"
        raise RecordingError(file, f"has {samples}, must have at least 2", "record for longer")
    raise RecordingError(file, "is no table of numbers", "write one line per sample, one number per cell")


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
            raise _fault(where, name, problem, "write a number, or cut the recording before this sample")
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
