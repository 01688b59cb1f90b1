"""A co-simulated run with its driving recording: values only, for a page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..master import RunStatistics
from ..recordings.recording import Recording
from ..robots.robot import Robot
from .overview import RunOverview


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
        """Cables, counted from 1, whose tension reached zero."""
        low, _ = self.overview.extremes()
        tensions = self.column_indices("tension_", self.robot.cable_numbers)
        return [cable for index, cable in tensions.items() if low[index] <= 0.0]
