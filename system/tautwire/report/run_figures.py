"""The numbers that the figures of a run's page draw."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..runs.wiring import AXES
from .figures import MAGNIFICATIONS, magnification
from .run import Run
from .scene import Path, Scene, scene_data
from .series import envelope, envelope_times, packed, thinned
from .units import handy_unit, significant

Array = NDArray[np.float64]

# Of units in which outputs are shown, those that are not SI.
SI_UNITS = {"mm": "m"}
LINE_POINTS = 3000
PATH_POINTS = 900


@dataclass(frozen=True)
class Line:
    """One output of a run: where it stands among the columns, what to call it, and what was recorded of it.

    ``scale`` turns SI into ``unit``. ``recorded`` (N,) is over the recording's time, None where it has none;
    ``difference`` (M,) is recorded minus co-simulated at the overview's first M rows, in SI.
    """

    place: int
    title: str
    label: str
    unit: str
    scale: float
    recorded: Array | None
    difference: Array

    @property
    def apart(self) -> float:
        """The root mean square of the difference, in SI; NaN where nothing can be compared."""
        seen = self.difference[np.isfinite(self.difference)]
        return float(np.sqrt(np.mean(seen**2))) if seen.size else math.nan

    @property
    def difference_unit(self) -> tuple[str, float]:
        """The unit that suits the difference, and how many SI units one of it is."""
        seen = np.abs(self.difference[np.isfinite(self.difference)])
        return handy_unit(float(np.max(seen, initial=0.0)), SI_UNITS.get(self.unit, self.unit))


def lines_of(run: Run) -> list[Line]:
    """All outputs that a page shows, by quantity."""
    recording, cables = run.recording, run.robot.cable_numbers
    positions: Mapping[str, Array] = dict(zip(AXES, recording.position.T, strict=True))
    tensions: Mapping[str, Array] = {str(i): recording.tension[:, i - 1] for i in cables}
    speeds: Mapping[str, Array] = {str(i): recording.winch_speed[:, i - 1] for i in cables}
    kinds: tuple[tuple[str, str, Sequence[object], str, float, Mapping[str, Array]], ...] = (
        ("Position", "", AXES, "m", 1.0, positions),
        ("Tension", "tension_", cables, "N", 1.0, tensions),
        ("Velocity", "v", AXES, "m/s", 1.0, {}),
        ("Elongation", "elongation_", cables, "mm", 1e3, {}),
        ("Winch speed", "winch_speed_", cables, "m/s", 1.0, speeds),
    )
    return [
        _line(run, place, title, name if names is AXES else f"cable {name}", unit, scale, recorded.get(name))
        for title, prefix, names, unit, scale, recorded in kinds
        for place, name in run.places(prefix, names).items()
    ]


def run_data(run: Run, lines: Sequence[Line]) -> dict[str, Any]:
    """A run, ready to draw."""
    choice = {
        "label": "Run",
        "channels": [_channel(run, line) for line in lines],
        "scene": scene_data(_scene(run)),
    }
    return {
        "anchors": [[float(value) for value in anchor] for anchor in run.robot.anchors],
        "magnifications": list(MAGNIFICATIONS),
        "choices": [choice],
    }


def _line(run: Run, place: int, title: str, label: str, unit: str, scale: float, recorded: Array | None) -> Line:
    if recorded is None or not np.isfinite(recorded).any():
        return Line(place, title, label, unit, scale, None, np.zeros(0))
    sampled, rows = recorded[:: run.overview.size], run.overview.rows[:, place]
    count = min(len(sampled), len(rows))
    return Line(place, title, label, unit, scale, recorded, sampled[:count] - rows[:count])


def _channel(run: Run, line: Line) -> dict[str, Any]:
    """An output over time, beside what was recorded of it until the run ended."""
    time, values = run.overview.line(line.place)
    described: dict[str, Any] = {"label": line.label, "title": line.title, "unit": line.unit}
    shown = {"time": packed(time), "values": packed(line.scale * values), "range": _range(line.scale * values)}
    if line.recorded is None:
        return {**described, **shown, "recorded": None, "difference": None}
    until = int(np.searchsorted(run.recording.time, run.overview.last_time, side="right"))
    recorded = {
        "time": packed(envelope_times(run.recording.time[:until], LINE_POINTS)),
        "values": packed(line.scale * envelope(line.recorded[:until], LINE_POINTS)),
    }
    return {**described, **shown, "recorded": recorded, "difference": _difference(run, line)}


def _difference(run: Run, line: Line) -> dict[str, Any] | None:
    """Recorded minus co-simulated over time, in a unit of its own size; None where nothing can be compared."""
    if not math.isfinite(line.apart):
        return None
    unit, one = line.difference_unit
    return {
        "time": packed(run.overview.time[: len(line.difference)]),
        "values": packed(line.difference / one),
        "apart": significant(line.apart / one),
        "unit": unit,
    }


def _range(values: Array) -> list[str]:
    """The least and the largest as text with a true minus sign; empty where nothing is finite."""
    finite = values[np.isfinite(values)]
    ends = (float(finite.min()), float(finite.max())) if finite.size else ()
    return [significant(end).replace("-", "\N{MINUS SIGN}") for end in ends]


def _scene(run: Run) -> Scene:
    """The run in space, and beside its path the recorded one."""
    kept = thinned(len(run.overview.rows), PATH_POINTS)
    rows, samples = run.overview.rows[kept], np.minimum(kept * run.overview.size, run.recording.sample_count - 1)
    platform = _picked(rows, run.places("", AXES), AXES)
    paths = [Path("co-simulated", platform, "accent", 5)]
    recording, magnify = run.recording, 1
    if recording.has_position:
        measured = recording.position[samples]
        paths.insert(0, Path("recorded", measured, "before", 2, "dot"))
        magnify = magnification(np.array(run.robot.anchors), platform, [measured - platform])
    return Scene(
        time=run.overview.time[kept],
        platform=platform,
        tension=_picked(rows, run.places("tension_", run.robot.cable_numbers), run.robot.cable_numbers),
        paths=tuple(paths),
        measured_tension=recording.tension[samples] if recording.has_tension else None,
        magnify=magnify,
    )


def _picked(rows: Array, places: Mapping[int, str], names: Sequence[object]) -> Array:
    """Columns by their names, NaN where an FMU does not show one."""
    by_name = {name: place for place, name in places.items()}
    missing = np.full(len(rows), np.nan)
    return np.column_stack([rows[:, by_name[str(n)]] if str(n) in by_name else missing for n in names])
