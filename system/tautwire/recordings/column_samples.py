"""Recorded numbers by the laboratory's names, as they are written, for proposals that go by values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path

import numpy as np
import pandas as pd  # type: ignore[import-untyped,unused-ignore]
from numpy.typing import NDArray

from .clock_time import ClockFormat, clock_format
from .column_names import CsvLayout, csv_layout
from .mat_file import is_mat, mat_samples
from .parquet_file import is_parquet, parquet_samples
from .recording_table import MISSING_CELLS
from .ros_bag import is_bag

Array = NDArray[np.float64]

# Samples at the beginning of a CSV file, minutes of any drive's log.
MAX_CSV_ROWS = 200_000


@dataclass(frozen=True, eq=False)
class ColumnSamples:
    """Samples of columns by name in the file's order, each (N,), NaN where a cell holds no number.

    ``units`` by name are what a line of the file states; columns of ``clocks`` were clock times, and are in s.
    """

    values: Mapping[str, Array] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    clocks: frozenset[str] = frozenset()


def column_samples(path: Path) -> ColumnSamples:
    """The samples of a recording's columns; none of a ROS bag, whose types and names tell what is what.

    Raises RecordingError where ``column_names`` does.
    """
    if is_bag(path):
        return ColumnSamples()
    if is_mat(path):
        return ColumnSamples(mat_samples(path))
    return ColumnSamples(parquet_samples(path)) if is_parquet(path) else _csv_samples(path)


def _csv_samples(path: Path) -> ColumnSamples:
    """The samples of a CSV file; none where these are not valid CSV, which reading it tells."""
    layout = csv_layout(path)
    try:
        frame = _frame(layout)
    except (ValueError, OverflowError):
        return ColumnSamples()
    columns = {name: frame[index] for name, index in zip(layout.names, frame, strict=True)}
    clocks = {name: clock_format(str(cells.iloc[0])) for name, cells in columns.items() if len(cells)}
    values = {name: _numbers(cells, clocks.get(name)) for name, cells in columns.items()}
    of_clock = frozenset(name for name, clock in clocks.items() if clock is not None)
    return ColumnSamples(values, dict(zip(layout.names, layout.units, strict=False)), of_clock)


def _numbers(cells: pd.Series, clock: ClockFormat | None) -> Array:
    """The numbers of a column, NaN where a cell holds none; clock times in seconds from the first."""
    if clock is not None:
        return np.array([clock.seconds(str(cell)) for cell in cells])
    return np.asarray(pd.to_numeric(cells, errors="coerce").to_numpy(dtype=float))


def _frame(layout: CsvLayout) -> pd.DataFrame:
    """The first samples, the columns by their index."""
    rows = layout.lines[layout.data_index : layout.data_index + MAX_CSV_ROWS]
    # Between other separators a comma is a decimal one.
    is_comma_decimal = layout.separator != "," and any("," in row for row in rows)
    return pd.read_csv(
        StringIO("\n".join(rows)),
        header=None,
        names=range(len(layout.names)),
        index_col=False,
        usecols=range(len(layout.names)),
        sep=r"\s+" if layout.separator == " " else layout.separator,
        decimal="," if is_comma_decimal else ".",
        comment="#",
        skipinitialspace=True,
        keep_default_na=False,
        na_values=list(MISSING_CELLS),
        on_bad_lines="skip",
        low_memory=False,
    )
