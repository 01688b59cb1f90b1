"""Names of a CSV file's columns above its samples, made unique where a line repeats some, as trackers write it."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass
from io import StringIO
from itertools import pairwise

from .clock_time import clock_format
from .csv_lines import SEPARATORS, is_comment, is_number, split_cells, without_comment_mark
from .recording_table import MISSING_CELLS, is_column_name
from .units import is_any_unit


@dataclass(frozen=True)
class FirstSample:
    """The first line of samples: its ``index`` from 0, its separator, and how many cells it has."""

    index: int
    separator: str
    count: int


@dataclass(frozen=True)
class NamesLine:
    """The line that names the columns: its ``index`` from 0, and the names, made unique."""

    index: int
    names: tuple[str, ...]


def first_samples(lines: Sequence[str]) -> Iterator[FirstSample]:
    """Lines that may be the first of samples, numbers of two or more columns, by each separator that makes them so.

    Where every line has a text, as in a column of states, those whose numbers are in the same columns as in the next.
    """
    rows = [(index, line) for index, line in enumerate(lines) if line.strip() and not is_comment(line)]
    of_numbers = _samples_of_numbers(rows)
    first = next(of_numbers, None)
    if first is None:
        yield from _samples_beside_text(rows)
    else:
        yield first
        yield from of_numbers


def _samples_of_numbers(rows: Sequence[tuple[int, str]]) -> Iterator[FirstSample]:
    for index, line in rows:
        for separator in SEPARATORS:
            cells = split_cells(line, separator)
            if len(cells) > 1 and cells[0] and all(map(_is_sample, cells)):
                yield FirstSample(index, separator, len(cells))


def _samples_beside_text(rows: Sequence[tuple[int, str]]) -> Iterator[FirstSample]:
    for (index, line), (_, next_line) in pairwise(rows):
        for separator in SEPARATORS:
            cells = split_cells(line, separator)
            if len(cells) < 2 or not cells[0]:
                continue
            are_samples = list(map(_is_sample, cells))
            if sum(are_samples) > 1 and list(map(_is_sample, split_cells(next_line, separator))) == are_samples:
                yield FirstSample(index, separator, len(cells))


def _is_sample(cell: str) -> bool:
    return is_number(cell) or cell in MISSING_CELLS or clock_format(cell) is not None


def names_above(lines: Sequence[str], sample: FirstSample, declared: Container[str] = ()) -> NamesLine | None:
    """The line of names above samples: the first that names each column once, or else the last, made unique.

    Names that repeat are joined to those in lines above, as ``RB1_Position_X``, as far as these tell columns apart, and
    what still repeats to the number of its column, as ``X_4``: not a standard name, nor one that is ``declared``. None
    without a line of as many cells as the samples have.
    """
    rows = [_cells(line, sample.separator) for line in lines[: sample.index]]
    full = [index for index, row in enumerate(rows) if _names_columns(row, sample.count)]
    for index in full:
        if len(set(rows[index])) == sample.count:
            return NamesLine(index, tuple(rows[index]))
    if not full:
        return None
    last = next((index for index in reversed(full) if not any(map(is_any_unit, rows[index]))), full[-1])
    names, telling = rows[last], list[list[str]]()
    for row in rows[:last]:
        candidate = [*telling, _spread(row, sample.count)]
        joined = ["_".join(filter(None, cells)) for cells in zip(*candidate, rows[last], strict=True)]
        if len(set(joined)) > len(set(names)):
            names, telling = joined, candidate
    return NamesLine(last, tuple(_numbered(names, declared)))


def with_unique_names(lines: Sequence[str], declared: Container[str]) -> tuple[list[str], int | None]:
    """The lines of a file's head, with unique names in the line that repeats some, and its index; None without one."""
    texts = list(lines)
    for sample in first_samples(texts):
        named = names_above(texts, sample, declared)
        if named is None:
            continue
        if list(named.names) == _cells(texts[named.index], sample.separator):
            break
        mark = "# " if is_comment(texts[named.index]) else ""
        texts[named.index] = mark + _line(named.names, sample.separator)
        return texts, named.index
    return texts, None


def _cells(line: str, separator: str) -> list[str]:
    return split_cells(without_comment_mark(line) if is_comment(line) else line, separator)


def _names_columns(cells: Sequence[str], count: int) -> bool:
    """Whether a line has a cell for each column, and these are not all numbers."""
    return len(cells) == count and any(cells) and not all(map(is_number, cells))


def _spread(cells: Sequence[str], count: int) -> list[str]:
    """Cells above the names, an empty one as that on its left; empty where the line is no row of the table."""
    is_row = len(cells) == count or (0 < len(cells) < count and not cells[0])
    spread: list[str] = []
    for cell in [*cells, *[""] * (count - len(cells))] if is_row else [""] * count:
        spread.append(cell or (spread[-1] if spread else ""))
    return spread


def _numbered(names: Sequence[str], declared: Container[str]) -> list[str]:
    """Names with the number of the column from 1 behind those that repeat."""
    counts = Counter(names)
    unique = [
        f"{name}_{number}" if name and counts[name] > 1 and name not in declared and not is_column_name(name) else name
        for number, name in enumerate(names, 1)
    ]
    # A numbered name may be one that another column has.
    is_taken = any(new != old and new in names for new, old in zip(unique, names, strict=True))
    return list(names) if is_taken else unique


def _line(names: Sequence[str], separator: str) -> str:
    if separator == " ":
        return " ".join(names)
    row = StringIO()
    csv.writer(row, delimiter=separator, lineterminator="").writerow(names)
    return row.getvalue()
