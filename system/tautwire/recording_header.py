"""The header line of a recording: which columns there are and which are missing."""

import csv
import re
from dataclasses import dataclass
from io import BytesIO, TextIOWrapper

from .checked_table import nearest
from .errors import RecordingError, shown

AXES = ("x", "y", "z")

_OF_A_CABLE = re.compile(r"(?:winch_speed|tension)_(0|[1-9][0-9]{0,5})")
_NUMBER = re.compile(r"[-+]?[0-9]*[.,]?[0-9]+([eE][-+]?[0-9]+)?")


@dataclass(frozen=True)
class Header:
    """Columns of a recording: ``names`` are all in the file's order, each once; ``unknown`` are not read."""

    names: tuple[str, ...]
    unknown: tuple[str, ...]


def as_text(content: bytes) -> TextIOWrapper:
    """The lines of a CSV file, as the csv module wants them."""
    return TextIOWrapper(BytesIO(content), encoding="utf-8", newline="")


def read_header(content: bytes, file: str, cable_count: int) -> Header:
    """The header of a recording; raises RecordingError unless time and every winch speed have a column."""
    where = f"{file}: line 1"
    known = known_columns(cable_count)
    cells = _first_row(content, file)
    _require_header(cells, where)
    names = tuple(cell or f"(column {place})" for place, cell in enumerate(cells, 1))
    for place, name in enumerate(names):
        if name in names[:place]:
            raise RecordingError(where, f"the column {shown(name)} is there twice", "keep one of the two")
        of_a_cable = _OF_A_CABLE.fullmatch(name)
        if of_a_cable and not 1 <= int(of_a_cable.group(1)) <= cable_count:
            problem = f"the column {name} is of no cable, the robot has cables 1 to {cable_count}"
            raise RecordingError(where, problem, "give the robot file that belongs to this recording")
    unknown = tuple(name for name in names if name not in known)
    for needed in ("time", *(f"winch_speed_{cable}" for cable in range(1, cable_count + 1))):
        if needed not in names:
            mend = f"add it, or rename {nearest(needed, unknown)}" if unknown else "add it"
            raise RecordingError(where, f"the column {needed} is missing", mend)
    return Header(names, unknown)


def known_columns(cable_count: int) -> frozenset[str]:
    """Names of all columns that a recording may have."""
    cables = range(1, cable_count + 1)
    of_cables = (f"{kind}_{cable}" for kind in ("winch_speed", "tension") for cable in cables)
    return frozenset(("time", *AXES, *of_cables))


def _first_row(content: bytes, file: str) -> list[str]:
    if not content.strip():
        raise RecordingError(file, "is empty", "write a header line and two or more samples")
    try:
        return [cell.strip() for cell in next(csv.reader(as_text(content), skipinitialspace=True))]
    except csv.Error as problem:
        raise RecordingError(f"{file}: line 1", f"is no CSV ({problem})", "write a header line") from problem


def _require_header(cells: list[str], where: str) -> None:
    if not any(cells):
        raise RecordingError(where, "is blank, the header is missing", "begin with the names of the columns")
    for separator, name in ((";", "semicolons"), ("\t", "tabs")):
        if "time" not in cells and any(separator in cell for cell in cells):
            mend = "separate them with commas, and write numbers with a decimal point"
            raise RecordingError(where, f"the columns are separated with {name}", mend)
    if all(_NUMBER.fullmatch(cell) for cell in cells):
        mend = "begin with a line that names the columns, as in time,winch_speed_1"
        raise RecordingError(where, f"has numbers ({shown(cells[0])}), so the header is missing", mend)
