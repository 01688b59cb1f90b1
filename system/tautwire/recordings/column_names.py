"""Names of the columns in a recording of any format, and the words that tell what each measures."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import repeat
from pathlib import Path

from ..errors import RecordingError, format_value
from ..input_files import read_encoded_text
from ..robot.schema import AXES
from .csv_lines import split_cells, unit_in_name, without_comment_mark
from .csv_names import NamesLine, first_samples, names_above
from .mat_file import is_mat, mat_column_names
from .mdf_file import is_mdf
from .parquet_file import is_parquet, parquet_column_names
from .recording_table import is_column_name
from .ros_bag import bag_columns, is_bag
from .ros_column_words import column_words
from .units import is_any_unit

MAX_CSV_SIZE = 2**31  # bytes
MAX_HEAD_LINES = 500

_FORCE_ALONG = re.compile(r"((?:.*[/._])?force[/._])([xyz])")


@dataclass(frozen=True)
class ColumnName:
    """The ``name`` of a recorded column, its ``standard_name`` where it is read without a declaration, and its words.

    ``words`` tell what it measures, by default the name.
    """

    name: str
    standard_name: str | None
    words: str


def column_names(path: Path) -> list[ColumnName]:
    """The names of a recording's columns.

    Of CSV in any dialect, Parquet, MATLAB or a ROS bag; raises RecordingError where there are none.
    """
    if is_bag(path):
        own = [ColumnName(column.name, None, column_words(column)) for column in bag_columns(path)]
        return [ColumnName("time", "time", "time"), *own]
    if is_mat(path):
        return [ColumnName(name, standard, name) for name, standard in mat_column_names(path).items()]
    if is_parquet(path):
        names = parquet_column_names(path)
        return [_named(name, "", names) for name in names]
    layout = csv_layout(path)
    return [
        _named(name, unit, layout.names) for name, unit in zip(layout.names, layout.units or repeat(""), strict=False)
    ]


def _named(name: str, unit: str, names: Collection[str]) -> ColumnName:
    """A column by its name; a unit from elsewhere in the file counts as if it stood behind the name.

    A force along one axis alone, as of a wrench whose other numbers were not exported, is a tension.
    """
    along, words = _FORCE_ALONG.fullmatch(name), name
    if along and not any(along[1] + axis in names for axis in AXES if axis != along[2]):
        words = along[1]
    if unit and not unit_in_name(name):
        words = f"{words} [{unit}]"
    return ColumnName(name, name if is_column_name(name) else None, words)


@dataclass(frozen=True)
class CsvLayout:
    """A CSV file by its numbers: the ``names`` above them, and the ``lines``, samples from ``data_index`` on.

    ``units`` are the cells of the line that states them, one for each name; empty without such a line.
    """

    names: tuple[str, ...]
    separator: str
    data_index: int
    lines: list[str]
    units: tuple[str, ...] = ()


def csv_layout(path: Path) -> CsvLayout:
    """The names and the samples of a CSV file in any dialect; raises RecordingError where there are none."""
    if is_mdf(path):
        hint = "export it as CSV, or write the names of its channels into the table"
        raise RecordingError(str(path), "is MDF, of which no columns are proposed", hint)
    content, _ = read_encoded_text(path, RecordingError, "CSV", MAX_CSV_SIZE)
    lines = content.decode("utf-8").splitlines()
    for sample in first_samples(lines[:MAX_HEAD_LINES]):
        named = names_above(lines, sample)
        if named is not None:
            _require_unique(named, path)
            units = _units_above(lines[: sample.index], sample.separator, named)
            return CsvLayout(named.names, sample.separator, sample.index, lines, units)
    hint = "begin with a line that names the columns, and samples below it"
    raise RecordingError(str(path), "has no line of names above numbers", hint)


def _require_unique(named: NamesLine, path: Path) -> None:
    """Raises RecordingError where a standard name repeats, which no number makes another."""
    for name in named.names:
        count = named.names.count(name)
        if name and count > 1:
            where = f"{path}: line {named.index + 1}"
            problem = f"the column {format_value(name)} appears {count} times"
            raise RecordingError(where, problem, "keep one of them", named.index + 1)


def _units_above(lines: Sequence[str], separator: str, named: NamesLine) -> tuple[str, ...]:
    """The cells of the line, other than that of the names, that has known units."""
    rows = (
        tuple(split_cells(without_comment_mark(line), separator))
        for index, line in enumerate(lines)
        if index != named.index
    )
    return next((row for row in rows if len(row) == len(named.names) and any(map(is_any_unit, row))), ())
