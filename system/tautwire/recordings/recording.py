"""Recordings: the speeds that the winches reported and what was measured, sample by sample."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError, shown
from .csv_file import open_csv
from .header import AXES
from .mdf_file import is_mdf, open_mdf
from .parquet_file import is_parquet, open_parquet
from .rules import HUGE, raise_first_fault


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

    def first(self, count: int) -> "Recording":
        """The first samples."""
        return replace(
            self,
            time=self.time[:count],
            winch_speed=self.winch_speed[:count],
            tension=self.tension[:count],
            position=self.position[:count],
        )

    def measured(self) -> NDArray[np.float64]:
        """All outputs, shape (N, 3 + n), in the order of ``channel_names``, in m and N; NaN where missing."""
        return np.hstack((self.position, self.tension))


def read_recording(path: str | Path, cable_count: int) -> Recording:
    """The recording in a CSV, Parquet or MDF file of a robot with ``cable_count`` cables; raises RecordingError."""
    opened = open_parquet if is_parquet(path) else open_mdf if is_mdf(path) else open_csv
    table = opened(path, cable_count)
    numbers = table.numbers()
    if numbers is None:
        raise_first_fault(table.rows(), table.header, table.file)
    cables = range(1, cable_count + 1)
    recording = Recording(
        path=table.file,
        time=_columns(numbers, ["time"])[:, 0],
        winch_speed=_columns(numbers, [f"winch_speed_{cable}" for cable in cables]),
        tension=_columns(numbers, [f"tension_{cable}" for cable in cables]),
        position=_columns(numbers, AXES),
        unknown_columns=table.header.unknown,
    )
    if not _is_sound(recording):
        raise_first_fault(table.rows(), table.header, table.file)
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


def _is_sound(recording: Recording) -> bool:
    """Whether the numbers keep the rules that ``raise_first_fault`` explains."""
    inputs, outputs = (recording.time, recording.winch_speed), (recording.position, recording.tension)
    return bool(
        recording.sample_count >= 2
        and all(np.isfinite(signals).all() for signals in inputs)
        and not any((np.abs(signals) > HUGE).any() for signals in (*inputs, *outputs))
        and (np.diff(recording.time) > 0.0).all()
    )


def _columns(numbers: Mapping[str, NDArray[np.float64]], names: Sequence[str]) -> NDArray[np.float64]:
    """Columns side by side, shape (N, number of names); NaN where the file has none of that name."""
    columns = np.full((len(numbers["time"]), len(names)), np.nan)
    for place, name in enumerate(names):
        if name in numbers:
            columns[:, place] = numbers[name]
    columns.setflags(write=False)
    return columns
