"""Lines of [recording.columns] that read a recording otherwise: in other units, signs and orders, or from another zero.

A correction is linear in what is read now, and corrections follow one another: where y is the sign of z read in mm,
both stand in one line. What no such line can say, as a turned frame or a clock, has no correction.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..robot.recorded_columns import CABLE_COLUMNS, LOG_TABLE, column_line, recorded_name
from ..robot.schema import AXES, RecordedColumn
from .recording import Recording
from .units import find_unit

SHIFT_DIGITS, FACTOR_DIGITS = 6, 15


@dataclass(frozen=True)
class ColumnCorrection:
    """How a standard column is to be read: ``sign * factor * source + shift``, of what is read as ``source`` now.

    ``source`` is a standard column, by default the column itself; ``unit`` is that of which one is ``factor`` in SI
    units, blank where it is no unit's; ``shift`` is in SI units.
    """

    column: str
    source: str = ""
    unit: str = ""
    factor: float = 1.0
    sign: float = 1.0
    shift: float = 0.0


def scaled(columns: Sequence[str], factor: float, unit: str = "") -> tuple[ColumnCorrection, ...]:
    """Corrections of columns by a common factor, that of ``unit`` where it has a name."""
    return tuple(ColumnCorrection(column, unit=unit, factor=factor) for column in columns)


def negated(columns: Sequence[str]) -> tuple[ColumnCorrection, ...]:
    """Corrections of columns that have the other sign."""
    return tuple(ColumnCorrection(column, sign=-1.0) for column in columns)


def reordered(columns: Sequence[str], sources: Sequence[str]) -> tuple[ColumnCorrection, ...]:
    """Corrections of columns that stand in others' places; none for one that stands in its own."""
    pairs = zip(columns, sources, strict=True)
    return tuple(ColumnCorrection(column, source) for column, source in pairs if column != source)


def corrected_lines(
    recording: Recording, steps: Sequence[Sequence[ColumnCorrection]], table: str = LOG_TABLE
) -> dict[str, tuple[str, ...]]:
    """Lines that declare the columns of a recording as corrected, with what is declared of them already, by table.

    The corrections of one step are simultaneous, and correct what those of the steps before it read. A kind of column
    whose lines are alike for all cables has one line for them. ``table`` is that of columns without a declaration.
    """
    declared, columns = recording.columns, dict[str, RecordedColumn]()
    for step in steps:
        recorded = recorded_corrections(recording, step)
        columns |= {each.column: _corrected(_recorded(each, columns, declared, table), each) for each in recorded}
    own = {name for name, column in declared.items() if column.column == name and column.file}
    for kind in CABLE_COLUMNS:
        names = [f"{kind}_{cable}" for cable in range(1, recording.cable_count + 1)]
        if len(names) > 1 and columns.keys() >= set(names) and not own & set(names):
            alike = _for_all_cables(kind, [columns[name] for name in names])
            others = {name: column for name, column in columns.items() if name not in names}
            columns = columns if alike is None else {alike.column: alike} | others
    tables = dict.fromkeys(column.table for column in columns.values())
    return {name: tuple(column_line(each) for each in columns.values() if each.table == name) for name in tables}


def recorded_corrections(recording: Recording, corrections: Sequence[ColumnCorrection]) -> tuple[ColumnCorrection, ...]:
    """Those of columns that a recording has; a line for another would be an error, or not used."""
    return tuple(each for each in corrections if _is_recorded(each.source or each.column, recording))


def _is_recorded(column: str, recording: Recording) -> bool:
    if column == "time":
        return recording.has_time_column
    kind, _, cable = column.rpartition("_")
    if kind == "tension":
        return bool(np.isfinite(recording.tension[:, int(cable) - 1]).any())
    return column not in AXES or bool(np.isfinite(recording.position[:, AXES.index(column)]).any())


def _recorded(
    correction: ColumnCorrection,
    columns: Mapping[str, RecordedColumn],
    declared: Mapping[str, RecordedColumn],
    table: str,
) -> RecordedColumn:
    """The column of the recording that a correction is for, as it is declared so far."""
    source = correction.source or correction.column
    if source in columns:
        return columns[source]
    column = declared.get(source, RecordedColumn(source, source, table=table))
    return replace(column, column=source, name=recorded_name(source, column))


def _corrected(recorded: RecordedColumn, correction: ColumnCorrection) -> RecordedColumn:
    is_unit = find_unit(correction.unit, correction.column) is not None
    has_scale = bool(recorded.unit) or recorded.factor != 1.0 or not is_unit
    factor = _rounded(recorded.factor * correction.factor, FACTOR_DIGITS)
    unit, factor = (recorded.unit, factor) if has_scale else (correction.unit, 1.0)
    sign, found = recorded.sign * correction.sign, find_unit(unit, correction.column)
    size = sign * factor * (1.0 if found is None else found.to_si(1.0))
    # What was measured is the shift: of a large declared offset all digits count.
    offset = _rounded(recorded.offset - _rounded(correction.shift / size, SHIFT_DIGITS), FACTOR_DIGITS)
    return replace(recorded, column=correction.column, unit=unit, factor=factor, sign=sign, offset=offset)


def _rounded(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")


def _for_all_cables(kind: str, columns: Sequence[RecordedColumn]) -> RecordedColumn | None:
    """The one declaration that is for all cables, counted from 1; None where there is none."""
    name = columns[0].name
    ones = [match.start() for match in re.finditer("1", name)]
    for pattern in (name.replace("1", "{}"), *(f"{name[:index]}{{}}{name[index + 1 :]}" for index in ones)):
        alike = replace(columns[0], column=f"{kind}_{{}}", name=pattern)
        expanded = [replace(alike, column=each.column, name=recorded_name(each.column, alike)) for each in columns]
        if ones and expanded == list(columns):
            return alike
    return None
