"""A co-simulated run with what drove it: values only, for a page to show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..master import Account
from ..recordings.recording import Recording
from ..robots.robot import Robot
from .overview import Overview


@dataclass(frozen=True)
class Run:
    """What a page says of a run: its ``overview`` in ``columns``, those of a result file without the time.

    ``recording`` is what drove it. ``account`` is None where an FMU failed; ``failure`` then says which and when.
    """

    robot: Robot
    columns: tuple[str, ...]
    overview: Overview
    recording: Recording
    account: Account | None
    notes: tuple[str, ...] = ()
    failure: str | None = None

    def places(self, prefix: str, names: Sequence[object]) -> dict[int, str]:
        """Places of the columns ``prefix`` + name that are there, with their names."""
        wanted = {f"{prefix}{name}": str(name) for name in names}
        return {place: wanted[column] for place, column in enumerate(self.columns) if column in wanted}

    def slack_cables(self) -> list[str]:
        """Cables, counted from 1, whose tension reached zero."""
        low, _ = self.overview.extremes()
        tensions = self.places("tension_", self.robot.cable_numbers)
        return [cable for place, cable in tensions.items() if low[place] <= 0.0]
