"""The header of a recording in CSV: the line that names its columns, their units, and where the samples begin."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from io import BytesIO, TextIOWrapper
from itertools import islice

from ..errors import RecordingError
from .clock_time import clock_format
from .column_map import ColumnMap
from .csv_lines import (
    SEPARATORS,
    count_units,
    is_comment,
    is_number,
    split_cells,
    split_unit,
    units_in_line,
    without_comment_mark,
)
from .csv_names import first_samples, names_above, with_unique_names
from .recording_table import MAX_COLUMNS
from .table_shape import require_upright
from .units import Unit, find_unit

# Of each separator that makes numbers of the first lines.
MAX_FIRST_SAMPLES = 8


@dataclass(frozen=True)
class CsvHeader:
    """The header: the ``index`` from 0 of its line, the separator, and how many of the ``known`` columns it names.

    ``names`` are its cells without their units, ``units`` those that are stated of known columns; the first sample is
    in the line ``data_index``. ``is_certain`` where it names ``time`` and another column, ``is_standard`` where it is
    the first line, and nothing stands between it and the samples.
    """

    index: int
    separator: str
    known: frozenset[str]
    known_count: int
    is_comment: bool
    is_certain: bool
    names: tuple[str, ...] = ()
    units: Mapping[str, Unit] = field(default_factory=dict)
    data_index: int = 0
    has_text_above: bool = False
    has_clock: bool = False
    is_standard: bool = False


def as_text(content: bytes, start: int = 0) -> TextIOWrapper:
    """The lines of a CSV file from a byte on, as the csv module wants them."""
    stream = BytesIO(content)
    stream.seek(start)
    return TextIOWrapper(stream, encoding="utf-8", newline="")


def read_header(content: bytes, lines: Sequence[bytes], columns: ColumnMap, file: str) -> CsvHeader:
    """Read the header in the first lines of a file; raises RecordingError where it, or a unit in it, is not clear."""
    texts = [line.decode("utf-8").rstrip("\r\n") for line in lines]
    texts, renamed_index = with_unique_names(texts, columns.standard_names)
    header = _find_header(texts, columns.standard_names, file)
    if header.index == renamed_index:
        cells, height = _cells_of_line(texts[header.index], header), 1
    else:
        cells, height = _header_cells(content, sum(map(len, lines[: header.index])), texts[header.index], header, file)
    known = columns.standard_names
    recorded, cell_units = zip(*(_name_and_unit(cell, cells, known) for cell in cells or [""]), strict=True)
    names = columns.renamed(recorded, f"{file}: line {header.index + 1}", header.index + 1)
    header = replace(header, names=names, has_text_above=any(map(_is_text, texts[: header.index])))
    if header.is_certain:
        _require_no_table_above(texts, header, file)
    else:
        require_upright(texts, known, file)
    units_index, data_index = _units_and_data(texts, header.index + height, header)
    _require_no_other_units(texts, range(header.index + height, data_index), units_index, header, file)
    first_row = texts[data_index] if data_index < len(texts) else ""
    header = replace(header, has_clock=_has_clock(first_row, header))
    where = f"{file}: line {header.index + 1}"
    if header.has_clock:
        columns.require_plain_clock(where, header.index + 1)
    units = _units(header, [(header.index, unit) for unit in cell_units], columns, file)
    if units_index is not None:
        units = _with_units_below(units, texts[units_index], units_index, header, columns, file)
    units = columns.units(units, where, header.index + 1)
    is_standard = header.index == 0 and not header.is_comment and data_index == height
    return replace(header, units=units, data_index=data_index, is_standard=is_standard)


def _name_and_unit(cell: str, cells: Sequence[str], known: Mapping[str, str]) -> tuple[str, str]:
    """Name and unit in a cell; beside ``x``, ``x (raw)`` is the name of another column."""
    name, unit = split_unit(cell, known)
    is_other_column = name != cell and name in cells and find_unit(unit, known[name]) is None
    return (cell, "") if is_other_column else (name, unit)


def _is_text(line: str) -> bool:
    return bool(line.strip()) and not is_comment(line)


def _find_header(lines: Sequence[str], known: Mapping[str, str], file: str) -> CsvHeader:
    """Find the line that names ``time`` and most of the other known columns, or else the one comment that does.

    Where there is none, it is the line that names most of the known columns, not certain to be a header.
    """
    sampled = {sample.separator: sample.count for sample in islice(first_samples(lines), MAX_FIRST_SAMPLES)}
    rows = [(index, line) for index, line in enumerate(lines) if line.strip()]
    named = [_as_header(index, line, known, sampled) for index, line in rows if _may_name_time(line, known)]
    certain = [header for header in named if header.is_certain and not header.is_comment]
    if certain:
        return max(certain, key=lambda header: header.known_count)
    comments = [header for header in named if header.is_certain]
    if len(comments) > 1:
        problem = f"names the columns, and so does line {comments[1].index + 1}"
        raise RecordingError(f"{file}: line {comments[0].index + 1}", problem, "keep one of the two")
    if not rows:
        raise RecordingError(file, f"has {len(lines)} blank lines and no header", "begin with the names of the columns")
    if comments:
        return comments[0]
    guesses = [_as_header(index, line, known, sampled) for index, line in rows]
    samples = islice(first_samples(lines), 1)
    above = [names.index for sample in samples if (names := names_above(lines, sample, known))]
    # As ROS writes it, names above samples may stand behind the mark of a comment.
    return max(
        guesses, key=lambda each: (not each.is_comment or each.index in above, each.known_count, each.index in above)
    )


def _may_name_time(line: str, known: Mapping[str, str]) -> bool:
    """Whether a cell of a line may be ``time``: its characters are there, but for quotation marks and spaces."""
    text = _bare(line)
    return any(_bare(name) in text for name, standard in known.items() if standard == "time")


def _bare(text: str) -> str:
    return "".join(text.split()).replace('"', "")


def _as_header(index: int, line: str, known: Mapping[str, str], sampled: Mapping[str, int]) -> CsvHeader:
    """A line as a header, with the separator by which it names most of the known columns.

    Without ``time`` the separator is that by which it has as many cells as the samples, ``sampled`` by separator.
    """
    commented = is_comment(line)
    text = without_comment_mark(line) if commented else line
    standard = frozenset(known.values())
    best, most = CsvHeader(index, ",", standard, 0, commented, False), (-1, -1, 0)
    for separator in SEPARATORS:
        cells = split_cells(text, separator)
        recorded = {split_unit(cell, known)[0] for cell in cells[:MAX_COLUMNS]}
        names = {known[name] for name in recorded & known.keys()}
        # Of a line that names nothing known, most cells tell the separator; every sentence has spaces.
        fits_samples = "time" in names or sampled.get(separator) == len(cells)
        rank = (int(fits_samples), len(names), len(cells) if not names and separator != " " else 0)
        if rank > most:
            is_certain = "time" in names and len(names) > 1
            best, most = CsvHeader(index, separator, standard, len(names), commented, is_certain), rank
    return best


def _header_cells(content: bytes, start: int, line: str, header: CsvHeader, file: str) -> tuple[list[str], int]:
    """Cells of the header, and how many lines it has: a name in quotation marks may hold line ends."""
    if header.is_comment or header.separator == " ":
        return _cells_of_line(line, header), 1
    rows = csv.reader(as_text(content, start), delimiter=header.separator, skipinitialspace=True)
    try:
        return [cell.strip() for cell in next(rows)], rows.line_num
    except csv.Error as problem:
        where = f"{file}: line {header.index + 1}"
        raise RecordingError(where, f"is not valid CSV ({problem})", "write a header line") from problem


def _cells_of_line(line: str, header: CsvHeader) -> list[str]:
    return split_cells(without_comment_mark(line) if header.is_comment else line, header.separator)


def _units_and_data(lines: Sequence[str], first: int, header: CsvHeader) -> tuple[int | None, int]:
    """Indices of the line of units below the header, None without one, and of the first sample."""
    units_index = None
    for index in range(first, len(lines)):
        line = lines[index]
        is_awaited = header.is_certain and units_index is None
        if is_awaited and units_in_line(line, header.separator, header.names, header.known):
            units_index = index
        elif _is_text(line) or _is_labelled_sample(line, header):
            return units_index, index
    return units_index, len(lines)


def _is_labelled_sample(line: str, header: CsvHeader) -> bool:
    """Whether a line that looks like a comment is a sample: where the first column is not read, it may hold labels."""
    is_label = header.names[0] not in header.known
    return is_label and len(split_cells(line, header.separator)) == len(header.names)


def _units(header: CsvHeader, stated: Sequence[tuple[int, str]], columns: ColumnMap, file: str) -> dict[str, Unit]:
    """Units of known columns; ``stated`` are the index of the line and the text of each column's, blank without one.

    What stands beside the name of clock times says how they are written.
    """
    units = {
        name: columns.stated_unit(name, text, f"{file}: line {index + 1}, column {name}", index + 1)
        for name, (index, text) in zip(header.names, stated, strict=True)
        if name in header.known and text and not (name == "time" and header.has_clock)
    }
    return {name: unit for name, unit in units.items() if unit is not None}


def _with_units_below(
    units: dict[str, Unit], line: str, index: int, header: CsvHeader, columns: ColumnMap, file: str
) -> dict[str, Unit]:
    """Units beside the names, and those in the line of units, in which every known column has to have one."""
    texts = units_in_line(line, header.separator, header.names, header.known)
    below = _units(header, [(index, text or " ") for text in texts], columns, file)
    for name in units.keys() & below.keys():
        if units[name] != below[name]:
            problem = f"is in {below[name].symbol} here and in {units[name].symbol} in the header"
            where = f"{file}: line {index + 1}, column {name}"
            raise RecordingError(where, problem, "remove the wrong one", index + 1)
    return units | below


def _has_clock(first_row: str, header: CsvHeader) -> bool:
    """Whether the first time is a clock time; below a header that is a comment the separator may be another."""
    rows = (dict(zip(header.names, split_cells(first_row, separator), strict=False)) for separator in SEPARATORS)
    return any(clock_format(row.get("time", "")) is not None for row in rows)


def _require_no_table_above(lines: Sequence[str], header: CsvHeader, file: str) -> None:
    """Raises RecordingError where a line above the header holds numbers or units of all columns."""
    for index, line in enumerate(lines[: header.index]):
        cells = split_cells(line, header.separator)
        kind = "numbers" if len(cells) == len(header.names) and all(map(is_number, cells)) else ""
        units = units_in_line(line, header.separator, header.names, header.known)
        known_units = [find_unit(u, name) for name, u in zip(header.names, units, strict=False) if name in header.known]
        if known_units and all(known_units):
            kind = "units"
        if kind:
            problem = f"has {kind} of all columns, and the columns are named below, in line {header.index + 1}"
            raise RecordingError(f"{file}: line {index + 1}", problem, f"write {kind} below the header", index + 1)


def _require_no_other_units(
    lines: Sequence[str], between: range, units_index: int | None, header: CsvHeader, file: str
) -> None:
    """Raises RecordingError where a comment between header and samples has units, but not one for each column."""
    for index in between:
        count = count_units(lines[index]) if is_comment(lines[index]) and index != units_index else 0
        if count and header.is_certain:
            problem = f"has {count} units, the header has {len(header.names)} columns"
            hint = "write a unit for each column, or remove the line"
            raise RecordingError(f"{file}: line {index + 1}", problem, hint, index + 1)
