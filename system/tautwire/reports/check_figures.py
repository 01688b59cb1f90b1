"""The data of the figures on a check's page: curves of a recording, and the robot along the recorded path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..number_format import format_significant
from ..recordings.geometry_reading import GeometryReading, recorded_poses
from ..recordings.quaternion_columns import bridged_quaternions
from ..recordings.recording import Recording
from ..recordings.sensor_gaps import bridge_short_gaps
from ..robot.schema import Robot
from .downsampling import envelope_times, evenly_spaced_indices, min_max_envelope, pack_float32
from .robot_scene import RobotScene, ScenePath, body_attachments, frame_indices

Array = NDArray[np.float64]

MAX_POINTS, MAX_NUMBERS = 2000, 60_000  # per curve, and in all curves of a page, which so weighs at most 1.5 MB


@dataclass(frozen=True)
class CheckCurve:
    """A curve of ``values`` (N,) over ``x`` (N,), drawn broader where another one may cover it."""

    name: str
    x: Array
    values: Array
    is_broad: bool = False


@dataclass(frozen=True, eq=False)
class CheckPanel:
    """A panel: its quantity, what of it, the unit, the title of its x axis, its curves, and a caption."""

    title: str
    label: str
    unit: str
    x_title: str
    curves: tuple[CheckCurve, ...]
    caption: str


def panel_data(panels: Sequence[CheckPanel]) -> list[dict[str, Any]]:
    """The JSON data of panels for ``check.js``."""
    curve_count = sum(len(panel.curves) for panel in panels)
    points = max(100, min(MAX_POINTS, MAX_NUMBERS // max(1, 2 * curve_count)))
    return [
        {
            "title": panel.title,
            "label": panel.label,
            "unit": panel.unit,
            "xTitle": panel.x_title,
            "range": _range_texts(np.concatenate([curve.values for curve in panel.curves])),
            "numbers": panel.caption.replace("-", "\N{MINUS SIGN}"),
            "curves": [_curve_data(curve, points) for curve in panel.curves],
        }
        for panel in panels
    ]


def robot_scene(robot: Robot, recording: Recording | None) -> RobotScene:
    """The robot along the recorded path with the measured tensions, or at its start where there is no recording."""
    if recording is None:
        platform = np.array([robot.platform.start], dtype=float)
        nothing = np.full((1, robot.cable_count), np.nan)
        return RobotScene(np.zeros(1), platform, nothing, (), attachments=body_attachments(robot, platform))
    rows = frame_indices(recording.sample_count, 1, robot.cable_count, robot.platform.is_rigid_body)
    position = GeometryReading().positions(robot, recorded_poses(recording))
    platform = bridge_short_gaps(recording.time, position)[rows]
    turned = bridged_quaternions(recording.time, recording.orientation)[rows]
    path = ScenePath("recorded", platform, "accent", 5)
    attachments = body_attachments(robot, platform, turned if recording.has_orientation else None)
    return RobotScene(recording.time[rows], platform, recording.tension[rows], (path,), attachments=attachments)


def _curve_data(curve: CheckCurve, points: int) -> dict[str, Any]:
    """A curve of few points; the extremes of groups over time, and every so many points over anything else."""
    x, values = curve.x, curve.values
    if np.all(np.diff(x) > 0.0):
        x, values = envelope_times(x, points), min_max_envelope(values, points)
    else:
        rows = evenly_spaced_indices(x.size, points)
        x, values = x[rows], values[rows]
    return {"name": curve.name, "x": pack_float32(x), "y": pack_float32(values), "broad": curve.is_broad}


def _range_texts(values: Array) -> list[str]:
    """Minimum and maximum as texts; empty where nothing is finite."""
    finite = values[np.isfinite(values)]
    ends = (float(finite.min()), float(finite.max())) if finite.size else ()
    return [format_significant(end).replace("-", "\N{MINUS SIGN}") for end in ends]
