"""Data of the 3D scene of a robot on a page: what the slider moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..recordings.sensor_gaps import bridge_short_gaps
from .downsampling import pack_float32

Array = NDArray[np.float64]

# s; a longer run is played faster.
MAX_PLAYBACK_TIME = 60.0
MAGNIFICATIONS = (1, 10, 100, 1000)
# Deviations are magnified until the largest reaches this share of the robot's size, or of the path's extent.
MAX_SHARE_OF_ROBOT_SIZE, MAX_SHARE_OF_PATH_SIZE = 0.03, 0.15


@dataclass(frozen=True)
class ScenePath:
    """A path in the scene: ``points`` (N, 3) in m; ``colour`` is a name in the style, ``dash`` one of plotly's."""

    name: str
    points: Array
    colour: str
    width: float
    dash: str = "solid"


@dataclass(frozen=True)
class RobotScene:
    """The frames of the slider: ``platform`` (N, 3) in m and ``tension`` (N, n) in N at ``time`` (N,) in s.

    Deviations of ``paths`` from the platform's own are drawn ``magnification`` times larger. ``measured_tension`` has
    the shape of ``tension``, None where there is none.
    """

    time: Array
    platform: Array
    tension: Array
    paths: tuple[ScenePath, ...]
    measured_tension: Array | None = None
    magnification: int = 1


def fill_unmeasured(points: Array, path: Array) -> Array:
    """Measured ``points`` (N, 3) with the coordinates of a ``path`` (N, 3) along axes that were not measured at all."""
    return np.where(np.isfinite(points).any(axis=0), points, path)


def measured_path(time: Array, points: Array, path: Array) -> Array:
    """The path through measured ``points`` (N, 3) at ``time`` (N,) in s, drawn beside another ``path`` (N, 3).

    Between points their deviation from that path is linear, where no gap is; along axes that were not measured it is 0.
    """
    return path + bridge_short_gaps(time, fill_unmeasured(points, path) - path)


def pack_columns(values: Array) -> list[str]:
    """Each column packed as base64 of float32."""
    return [pack_float32(column) for column in values.T]


def scene_data(scene: RobotScene) -> dict[str, Any]:
    """The JSON data of a scene for ``scene.js``."""
    finite = scene.tension[np.isfinite(scene.tension)]
    duration = float(scene.time[-1] - scene.time[0])
    return {
        "time": pack_float32(scene.time),
        "clock": "s",
        "decimals": 2,
        "pace": min(1.0, MAX_PLAYBACK_TIME / duration) if duration > 0.0 else 1.0,
        "cycle": False,
        "platform": pack_columns(scene.platform),
        "paths": [
            {"name": p.name, "columns": pack_columns(p.points), "colour": p.colour, "width": p.width, "dash": p.dash}
            for p in scene.paths
        ],
        "tension": pack_columns(scene.tension),
        "measuredTension": None if scene.measured_tension is None else pack_columns(scene.measured_tension),
        "tensionRange": [float(finite.min()), float(finite.max())] if finite.size else [0.0, 1.0],
        "tensionTitle": "Tension (N)",
        "tensionUnit": "N",
        "magnify": scene.magnification,
    }


def deviation_magnification(anchors: Array, path: Array, deviations: Sequence[Array]) -> int:
    """Magnification at which ``deviations`` (N, 3) from a ``path`` (N, 3) are visible beside the ``anchors``.

    The bound by the path's extent does not hold for a robot at rest, which has no path that they could hide.
    """
    distances = np.concatenate([np.linalg.norm(each, axis=1) for each in deviations])
    largest = float(np.max(distances[np.isfinite(distances)], initial=0.0))
    finite_path = path[np.isfinite(path).all(axis=1)]
    max_drawn_deviation = MAX_SHARE_OF_ROBOT_SIZE * float(np.max(np.ptp(np.vstack((anchors, finite_path)), axis=0)))
    path_extent = float(np.max(np.ptp(finite_path, axis=0))) if len(finite_path) else 0.0
    if path_extent > largest:
        max_drawn_deviation = min(max_drawn_deviation, MAX_SHARE_OF_PATH_SIZE * path_extent)
    return (
        max((factor for factor in MAGNIFICATIONS if factor * largest <= max_drawn_deviation), default=1)
        if largest > 0.0
        else 1
    )
