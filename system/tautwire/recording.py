"""Recordings: the speeds that the winches reported and what was measured, sample by sample."""

import csv
from dataclasses import dataclass
from io import BytesIO
from itertools import islice
from pathlib import Path

import numpy as np
import pandas as pd  # type: ignore[import-untyped,unused-ignore]
from numpy.typing import NDArray

from .errors import RecordingError, shown
from .input_file import read_bytes, require_text
from .recording_header import AXES, Header, as_text, read_header
from .recording_rules import HUGE, MISSING, raise_first_fault

BYTE_ORDER_MARK = b"\xef\xbb\xbf"


@dataclass(frozen=True, eq=False)
class Recording:
    """N samples of a robot with n cables; the arrays are float64 and read-only where a file was read.

    ``time`` (N,) in s, strictly rising; ``winch_speed`` (N, n) in m/s, positive reels in; ``tension`` (N, n)
    in N and ``position`` (N, 3) in m, NaN where a cell or a column is missing. ``unknown_columns`` by name.
    """

    path: str
    time: NDArray[np.float64]
    winch_speed: NDArray[np.float64]
    tension: NDArray[np.float64]
    position: NDArray[np.float64]
    unknown_columns: tuple[str, ...] = ()

    @property
    def cable_count(self) -> int:
        """Number of cables, n."""
        return int(self.winch_speed.shape[1])

    @property
    def sample_count(self) -> int:
        """Number of samples, N."""
        return int(self.time.size)

    @property
    def duration(self) -> float:
        """Time from the first to the last sample, in s."""
        return float(self.time[-1] - self.time[0])

    @property
    def has_position(self) -> bool:
        """Whether any coordinate of any sample was measured."""
        return bool(np.isfinite(self.position).any())

    @property
    def has_tension(self) -> bool:
        """Whether any tension of any sample was measured."""
        return bool(np.isfinite(self.tension).any())

    @property
    def channel_names(self) -> tuple[str, ...]:
        """Names of the outputs in the order of :meth:`measured`: x, y, z, tension_1 to tension_n."""
        return (*AXES, *(f"tension_{cable}" for cable in range(1, self.cable_count + 1)))

    def measured(self) -> NDArray[np.float64]:
        """All outputs, shape (N, 3 + n), in the order of ``channel_names``, in m and N; NaN where missing."""
        return np.hstack((self.position, self.tension))


def read_recording(path: str | Path, cable_count: int) -> Recording:
    """The recording in a CSV file of a robot with ``cable_count`` cables; raises RecordingError."""
    file = str(path)
    content = read_bytes(path, RecordingError)
    require_text(content, file, RecordingError, "CSV")
    content = content.removeprefix(BYTE_ORDER_MARK)
    header = read_header(content, file, cable_count)
    numbers = _numbers(content, header)
    if numbers is None:
        raise_first_fault(content, header, file)
    cables = range(1, cable_count + 1)
    recording = Recording(
        path=file,
        time=_column(numbers, "time"),
        winch_speed=_columns(numbers, [f"winch_speed_{cable}" for cable in cables]),
        tension=_columns(numbers, [f"tension_{cable}" for cable in cables]),
        position=_columns(numbers, AXES),
        unknown_columns=header.unknown,
    )
    if not _is_sound(recording):
        raise_first_fault(content, header, file)
    return recording


def require_outputs(recording: Recording) -> None:
    """Raises RecordingError where nothing at all was measured."""
    if recording.has_position or recording.has_tension:
        return
    mend = "record at least one of them"
    if recording.unknown_columns:
        mend += f" (not read: {shown(', '.join(recording.unknown_columns), 200)})"
    last = f"tension_{recording.cable_count}"
    problem = f"no number in any of the outputs x, y, z, tension_1 to {last}"
    raise RecordingError(recording.path, problem, mend)


def _numbers(content: bytes, header: Header) -> pd.DataFrame | None:
    """The known columns as numbers; None where the file is no table of numbers."""
    # Where the first row has more cells than the header, pandas would take some for an index.
    if not _is_rectangular(content, len(header.names), row_count=1):
        return None
    try:
        frame = pd.read_csv(
            BytesIO(content),
            header=0,
            names=list(header.names),
            dtype={name: str if name in header.unknown else np.float64 for name in header.names},
            encoding="utf-8",
            skipinitialspace=True,
            keep_default_na=False,
            na_values=list(MISSING),
        )
    except (ValueError, OverflowError):
        return None
    return frame if _is_rectangular(content, len(header.names), len(frame)) else None


def _is_rectangular(content: bytes, width: int, row_count: int) -> bool:
    """Whether the first rows are as wide as the header; pandas fills short ones up without a word."""
    if row_count > 1 and b'"' not in content:
        return content.count(b",") == (row_count + 1) * (width - 1)
    try:
        rows = csv.reader(as_text(content), skipinitialspace=True)
        filled = (row for row in rows if len(row) > 1 or "".join(row).strip())
        return all(len(row) == width for row in islice(filled, row_count + 1))
    except csv.Error:
        return False


def _is_sound(recording: Recording) -> bool:
    """Whether the numbers keep the rules that ``raise_first_fault`` explains."""
    inputs = np.column_stack((recording.time, recording.winch_speed))
    outputs = recording.measured()
    return bool(
        recording.sample_count >= 2
        and np.isfinite(inputs).all()
        and (np.abs(inputs) <= HUGE).all()
        and (np.diff(recording.time) > 0.0).all()
        and not (np.abs(outputs) > HUGE).any()
    )


def _column(numbers: pd.DataFrame, name: str) -> NDArray[np.float64]:
    column = np.array(numbers[name], dtype=np.float64) if name in numbers else np.full(len(numbers), np.nan)
    column.setflags(write=False)
    return column


def _columns(numbers: pd.DataFrame, names: list[str] | tuple[str, ...]) -> NDArray[np.float64]:
    columns = np.column_stack([_column(numbers, name) for name in names])
    columns.setflags(write=False)
    return columns
