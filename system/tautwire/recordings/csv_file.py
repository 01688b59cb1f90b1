"""Recordings in CSV files: one header line, then one line per sample."""

import csv
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from io import BytesIO, TextIOWrapper
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd  # type: ignore[import-untyped,unused-ignore]
from numpy.typing import NDArray

from ..errors import RecordingError, format_value, raise_error
from ..input_files import read_text_bytes
from .recording_table import MISSING_CELLS, ErrorSink, Header, Row, parse_header

MAX_FILE_SIZE = 2**31  # bytes; it is held in memory

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
_NUMBER = re.compile(r"[-+]?[0-9]*[.,]?[0-9]+([eE][-+]?[0-9]+)?")


@dataclass(frozen=True)
class CsvTable:
    """A CSV file in memory, its header read."""

    file: str
    content: bytes
    header: Header

    def numbers(self) -> Mapping[str, NDArray[np.float64]] | None:
        """The known columns, each (N,), NaN where a cell is missing; None where this is not a table of numbers."""
        header, content = self.header, self.content
        # Where the first row has more cells than the header, pandas would take some for an index.
        if not self._is_rectangular(row_count=1):
            return None
        try:
            frame = pd.read_csv(
                BytesIO(content),
                header=0,
                names=list(header.names),
                dtype={name: str if name in header.unknown_names else np.float64 for name in header.names},
                encoding="utf-8",
                skipinitialspace=True,
                keep_default_na=False,
                na_values=list(MISSING_CELLS),
                **_exact_float_options(),
            )
        except (ValueError, OverflowError):
            return None
        return (
            {name: frame[name].to_numpy() for name in header.known_names} if self._is_rectangular(len(frame)) else None
        )

    def rows(self) -> Iterator[Row]:
        """Rows below the header that are not blank, each with the file and the line on which it begins."""
        rows = csv.reader(_as_text(self.content), skipinitialspace=True, strict=True)
        first_line = 1
        try:
            next(rows)
            first_line = rows.line_num + 1
            for row in rows:
                if len(row) > 1 or "".join(row).strip():
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
            return self.content.count(b",") == (row_count + 1) * (width - 1)
        try:
            rows = csv.reader(_as_text(self.content), skipinitialspace=True)
            data_rows = (row for row in rows if len(row) > 1 or "".join(row).strip())
            return all(len(row) == width for row in islice(data_rows, row_count + 1))
        except csv.Error:
            return False


def open_csv(path: str | Path, cable_count: int, sink: ErrorSink = raise_error) -> CsvTable:
    """Open the CSV file of a recording; raises RecordingError where it is not text or has no valid header.

    Errors in the columns of the header go to the ``sink``.
    """
    file = str(path)
    content = read_text_bytes(path, RecordingError, "CSV", MAX_FILE_SIZE)
    content = content.removeprefix(_BYTE_ORDER_MARK)
    cells = _first_row(content, file)
    where = f"{file}: line 1"
    _require_header(cells, where)
    return CsvTable(file, content, parse_header(cells, where, cable_count, sink, line=1))


def _exact_float_options() -> dict[str, Any]:
    """Options by which pandas parses floats as Python does; from 3.1 on the default, the option deprecated."""
    version = tuple(int(part) for part in pd.__version__.split(".")[:2])
    return {} if version >= (3, 1) else {"float_precision": "round_trip"}


def _as_text(content: bytes) -> TextIOWrapper:
    """The lines of a CSV file, as the csv module wants them."""
    return TextIOWrapper(BytesIO(content), encoding="utf-8", newline="")


def _first_row(content: bytes, file: str) -> list[str]:
    if not content.strip():
        raise RecordingError(file, "is empty", "write a header line and two or more samples")
    try:
        return [cell.strip() for cell in next(csv.reader(_as_text(content), skipinitialspace=True))]
    except csv.Error as problem:
        raise RecordingError(f"{file}: line 1", f"is not valid CSV ({problem})", "write a header line") from problem


def _require_header(cells: list[str], where: str) -> None:
    if not any(cells):
        raise RecordingError(where, "is blank, the header is missing", "begin with the names of the columns")
    for separator, name in ((";", "semicolons"), ("\t", "tabs")):
        if "time" not in cells and any(separator in cell for cell in cells):
            hint = "separate them with commas, and write numbers with a decimal point"
            raise RecordingError(where, f"the columns are separated with {name}", hint)
    if all(_NUMBER.fullmatch(cell) for cell in cells):
        hint = "begin with a line that names the columns, as in time,winch_speed_1"
        raise RecordingError(where, f"has numbers ({format_value(cells[0])}), so the header is missing", hint)
