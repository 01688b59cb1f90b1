"""Lines of a recording in CSV of any dialect: comments, cells, and units beside the names of columns."""

from __future__ import annotations

import csv
import re
from collections.abc import Container, Sequence

from .clock_time import clock_format
from .recording_table import MISSING_CELLS
from .units import find_unit, is_any_unit

# In the order of preference where two explain a header equally well.
SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "bars", ",": "commas", " ": "spaces"}

# Characters; what is longer is neither a name with a unit nor a number, and would take long to match.
MAX_CELL_LENGTH = 200

_COMMENT_MARK = re.compile(r"\s*(?:#|%|//)+\s*")
_SPACE_BEFORE_BRACKET = re.compile(r"(?<=\w)[ \t]+(?=[\[(])")
_UNIT_IN_BRACKETS = re.compile(r"(.+?)\s*/?\s*(\[[^\[\]]*\]|\([^()]*\))")
_UNIT_AFTER_SLASH = re.compile(r"([^/\s]+)\s*/\s*(.+)")
_UNITS_LABEL = re.compile(r"units?\s*[:=]\s*", re.IGNORECASE)
_NUMBER = re.compile(r"[-+]?[0-9]*[.,]?[0-9]+([eE][-+]?[0-9]+)?")


def is_comment(line: str) -> bool:
    """Whether a line begins with the mark of a comment: ``#``, ``%`` or ``//``."""
    return _COMMENT_MARK.match(line) is not None


def without_comment_mark(line: str) -> str:
    """A line less the mark of a comment at its beginning."""
    return _COMMENT_MARK.sub("", line, count=1)


def split_cells(line: str, separator: str) -> list[str]:
    """Cells of one line, stripped; none where it is not valid CSV. Between spaces, a unit in brackets is no cell."""
    if separator == " ":
        return [cell.strip('"') for cell in _SPACE_BEFORE_BRACKET.sub("", line).split()]
    try:
        rows = csv.reader([line], delimiter=separator, skipinitialspace=True)
        return [cell.strip() for cell in next(rows, [])]
    except csv.Error:
        return []


def split_unit(cell: str, known: Container[str]) -> tuple[str, str]:
    """Name and unit in a cell of a header, such as ``x [mm]``, ``x (mm)`` or ``x / mm``; the unit is blank without one.

    What is not a known column with a unit beside it is a name as a whole.
    """
    for pattern in () if cell in known or len(cell) > MAX_CELL_LENGTH else (_UNIT_IN_BRACKETS, _UNIT_AFTER_SLASH):
        match = pattern.fullmatch(cell)
        if match and match.group(1) in known:
            return match.group(1), match.group(2)
    return cell, ""


def unit_in_name(name: str) -> str:
    """What stands in brackets at the end of a name, or behind a slash; blank without."""
    patterns = () if len(name) > MAX_CELL_LENGTH else (_UNIT_IN_BRACKETS, _UNIT_AFTER_SLASH)
    return next((match.group(2) for match in (pattern.fullmatch(name) for pattern in patterns) if match), "")


def is_number(cell: str) -> bool:
    """Whether a cell is a number with a decimal point or comma."""
    return len(cell) <= MAX_CELL_LENGTH and _NUMBER.fullmatch(cell) is not None


def units_in_line(line: str, separator: str, names: Sequence[str], known: Container[str]) -> list[str]:
    """Units in a line, one for each column; none where it is no line of units.

    A comment is one where a known column has a known unit, or all of them have between other separators; any other
    line with a known unit where no cell is a number or missing.
    """
    if not is_comment(line):
        cells = _cells_of(line, separator, len(names))
        # A dash is also the unit of a number without one.
        is_data = any(
            is_number(cell) or clock_format(cell) or (cell in MISSING_CELLS and cell.strip("-")) for cell in cells
        )
        return cells if not is_data and any(map(is_any_unit, cells)) else []
    text = _UNITS_LABEL.sub("", without_comment_mark(line))
    for other in (separator, *SEPARATORS):
        cells = _cells_of(text, other, len(names))
        are_units = [bool(find_unit(cell, name)) for name, cell in zip(names, cells, strict=False) if name in known]
        if any(are_units) if other == separator else are_units and all(are_units):
            return cells
    return []


def count_units(comment: str) -> int:
    """The number of units in a comment that lists two or more, and nothing else; 0 in any other."""
    text = _UNITS_LABEL.sub("", without_comment_mark(comment))
    lists = (split_cells(text, separator) for separator in SEPARATORS)
    return max((len(cells) for cells in lists if len(cells) > 1 and all(map(is_any_unit, cells))), default=0)


def _cells_of(line: str, separator: str, count: int) -> list[str]:
    """Cells of a line, without a last one that is empty; none where their number differs, or all are empty."""
    cells = split_cells(line, separator)
    if len(cells) == count + 1 and not cells[-1]:
        cells.pop()
    return cells if len(cells) == count and any(cells) else []
