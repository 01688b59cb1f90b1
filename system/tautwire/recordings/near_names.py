"""Names of columns that are standard ones but for case, separators or a unit behind them."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Sequence

from ..errors import RecordingError, format_value
from ..robot.recorded_columns import column_line
from ..robot.schema import AXES, RecordedColumn
from .units import find_unit

_WORD = re.compile(r"[A-Za-z]+|[0-9]+")
_TENSION = re.compile(r"tension_[0-9]+")
_AROUND_UNIT = " \t_-.,:;/|[](){}<>"
# They end names of other things, too: x_in is an input or reference.
_UNITS_IN_BRACKETS = frozenset({"in", "g", "h", "d", "min", "s"})


def nearly_named(name: str, columns: Iterable[str]) -> RecordedColumn | None:
    """The column that a name means that differs from its own in case, separators or a unit; None for another name.

    ``X [mm]`` and ``x_mm`` mean x in mm, ``Tension1`` tension_1, and ``x (raw)`` and ``X_4`` none.
    """
    words = list(_WORD.finditer(name))
    shown = [match.group().lower().lstrip("0") for match in words]
    for column in columns:
        wanted = _WORD.findall(column)
        if shown[: len(wanted)] != wanted or name[: words[0].start()].strip(_AROUND_UNIT):
            continue
        tail = name[words[len(wanted) - 1].end() :].strip(_AROUND_UNIT)
        text = re.sub(r"^in[\s_]+", "", tail)
        if text in _UNITS_IN_BRACKETS and not re.search(r"[\[({<]", name):
            return None
        unit = find_unit(f"[{text}]", column) if text and not text.isdigit() else None
        if unit is not None or not text:
            return RecordedColumn(column, name, "" if unit is None or unit.symbol == "1" else unit.symbol)
    return None


def near_name_errors(
    unknown_names: Iterable[str], absent: Sequence[str], where: str, table: str, line: int | None
) -> Iterator[RecordingError]:
    """Errors of columns that would not be read, and whose names mean an absent one, with the line that declares it."""
    for name in unknown_names:
        column = nearly_named(name, absent)
        if column is not None:
            problem = f"the column {format_value(name)} is not read, and {column.column} is missing"
            hint = f"write into [{table}] {column_line(column)}, or rename it, of another quantity too"
            yield RecordingError(where, problem, hint, line)


def columns_of_absent_kinds(columns: Iterable[str], names: Collection[str]) -> list[str]:
    """Those of the columns of tensions and of positions where not one of the kind is among a recording's names.

    Where one is, others were left out on purpose: of a load cell that is dead, or across a planar robot's plane.
    """
    read = {None, *map(_kind, names)}
    return sorted(column for column in columns if _kind(column) not in read)


def _kind(name: str) -> str | None:
    if _TENSION.fullmatch(name):
        return "tension"
    return "position" if name in AXES else None
