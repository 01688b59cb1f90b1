"""An overview of a run of any length, taken while it goes on: what a page draws, in bounded memory."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..master import Recorder

Array = NDArray[np.float64]

GROUPS = 1500


@dataclass(frozen=True)
class _Group:
    """Rows one after the other: the first with its time, and of each output the extremes with their times."""

    time: float
    first: Array
    low: Array
    high: Array
    low_time: Array
    high_time: Array

    def joined(self, later: _Group) -> _Group:
        """This group and the next as one."""
        lower = ~(self.low <= later.low) & ~np.isnan(later.low)
        higher = ~(self.high >= later.high) & ~np.isnan(later.high)
        return _Group(
            self.time,
            self.first,
            np.where(lower, later.low, self.low),
            np.where(higher, later.high, self.high),
            np.where(lower, later.low_time, self.low_time),
            np.where(higher, later.high_time, self.high_time),
        )


class Overview:
    """A recorder that keeps of every group of rows the first, and the least and largest of each output.

    A group begins as one row; whenever there are twice ``groups`` of them, neighbours join. ``count`` rows came,
    ``size`` of them make a group; ``first_row`` and ``last_row`` are the run's ends. What is not finite is no extreme.
    """

    def __init__(self, groups: int = GROUPS) -> None:
        self._limit = 2 * groups
        self._done: list[_Group] = []
        self._open: _Group | None = None
        self._opened = 0
        self.size = 1
        self.count = 0
        self.last_time = 0.0
        self.last_row = np.zeros(0)

    def add(self, time: float, row: Array) -> None:
        """See :class:`tautwire.master.Recorder`."""
        kept = np.where(np.isfinite(row), row, np.nan)
        times = np.full(len(kept), time)
        group = _Group(time, kept, kept, kept, times, times)
        self._open = group if self._open is None else self._open.joined(group)
        self._opened += 1
        self.count += 1
        self.last_time, self.last_row = time, kept
        if self._opened == self.size:
            self._done.append(self._open)
            self._open, self._opened = None, 0
        if len(self._done) == self._limit:
            pairs = zip(self._done[0::2], self._done[1::2], strict=True)
            self._done = [early.joined(late) for early, late in pairs]
            self.size *= 2

    @property
    def time(self) -> Array:
        """Times of the first rows of all groups, in s."""
        return np.array([group.time for group in self._groups()])

    @property
    def rows(self) -> Array:
        """First rows of all groups, shape (groups, number of outputs); row k of them is row ``k * size`` of the run."""
        return np.array([group.first for group in self._groups()])

    def extremes(self) -> tuple[Array, Array]:
        """The least and the largest of each output over the whole run; NaN where nothing was finite."""
        groups = self._groups()
        low, high = np.array([group.low for group in groups]), np.array([group.high for group in groups])
        return np.fmin.reduce(low), np.fmax.reduce(high)

    def line(self, output: int) -> tuple[Array, Array]:
        """Times and values of one output to draw: all rows, or the extremes of each group as they came."""
        groups = self._groups()
        if self.size == 1:
            return self.time, np.array([group.first[output] for group in groups])
        ends = np.array([
            (group.low_time[output], group.low[output], group.high_time[output], group.high[output])
            for group in groups
        ])  # fmt: skip
        order = (ends[:, 0] > ends[:, 2])[:, None]
        pairs = np.where(order[:, :, None], ends.reshape(-1, 2, 2)[:, ::-1], ends.reshape(-1, 2, 2))
        flat = pairs.reshape(-1, 2)
        return flat[:, 0], flat[:, 1]

    def _groups(self) -> list[_Group]:
        return self._done if self._open is None else [*self._done, self._open]


@dataclass(frozen=True)
class Both:
    """A recorder that hands each row to two."""

    one: Recorder
    other: Recorder

    def add(self, time: float, row: Array) -> None:
        """See :class:`tautwire.master.Recorder`."""
        self.one.add(time, row)
        self.other.add(time, row)
