"""Samples of several ROS topics on common rows: those of the winch speeds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError, format_value
from ..name_suggestions import join_names
from ..robot.schema import QUATERNION_COLUMNS
from .quaternion_columns import with_continuous_signs
from .winch_gaps import interpolated_at

_INPUTS = ("winch_speed_", "rope_length_")
_NANOSECONDS = 1e9  # in a second


@dataclass(frozen=True)
class SampledNumber:
    """Samples of one number: ``times`` (N,) in ns by the ``clock``, ``values`` (N,); ``name`` is the recording's."""

    name: str
    clock: str
    times: NDArray[np.int64]
    values: NDArray[np.float64]

    def sorted(self) -> SampledNumber:
        """The samples in the order of their times, of several at one time the first."""
        times, first = np.unique(self.times, return_index=True)
        return replace(self, times=times, values=self.values[first])


@dataclass(frozen=True)
class Rows:
    """Columns with ``time`` in s from the first row, each of shape (N,); ``summary`` says in words how they are."""

    columns: Mapping[str, NDArray[np.float64]]
    summary: str


def align_on_winch_rows(numbers: Mapping[str, SampledNumber], file: str) -> Rows:
    """Columns on the rows of the first cable's winch speed, or rope length, of samples by their standard names.

    Other winch speeds and rope lengths are interpolated linearly over up to five samples that are missing, and rows
    before the first or after the last of one of them are omitted.
    A sample of an output goes to the nearest row, if that is within half a row period, with its value there on the line
    to the next sample; other cells are NaN.

    Raises RecordingError where none are covered by all, or an output has no sample near any row.
    """
    series = _with_continuous_signs({name: number.sorted() for name, number in numbers.items()})
    names = sorted((name for name in series if name.startswith(_INPUTS)), key=lambda name: int(name.rpartition("_")[2]))
    inputs = [series[name] for name in names]
    if not inputs:
        return Rows({"time": np.empty(0)}, "")
    base = inputs[0]
    first, last = max(each.times[0] for each in inputs), min(each.times[-1] for each in inputs)
    rows = base.times[(base.times >= first) & (base.times <= last)]
    if not len(rows):
        ends_first = min(inputs, key=lambda each: int(each.times[-1]))
        raise _clock_error(max(inputs, key=lambda each: int(each.times[0])), ends_first, file)
    period = float(np.median(np.diff(rows))) if len(rows) > 1 else 0.0
    columns = {"time": (rows - rows[0]) / _NANOSECONDS}
    for name, each in series.items():
        if name.startswith(_INPUTS):
            columns[name] = interpolated_at(rows, each.times, each.values, row_period=period)
            continue
        columns[name] = _nearest_samples(each, rows, 0.5 * period)
        if np.isfinite(each.values).any() and not np.isfinite(columns[name]).any():
            raise _clock_error(each, base, file)
    repeated = sum(len(numbers[name].times) - len(each.times) for name, each in series.items())
    return Rows(columns, f"with a row for each sample of {base.name} by its {base.clock}{_in_words(columns, repeated)}")


def _with_continuous_signs(series: Mapping[str, SampledNumber]) -> dict[str, SampledNumber]:
    """Series in which a quaternion changes its sign nowhere, so that it can be interpolated."""
    parts = [series[name] for name in QUATERNION_COLUMNS if name in series]
    if len(parts) < len(QUATERNION_COLUMNS) or not all(np.array_equal(each.times, parts[0].times) for each in parts):
        return dict(series)
    values = with_continuous_signs(np.column_stack([each.values for each in parts])).T
    turned = zip(QUATERNION_COLUMNS, parts, values, strict=True)
    return {**series, **{name: replace(part, values=column) for name, part, column in turned}}


def _in_words(columns: Mapping[str, NDArray[np.float64]], repeated: int) -> str:
    """How many rows have outputs that are not in all, and how many numbers are ``repeated``."""
    sparse: dict[int, list[str]] = {}
    for name, column in columns.items():
        count = int(np.isfinite(column).sum())
        if count < len(column) and not name.startswith(_INPUTS):
            sparse.setdefault(count, []).append(name)
    row_count = len(columns["time"])
    parts = [f"; {join_names(names)} in {count} of {row_count} rows" for count, names in sparse.items()]
    parts += [f"; without {repeated} numbers at a time that another has"] if repeated else []
    return "".join(parts)


def _nearest_samples(number: SampledNumber, rows: NDArray[np.int64], half_period: float) -> NDArray[np.float64]:
    """Values (N,) at the rows that are nearest to a sample, each sample once; NaN at the others."""
    is_number = np.isfinite(number.values)
    times, values = number.times[is_number], number.values[is_number]
    column = np.full(len(rows), np.nan)
    if not len(times):
        return column
    after = np.minimum(np.searchsorted(rows, times), len(rows) - 1)
    before = np.maximum(after - 1, 0)
    nearest = np.where(times - rows[before] <= rows[after] - times, before, after)
    hit = np.unique(nearest[np.abs(rows[nearest] - times) <= half_period])
    column[hit] = np.interp(rows[hit] - rows[0], times - rows[0], values)
    return column


def _clock_error(number: SampledNumber, base: SampledNumber, file: str) -> RecordingError:
    lead = (number.times[0] - base.times[0]) / _NANOSECONDS
    problem = f"has no sample near those of {format_value(base.name)}, and begins {lead:.6g} s after them"
    hint = "record them at the same time and by one clock, or leave it out of the table"
    return RecordingError(f"{file}: {format_value(number.name)}", problem, hint)
