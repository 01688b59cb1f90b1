"""Data of the 3D scene of a robot on a page: what the slider moves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .downsampling import pack_float32

Array = NDArray[np.float64]

# s; a longer run is played faster.
MAX_PLAYBACK_TIME = 60.0


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
