"""Recordings in CSV files: one header line, then one line per sample."""

import csv
import re
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd  # type: ignore[import-untyped,unused-ignore]
from numpy.typing import NDArray

from ..errors import RecordingError, format_value, raise_error
from .column_map import ColumnMap
from .csv_dialect import read_csv_text
from .csv_header import as_text
from .csv_lines import is_number
from .recording_table import MISSING_CELLS, ErrorSink, Header, Row, parse_header

MAX_FILE_SIZE = 2**31  # bytes; it is held in memory


@dataclass(frozen=True)
class CsvTable:
    """A CSV file in memory, its header read."""

    file: str
    content: bytes
    header: Header
    separator: str = ","

    def numbers(self) -> Mapping[str, NDArray[np.float64]] | None:
        """The known columns, each (N,), NaN where a cell is missing; None where this is not a table of numbers."""
        # Where the first row has more cells than the header, pandas would take some for an index.
        if not self._is_rectangular(row_count=1):
            return None
        frame = self._frame(self.content)
        if frame is None and b" " in self.content:
            frame = self._frame(re.sub(rb" +(?=[\r\n" + re.escape(self.separator.encode()) + rb"])", b"", self.content))
        if frame is None:
            return None
        if not self._is_rectangular(len(frame)):
            return None
        return {name: self._column(name, frame[name]) for name in self.header.known_names}

    def _frame(self, content: bytes) -> pd.DataFrame | None:
        """The table by pandas, which knows a missing cell only without spaces; None where a cell is no number."""
        try:
            return pd.read_csv(
                BytesIO(content),
                header=0,
                sep=self.separator,
                decimal=self.header.decimal_mark,
                names=list(self.header.names),
                dtype={name: str if name in self._texts() else np.float64 for name in self.header.names},
                encoding="utf-8",
                skipinitialspace=True,
                keep_default_na=False,
                na_values=list(MISSING_CELLS),
                **_exact_float_options(),
            )
        except (ValueError, OverflowError):
            return None

    def _texts(self) -> Container[str]:
        """Columns that pandas does not parse."""
        return (*self.header.unknown_names, *(("time",) if self.header.clock else ()))

    def _column(self, name: str, cells: pd.Series) -> NDArray[np.float64]:
        """A known column in SI units."""
        clock = self.header.clock
        if name == "time" and clock is not None:
            return np.array([clock.seconds(str(cell)) for cell in cells])
        numbers: NDArray[np.float64] = cells.to_numpy()
        return self.header.to_si(name, numbers)

    def rows(self) -> Iterator[Row]:
        """Rows below the header that are not blank, each with the file and the line on which it begins."""
        rows = csv.reader(as_text(self.content), delimiter=self.separator, skipinitialspace=True, strict=True)
        first_line, is_below_header = 1, False
        try:
            for row in rows:
                if not is_below_header:
                    is_below_header = any(row)
                elif len(row) > 1 or "".join(row).strip():
                    yield Row(f"{self.file}: line {first_line}", first_line, row)
                first_line = rows.line_num + 1
        except csv.Error as problem:
            hint = "check the quotation marks from this line on"
            raise RecordingError(
                f"{self.file}: line {first_line}", f"is not valid CSV ({problem})", hint, first_line
            ) from problem

    def _is_rectangular(self, row_count: int) -> bool:
        """Whether the first rows are as wide as the header; pandas pads short ones silently."""
        width = len(self.header.names)
        if row_count > 1 and b'"' not in self.content:
            return self.content.count(self.separator.encode()) == (row_count + 1) * (width - 1)
        try:
            rows = csv.reader(as_text(self.content), delimiter=self.separator, skipinitialspace=True)
            data_rows = (row for row in rows if len(row) > 1 or "".join(row).strip())
            return all(len(row) == width for row in islice(data_rows, row_count + 1))
        except csv.Error:
            return False


def open_csv(path: str | Path, columns: ColumnMap, sink: ErrorSink = raise_error) -> CsvTable:
    """Open the CSV file of a recording; raises RecordingError where it is not text or has no valid header.

    Errors in the columns of the header go to the ``sink``.
    """
    file = str(path)
    text = read_csv_text(file, MAX_FILE_SIZE, columns)
    where = f"{file}: line {text.header_line}"
    _require_header(text.header.names, where)
    header = parse_header(text.header.names, where, columns.cable_count, sink, line=text.header_line)
    header = replace(text.header, names=header.names, unknown_names=header.unknown_names)
    return CsvTable(file, text.content, header, text.separator)


def _exact_float_options() -> dict[str, Any]:
    """Options by which pandas parses floats as Python does; from 3.1 on the default, the option deprecated."""
    version = tuple(int(part) for part in pd.__version__.split(".")[:2])
    return {} if version >= (3, 1) else {"float_precision": "round_trip"}


def _require_header(cells: Sequence[str], where: str) -> None:
    if any(cells) and all(map(is_number, cells)):
        hint = "begin with a line that names the columns, as in time,winch_speed_1"
        raise RecordingError(where, f"has numbers ({format_value(cells[0])}), so the header is missing", hint)
