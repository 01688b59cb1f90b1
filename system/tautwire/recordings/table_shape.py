"""Tables of another shape than one line of names and a line per sample: rows that are columns, names in each cell."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from ..errors import RecordingError
from .csv_lines import SEPARATORS, is_number, split_cells

MIN_NAMED_LINES = 3
_LABELLED = re.compile(r"\s*([A-Za-z_]\w*)\s*[:=]\s*(\S+)\s*")
_ARROW = re.compile(r"^\s*[0-9:.,]+\s*->\s*\S")


def require_upright(lines: Sequence[str], known: Mapping[str, str], file: str) -> None:
    """Raises RecordingError where lines hold one column each, each cell its name, or a serial monitor's arrow."""
    for separator in SEPARATORS:
        rows = [split_cells(line, separator) for line in lines[: 10 * MIN_NAMED_LINES] if line.strip()]
        named = [row for row in rows if len(row) > 2 and row[0] in known and all(map(is_number, row[1:] or [""]))]
        if len(named) >= MIN_NAMED_LINES:
            problem = f"is transposed: lines begin with {named[0][0]}, {named[1][0]} ..., each with its samples"
            hint = "write one line of names and a line for each sample, as pandas.read_csv(..., index_col=0).T does"
            raise RecordingError(file, problem, hint)
        labels = [_LABELLED.fullmatch(cell) for row in rows[:1] for cell in row]
        if len(labels) > 1 and all(label is not None and is_number(label.group(2)) for label in labels):
            problem = f"has a name in each cell, as in {rows[0][0]!r}"
            raise RecordingError(f"{file}: line 1", problem, "write the names once, in the first line", 1)
    if lines and _ARROW.match(lines[0]):
        problem = "begins with a time and an arrow, as a serial monitor writes it"
        hint = "save it without timestamps, or write a comma for the arrow and a line of names above"
        raise RecordingError(f"{file}: line 1", problem, hint, 1)
