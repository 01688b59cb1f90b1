"""The rules that the cells of a recording keep, and the rows and columns where one is broken."""

import math
import re
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from ..errors import RecordingError, shown
from .header import Header


class Row(NamedTuple):
    """The cells of one sample; ``where`` names the file and the line or row, ``number`` is that, from 1."""

    where: str
    number: int
    cells: list[str]


HUGE = 1e12  # beyond any quantity of a cable robot in SI units
MISSING = ("", "nan", "NaN", "NAN", "NA")  # what loggers write where a sensor dropped out

_DECIMAL_COMMA = re.compile(r"[-+]?[0-9]+,[0-9]+([eE][-+]?[0-9]+)?")


def faults(rows: Iterable[Row], header: Header, file: str) -> Iterator[RecordingError]:
    """Every broken rule of the samples of a recording, in the file's order; takes its time."""
    count, before = 0, -math.inf
    for row in rows:
        count += 1
        if len(row.cells) != len(header.names):
            yield _of_row(row, len(header.names))
            continue
        time = math.nan
        for name, cell in zip(header.names, row.cells, strict=True):
            if name not in header.unknown:
                found = _number(row, name, cell.strip(" "))
                if isinstance(found, RecordingError):
                    yield found
                elif name == "time":
                    time = found
        if time <= before:
            problem = f"is {time!r} after {before!r}, must rise from sample to sample"
            yield _fault(row, "time", problem, "sort the samples, keep each once")
        before = time if time > before else before
    if count < 2:
        samples = "1 sample" if count else "no samples"
        yield RecordingError(file, f"has {samples}, must have at least 2", "record for longer")


def no_table(file: str) -> RecordingError:
    """What is wrong where no rule is broken that has a name."""
    return RecordingError(file, "is no table of numbers", "write one line per sample, one number per cell")


def _of_row(row: Row, width: int) -> RecordingError:
    mend = "complete the line or remove it"
    if len(row.cells) > width:
        mend = "write numbers with a decimal point, and one cell for each column"
    return RecordingError(row.where, f"has {len(row.cells)} cells, the header has {width}", mend, row.number)


def _number(row: Row, name: str, cell: str) -> float | RecordingError:
    """The number in a cell, NaN where an output is missing; or what is wrong with it."""
    if cell in MISSING:
        if name == "time" or name.startswith("winch_speed_"):
            problem = f"is {shown(cell) if cell else 'empty'}, must be a number"
            return _fault(row, name, problem, "write a number, or cut the recording before this sample")
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
        return _fault(row, name, f"is {shown(cell)}, must be finite", mend)
    if _DECIMAL_COMMA.fullmatch(cell):
        mend = "write it with a decimal point"
    if math.isnan(number):
        return _fault(row, name, f"is {shown(cell)}, not a number", mend)
    problem = f"is {shown(cell)}, must be at most {HUGE:g} in magnitude"
    return _fault(row, name, problem, "give it in SI units")


def _fault(row: Row, name: str, problem: str, mend: str) -> RecordingError:
    return RecordingError(f"{row.where}, column {name}", problem, mend, row.number)
