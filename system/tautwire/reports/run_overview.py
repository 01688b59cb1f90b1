"""A co-simulated run as a page shows it: an overview in bounded memory, with the recording that drove it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..cosimulation import Recorder, RunStatistics
from ..recordings.recording import Recording
from ..robot.schema import Robot
from ..robot.static_load import slack_tensions

Array = NDArray[np.float64]

MIN_GROUP_COUNT = 1500


@dataclass(frozen=True)
class _RowGroup:
    """Consecutive rows: the first with its time, and the extremes of each output with their times."""

    time: float
    first: Array
    low: Array
    high: Array
    low_time: Array
    high_time: Array

    def merge(self, following: _RowGroup) -> _RowGroup:
        """Merges this group with the following one."""
        is_lower = ~(self.low <= following.low) & ~np.isnan(following.low)
        is_higher = ~(self.high >= following.high) & ~np.isnan(following.high)
        return _RowGroup(
            self.time,
            self.first,
            np.where(is_lower, following.low, self.low),
            np.where(is_higher, following.high, self.high),
            np.where(is_lower, following.low_time, self.low_time),
            np.where(is_higher, following.high_time, self.high_time),
        )


class RunOverview:
    """A recorder that keeps of every group of rows the first, and the minimum and maximum of each output.

    A group begins as one row; whenever there are twice ``min_group_count`` groups, neighbours are merged. ``row_count``
    rows were recorded, ``group_size`` to a group; ``last_row`` is the run's end. Values that are not finite are ignored
    in the extremes.
    """

    def __init__(self, min_group_count: int = MIN_GROUP_COUNT) -> None:
        self._max_group_count = 2 * min_group_count
        self._closed_groups: list[_RowGroup] = []
        self._open_group: _RowGroup | None = None
        self._open_row_count = 0
        self.group_size = 1
        self.row_count = 0
        self.last_time = 0.0
        self.last_row = np.zeros(0)

    def add(self, time: float, row: Array) -> None:
        """See :class:`tautwire.cosimulation.Recorder`."""
        finite_row = np.where(np.isfinite(row), row, np.nan)
        times = np.full(len(finite_row), time)
        group = _RowGroup(time, finite_row, finite_row, finite_row, times, times)
        self._open_group = group if self._open_group is None else self._open_group.merge(group)
        self._open_row_count += 1
        self.row_count += 1
        self.last_time, self.last_row = time, finite_row
        if self._open_row_count == self.group_size:
            self._closed_groups.append(self._open_group)
            self._open_group, self._open_row_count = None, 0
        if len(self._closed_groups) == self._max_group_count:
            pairs = zip(self._closed_groups[0::2], self._closed_groups[1::2], strict=True)
            self._closed_groups = [early.merge(late) for early, late in pairs]
            self.group_size *= 2

    @property
    def time(self) -> Array:
        """Times of the first rows of all groups, in s."""
        return np.array([group.time for group in self._groups()])

    @property
    def rows(self) -> Array:
        """First rows of all groups, shape (groups, number of outputs); row k is row ``k * group_size`` of the run."""
        return np.array([group.first for group in self._groups()])

    def extremes(self) -> tuple[Array, Array]:
        """Minimum and maximum of each output over the whole run; NaN where nothing was finite."""
        groups = self._groups()
        low, high = np.array([group.low for group in groups]), np.array([group.high for group in groups])
        return np.fmin.reduce(low), np.fmax.reduce(high)

    def curve(self, output: int) -> tuple[Array, Array]:
        """Times and values of one output to draw: all rows, or the extremes of each group in order of time."""
        groups = self._groups()
        if self.group_size == 1:
            return self.time, np.array([group.first[output] for group in groups])
        ends = np.array([
            (group.low_time[output], group.low[output], group.high_time[output], group.high[output])
            for group in groups
        ])  # fmt: skip
        order = (ends[:, 0] > ends[:, 2])[:, None]
        pairs = np.where(order[:, :, None], ends.reshape(-1, 2, 2)[:, ::-1], ends.reshape(-1, 2, 2))
        flat = pairs.reshape(-1, 2)
        return flat[:, 0], flat[:, 1]

    def _groups(self) -> list[_RowGroup]:
        return self._closed_groups if self._open_group is None else [*self._closed_groups, self._open_group]


@dataclass(frozen=True)
class RecorderPair:
    """A recorder that passes each row to two recorders."""

    first: Recorder
    second: Recorder

    def add(self, time: float, row: Array) -> None:
        """See :class:`tautwire.cosimulation.Recorder`."""
        self.first.add(time, row)
        self.second.add(time, row)


@dataclass(frozen=True)
class ReportedRun:
    """A run as a page reports it: its ``overview`` in ``columns``, those of a result file without the time.

    ``recording`` holds the winch speeds that drove it. ``statistics`` is None where an FMU failed; ``failure`` then
    says which and when.
    """

    robot: Robot
    columns: tuple[str, ...]
    overview: RunOverview
    recording: Recording
    statistics: RunStatistics | None
    notes: tuple[str, ...] = ()
    failure: str | None = None

    def column_indices(self, prefix: str, names: Sequence[object]) -> dict[int, str]:
        """Indices of the columns ``prefix`` + name that exist, with their names."""
        names_by_column = {f"{prefix}{name}": str(name) for name in names}
        return {
            index: names_by_column[column] for index, column in enumerate(self.columns) if column in names_by_column
        }

    def slack_cables(self) -> list[str]:
        """Cables, counted from 1, whose tension reached that of a cable at which nothing pulls."""
        low, _ = self.overview.extremes()
        tensions = self.column_indices("tension_", self.robot.cable_numbers)
        slack = slack_tensions(self.robot)
        return [cable for index, cable in tensions.items() if low[index] <= slack[int(cable) - 1]]
