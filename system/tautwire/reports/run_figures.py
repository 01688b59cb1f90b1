"""The data of the figures on a run's page."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..cosimulation.robot_wiring import ORIENTATION_AXES
from ..number_format import INTEGER_DIGITS, PAGE_UNITS, choose_unit, digits_for_range, format_significant
from ..recordings.quaternion_columns import bridged_quaternions, rotation_vectors, rotations_between
from ..recordings.sensor_gaps import bridge_short_gaps
from ..robot.schema import AXES
from .downsampling import envelope_times, min_max_envelope, pack_float32
from .robot_scene import (
    MAGNIFICATIONS,
    RobotScene,
    ScenePath,
    body_attachments,
    deviation_magnification,
    frame_indices,
    measured_path,
    scene_data,
)
from .run_overview import ReportedRun

Array = NDArray[np.float64]

# Units that a difference has whatever its size, with their size in SI units.
FIXED_UNITS = dict(PAGE_UNITS.values())
MAX_SERIES_NUMBERS = 90_000  # in all curves of a page, times included, which so weighs at most 1.5 MB
MAX_SERIES_POINTS, MIN_SERIES_POINTS = 3000, 300  # per curve


@dataclass(frozen=True, eq=False)
class OutputSeries:
    """One output of a run over time, in SI units: its labels, its curve, its ends, and its recorded values.

    ``time`` and ``values`` (G,) are drawn; ``ends`` are the first, last, lowest and highest value. ``scale`` turns SI
    into ``unit``; values are printed to so many significant ``digits``. ``recorded`` (N,) is over the recording's time,
    None where it has none; ``difference`` (M,) is recorded minus co-simulated at the overview's first M rows, and of
    orientations the rotation from the co-simulated to the recorded one.
    """

    title: str
    label: str
    unit: str
    scale: float
    digits: int
    time: Array
    values: Array
    ends: tuple[float, float, float, float]
    recorded: Array | None
    difference: Array

    @property
    def rms_difference(self) -> float:
        """Root mean square of the difference, in SI; NaN where nothing can be compared."""
        finite = self.difference[np.isfinite(self.difference)]
        return float(np.sqrt(np.mean(finite**2))) if finite.size else math.nan

    @property
    def difference_unit(self) -> tuple[str, float]:
        """The display unit of the difference, and its size in SI units."""
        if self.unit in FIXED_UNITS:
            return self.unit, FIXED_UNITS[self.unit]
        magnitudes = np.abs(self.difference[np.isfinite(self.difference)])
        return choose_unit(float(np.max(magnitudes, initial=0.0)), self.unit)


def output_series(run: ReportedRun) -> list[OutputSeries]:
    """All outputs that a page shows, ordered by quantity."""
    recording, cables = run.recording, run.robot.cable_numbers
    positions: Mapping[str, Array] = dict(zip(AXES, recording.position.T, strict=True))
    tensions: Mapping[str, Array] = {str(i): recording.tension[:, i - 1] for i in cables}
    speeds: Mapping[str, Array] = {str(i): recording.winch_speed[:, i - 1] for i in cables}
    quantities: tuple[tuple[str, str, Sequence[object], str, float, Mapping[str, Array]], ...] = (
        ("Position", "", AXES, "mm", 1e3, positions),
        ("Tension", "tension_", cables, "N", 1.0, tensions),
        ("Velocity", "v", AXES, "m/s", 1.0, {}),
        ("Angular velocity", "w", AXES, "mrad/s", 1e3, {}),
        ("Elongation", "elongation_", cables, "mm", 1e3, {}),
        ("Winch speed", "winch_speed_", cables, "m/s", 1.0, speeds),
    )
    series, extremes = [], np.array(run.overview.extremes())
    for title, prefix, names, unit, scale, recorded in quantities:
        if title == "Angular velocity":
            series += _rotation_series(run)
        for index, name in run.column_indices(prefix, names).items():
            label = f"cable {name}" if names is cables else name
            low, high = (float(each) for each in extremes[:, index])
            digits = digits_for_range(low, high) if title == "Position" else INTEGER_DIGITS
            ends = (float(run.overview.rows[0, index]), float(run.overview.last_row[index]), low, high)
            curve, compared = run.overview.curve(index), _compared(run, index, recorded.get(name))
            series.append(OutputSeries(title, label, unit, scale, digits, *curve, ends, *compared))
    return series


def run_data(run: ReportedRun, series: Sequence[OutputSeries]) -> dict[str, Any]:
    """The figure data of a run."""
    compared_count = sum(each.recorded is not None for each in series)
    points = MAX_SERIES_NUMBERS // max(1, 2 * len(series) + 4 * compared_count)
    points = int(np.clip(points, MIN_SERIES_POINTS, MAX_SERIES_POINTS))
    choice = {
        "label": "Run",
        "channels": [_series_data(run, each, points) for each in series],
        "scene": scene_data(_run_scene(run)),
    }
    return {
        "anchors": [[float(value) for value in anchor] for anchor in run.robot.anchors],
        "magnifications": list(MAGNIFICATIONS),
        "choices": [choice],
    }


def _rotation_series(run: ReportedRun) -> list[OutputSeries]:
    """The rotation about each axis from the orientation in which the run starts; none where an FMU does not output it.

    At the first rows of the overview's groups, as the extremes of a quaternion's parts are no orientation.
    """
    overview, recording = run.overview, run.recording
    parts = list(run.column_indices("q", ORIENTATION_AXES))
    if len(parts) < len(ORIENTATION_AXES):
        return []
    time, rows = overview.time, overview.rows
    if overview.last_time > time[-1]:
        time, rows = np.append(time, overview.last_time), np.vstack([rows, overview.last_row])
    simulated = rows[:, parts] / np.linalg.norm(rows[:, parts], axis=1, keepdims=True)
    bridged = bridged_quaternions(recording.time, recording.orientation)
    thinned = bridged[:: overview.group_size]
    count = min(len(thinned), len(overview.rows))
    vectors, recorded = (rotation_vectors(each, simulated[0]) for each in (simulated, bridged))
    differences = rotations_between(simulated[:count], thinned[:count])
    series = []
    for axis, values, measured, difference in zip(AXES, vectors.T, recorded.T, differences.T, strict=True):
        ends = (float(values[0]), float(values[-1]), float(np.nanmin(values)), float(np.nanmax(values)))
        compared = (measured, difference) if np.isfinite(measured).any() else (None, np.zeros(0))
        labels = ("Rotation", f"about {axis}", "mrad", 1e3, INTEGER_DIGITS)
        series.append(OutputSeries(*labels, time, values, ends, *compared))
    return series


def _compared(run: ReportedRun, column_index: int, recorded: Array | None) -> tuple[Array | None, Array]:
    """The recorded values of an output, None where there are none, and their difference from the overview's rows."""
    if recorded is None or not np.isfinite(recorded).any():
        return None, np.zeros(0)
    # A sensor slower than the log may have no sample in the rows that are left.
    bridged = bridge_short_gaps(run.recording.time, recorded)
    thinned_recording, rows = bridged[:: run.overview.group_size], run.overview.rows[:, column_index]
    count = min(len(thinned_recording), len(rows))
    return recorded, thinned_recording[:count] - rows[:count]


def _series_data(run: ReportedRun, series: OutputSeries, points: int) -> dict[str, Any]:
    """An output over time, and its recorded values until the run ended, of at most ``points`` points each."""
    description: dict[str, Any] = {
        "label": series.label,
        "title": series.title,
        "unit": series.unit,
        "digits": series.digits,
    }
    curve = {
        "time": pack_float32(envelope_times(series.time, points)),
        "values": pack_float32(series.scale * min_max_envelope(series.values, points)),
        "range": _range_texts(series.scale * series.values, series.digits),
    }
    if series.recorded is None:
        return {**description, **curve, "recorded": None, "difference": None}
    sample_count = int(np.searchsorted(run.recording.time, run.overview.last_time, side="right"))
    drawn = bridge_short_gaps(run.recording.time[:sample_count], series.recorded[:sample_count])
    recorded = {
        "time": pack_float32(envelope_times(run.recording.time[:sample_count], points)),
        "values": pack_float32(series.scale * min_max_envelope(drawn, points)),
    }
    return {**description, **curve, "recorded": recorded, "difference": _difference_data(run, series, points)}


def _difference_data(run: ReportedRun, series: OutputSeries, points: int) -> dict[str, Any] | None:
    """Recorded minus co-simulated over time, in a unit of fitting size; None where nothing can be compared."""
    if not math.isfinite(series.rms_difference):
        return None
    unit, unit_size = series.difference_unit
    time = run.overview.time[: len(series.difference)]
    return {
        "time": pack_float32(envelope_times(time, points)),
        "values": pack_float32(min_max_envelope(bridge_short_gaps(time, series.difference) / unit_size, points)),
        "apart": format_significant(series.rms_difference / unit_size),
        "unit": unit,
        "name": "recorded minus co-simulated",
    }


def _range_texts(values: Array, digits: int) -> list[str]:
    """Minimum and maximum as text with a true minus sign; empty where nothing is finite."""
    finite = values[np.isfinite(values)]
    ends = (float(finite.min()), float(finite.max())) if finite.size else ()
    return [format_significant(end, digits).replace("-", "\N{MINUS SIGN}") for end in ends]


def _run_scene(run: ReportedRun) -> RobotScene:
    """The scene of the run, with the recorded path beside the co-simulated one."""
    overview, recording, robot, magnification = run.overview, run.recording, run.robot, 1
    row_indices = frame_indices(len(overview.rows), 2, robot.cable_count, robot.platform.is_rigid_body)
    rows = overview.rows[row_indices]
    recorded_rows = np.minimum(np.arange(len(overview.rows)) * overview.group_size, recording.sample_count - 1)
    sample_indices = recorded_rows[row_indices]
    path = _columns_by_name(overview.rows, run.column_indices("", AXES), AXES)
    platform = path[row_indices]
    orientation = _columns_by_name(rows, run.column_indices("q", ORIENTATION_AXES), ORIENTATION_AXES)
    paths = [ScenePath("co-simulated", platform, "accent", 5)]
    if recording.has_position:
        bridged = bridge_short_gaps(recording.time, recording.position)
        measured = measured_path(overview.time, bridged[recorded_rows], path)[row_indices]
        paths.insert(0, ScenePath("recorded", measured, "before", 2, "dot"))
        magnification = deviation_magnification(np.array(robot.anchors), platform, [measured - platform])
    return RobotScene(
        time=run.overview.time[row_indices],
        platform=platform,
        tension=_columns_by_name(rows, run.column_indices("tension_", robot.cable_numbers), robot.cable_numbers),
        paths=tuple(paths),
        measured_tension=recording.tension[sample_indices] if recording.has_tension else None,
        magnification=magnification,
        attachments=body_attachments(robot, platform, orientation),
    )


def _columns_by_name(rows: Array, column_indices: Mapping[int, str], names: Sequence[object]) -> Array:
    """Columns selected by name; NaN for one that an FMU does not output."""
    index_by_name = {name: index for index, name in column_indices.items()}
    missing = np.full(len(rows), np.nan)
    return np.column_stack([rows[:, index_by_name[str(n)]] if str(n) in index_by_name else missing for n in names])
