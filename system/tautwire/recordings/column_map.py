"""Columns of a recording by the laboratory's names: which standard column each is, and its scale."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby

from ..errors import AbsentColumnsError, RecordingError, RobotFileError, format_value
from ..name_suggestions import suggest_name
from ..robot.recorded_columns import columns_of_cables, recorded_name
from ..robot.schema import AXES, RecordedColumn
from .csv_lines import unit_in_name
from .recording_table import known_columns
from .units import UNITS, Unit, find_unit, quantity_of, require_unit

_BRACKETS = ("[", "(")
_UNIT_AND_FACTOR_HINT = "write the unit beside the factor where both apply, or else remove the factor"


@dataclass(frozen=True)
class ColumnMap:
    """The columns that are read of a recording of ``cable_count`` cables: ``scales`` by standard name, where declared.

    A standard column that is not declared keeps its name.
    """

    cable_count: int
    declared: tuple[RecordedColumn, ...] = ()

    @cached_property
    def scales(self) -> Mapping[str, RecordedColumn]:
        """What is declared of each standard column."""
        return columns_of_cables(self.declared, self.cable_count)

    @cached_property
    def standard_names(self) -> Mapping[str, str]:
        """Standard names of all columns that are read, by the names that the recording has."""
        renamed = {recorded_name(name, column): name for name, column in self.scales.items()}
        return {name: name for name in known_columns(self.cable_count) - self.scales.keys()} | renamed

    def renamed(self, names: Sequence[str], where: str, line: int | None = None) -> tuple[str, ...]:
        """The recording's names of columns as standard names; a column that another stands for is not read.

        Raises RecordingError where a declared column is missing, AbsentColumnsError where all of them are.
        """
        declared = {recorded_name(name, column): column for name, column in self.scales.items()}
        missing = [name for name in declared if name not in names]
        if missing:
            column = declared[missing[0]]
            candidates = [name for name in names if name and name not in self.standard_names]
            more = f" (nor {len(missing) - 1} more of those declared)" if len(missing) > 1 else ""
            problem = f"has no column {format_value(missing[0])}{more}, which {place_of(column)} names"
            hint = f"write {suggest_name(missing[0], candidates)}" if candidates else "correct or remove that line"
            error_class = AbsentColumnsError if len(missing) == len(declared) else RecordingError
            raise error_class(where, problem, hint, line)
        for name in declared:
            if names.count(name) > 1:
                problem = f"the column {format_value(name)} appears {names.count(name)} times"
                raise RecordingError(where, problem, "keep one of them", line)
        return tuple(self._standard_name(name) for name in names)

    def _standard_name(self, name: str) -> str:
        if name in self.standard_names:
            return self.standard_names[name]
        return f"{name} (as recorded)" if name in self.scales else name

    def stated_unit(self, name: str, text: str, where: str, line: int | None = None) -> Unit | None:
        """The unit of a standard column that a recording states; None where the declared one or a factor is for it."""
        column = self.scales.get(name)
        is_explained = column is not None and (bool(column.unit) or column.factor != 1.0)
        if is_explained and (
            not text.strip() or (column is not None and not column.unit and not find_unit(text, name))
        ):
            return None
        return require_unit(text, name, where, line)

    def units(self, stated: Mapping[str, Unit], where: str, line: int | None = None) -> dict[str, Unit]:
        """Units of standard columns, stated by the recording or declared; raises RecordingError where they differ."""
        units = dict(stated)
        for name, column in self.scales.items():
            text = unit_in_name(recorded_name(name, column))
            in_name = find_unit(text, name)
            recorded, declared = units.get(name) or in_name, find_unit(column.unit, name)
            column_where = f"{where}, column {recorded_name(name, column)}"
            is_explained = recorded or declared or column.factor != 1.0
            if text.startswith(_BRACKETS) and not is_explained:
                problem = f"is in {format_value(text)}, not a known unit of {quantity_of(name)}"
                hint = f"write unit or factor into {place_of(column)}"
                raise RecordingError(column_where, problem, hint, line)
            if recorded and declared and recorded != declared:
                problem = f"is in {recorded.symbol} here and in {declared.symbol} by {place_of(column, 'unit')}"
                raise RecordingError(column_where, problem, "correct the wrong one", line)
            if recorded and not declared and not recorded.is_si and column.factor != 1.0:
                problem = f"is in {recorded.symbol} here and has the factor {column.factor:g} by {place_of(column)}"
                raise RecordingError(column_where, problem, _UNIT_AND_FACTOR_HINT, line)
            unit = declared or recorded
            units |= {name: unit} if unit else {}
        return units

    def declared_units(self) -> dict[str, Unit]:
        """Units that are declared of standard columns, for a recording that states none."""
        found = {name: find_unit(column.unit, name) for name, column in self.scales.items()}
        return {name: unit for name, unit in found.items() if unit is not None}

    def require_plain_clock(self, where: str, line: int | None = None) -> None:
        """Raises RecordingError where times that are clock times have a scale."""
        column = self.scales.get("time")
        if column and (column.unit, column.factor, column.sign, column.offset) != ("", 1.0, 1.0, 0.0):
            problem = f"has clock times in {format_value(column.name)}, and {place_of(column)} has a scale"
            raise RecordingError(where, problem, "write the name alone", line)

    def without_time(self) -> ColumnMap:
        """The map of a recording whose times are not a column."""
        return ColumnMap(self.cable_count, tuple(column for column in self.declared if column.column != "time"))

    def in_words(self) -> str:
        """What is declared, in one line; blank where nothing is."""
        groups = groupby(self.declared, key=lambda column: (_kind(column.column), _scale_in_words(column)))
        parts = [_columns_in_words(list(columns), scale) for (_, scale), columns in groups]
        return f"columns by {self.declared[0].file or 'the map'}: {', '.join(parts)}" if parts else ""


def column_map(declared: Sequence[RecordedColumn], cable_count: int) -> ColumnMap:
    """The columns that are read of a recording; raises RobotFileError where a declared unit is not of its quantity."""
    for error in unit_errors(declared):
        raise error
    return ColumnMap(cable_count, tuple(declared))


def unit_errors(declared: Sequence[RecordedColumn]) -> Iterator[RobotFileError]:
    """Errors of declared units that are not known, or of another quantity."""
    for column in declared:
        standard_name = column.column.replace("{}", "1")
        if column.unit and find_unit(column.unit, standard_name) is None:
            quantity = quantity_of(standard_name)
            problem = f"is {format_value(column.unit)}, not a known unit of {quantity}"
            hint = f"write one of {', '.join(unit.symbol for unit in UNITS[quantity])}, or a factor in its place"
            key_path = (*column.table.split("."), column.column, "unit")
            yield RobotFileError(place_of(column, "unit"), problem, hint, key_path)


def place_of(column: RecordedColumn, key: str = "") -> str:
    """The file and key where a column is declared."""
    path = f"{column.table}.{column.column}" + (f".{key}" if key else "")
    return f"{column.file}: {path}" if column.file else path


def _kind(column: str) -> str:
    return "axis" if column in AXES else column.rpartition("_")[0] or column


def _columns_in_words(columns: Sequence[RecordedColumn], scale: str) -> str:
    """Columns of one kind and scale, as in "tension_1 to tension_4 are 'F1' to 'F4' in kN"."""
    first, last = columns[0], columns[-1]
    if len(columns) == 1:
        return f"{first.column} is {format_value(first.name)}{scale}"
    names = f"{format_value(first.name)} to {format_value(last.name)}"
    return f"{first.column} to {last.column} are {names}{scale}"


def _scale_in_words(column: RecordedColumn) -> str:
    parts = [f" in {column.unit}"] if column.unit else []
    parts += [f" times {column.factor:g}"] if column.factor != 1.0 else []
    parts += [" with its sign changed"] if column.sign < 0.0 else []
    parts += [f" from {column.offset:g}"] if column.offset else []
    return "".join(parts)
