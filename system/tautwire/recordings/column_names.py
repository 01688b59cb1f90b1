"""Names of the columns in a recording of any format, and the words that tell what each measures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import repeat
from pathlib import Path

from ..errors import RecordingError
from ..input_files import read_encoded_text
from .clock_time import clock_format
from .csv_lines import SEPARATORS, is_comment, is_number, split_cells, unit_in_name, without_comment_mark
from .mat_file import is_mat, mat_column_names
from .mdf_file import is_mdf
from .parquet_file import is_parquet, parquet_column_names
from .recording_table import MISSING_CELLS, is_column_name
from .ros_bag import bag_columns, is_bag
from .ros_column_words import column_words
from .units import is_any_unit

MAX_CSV_SIZE = 2**31  # bytes
MAX_HEAD_LINES = 500


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
        return [_named(name) for name in parquet_column_names(path)]
    layout = csv_layout(path)
    return [_named(name, unit) for name, unit in zip(layout.names, layout.units or repeat(""), strict=False)]


def _named(name: str, unit: str = "") -> ColumnName:
    """A column by its name; a unit from elsewhere in the file counts as if it stood behind the name."""
    words = f"{name} [{unit}]" if unit and not unit_in_name(name) else name
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
    for index, line in enumerate(lines[:MAX_HEAD_LINES]):
        if is_comment(line) or not line.strip():
            continue
        for separator in SEPARATORS:
            cells = split_cells(line, separator)
            if len(cells) > 1 and cells[0] and all(map(_is_sample, cells)):
                names = _names_above(lines[:index], separator, len(cells))
                if names:
                    return CsvLayout(names, separator, index, lines, _units_above(lines[:index], separator, names))
    hint = "begin with a line that names the columns, and samples below it"
    raise RecordingError(str(path), "has no line of names above numbers", hint)


def _is_sample(cell: str) -> bool:
    return is_number(cell) or cell in MISSING_CELLS or clock_format(cell) is not None


def _names_above(lines: Sequence[str], separator: str, count: int) -> tuple[str, ...]:
    """The cells of the first line with as many as the samples have."""
    for line in lines:
        cells = split_cells(without_comment_mark(line) if is_comment(line) else line, separator)
        if len(cells) == count and len(set(cells)) == count and not all(map(is_number, cells)):
            return tuple(cells)
    return ()


def _units_above(lines: Sequence[str], separator: str, names: Sequence[str]) -> tuple[str, ...]:
    """The cells of the line, other than that of the names, that has known units."""
    rows = (tuple(split_cells(without_comment_mark(line), separator)) for line in lines)
    full_rows = (row for row in rows if len(row) == len(names) and row != names)
    return next((row for row in full_rows if any(map(is_any_unit, row))), ())
