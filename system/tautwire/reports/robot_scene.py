"""Data of the 3D scene of a robot on a page: what the slider moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from ..recordings.sensor_gaps import bridge_short_gaps
from ..robot.cable_routes import attachment_points
from ..robot.schema import Robot
from .downsampling import evenly_spaced_indices, pack_float32

Array = NDArray[np.float64]

# s; a longer run is played faster.
MAX_PLAYBACK_TIME = 60.0
MAX_FRAMES, MAX_SCENE_NUMBERS = 900, 20_000  # of a scene, whose page so weighs at most 1.5 MB
MAGNIFICATIONS = (1, 10, 100, 1000)
# Deviations are magnified until the largest reaches this share of the robot's size, or of the path's extent.
MAX_SHARE_OF_ROBOT_SIZE, MAX_SHARE_OF_PATH_SIZE = 0.03, 0.15
# Of the largest extent: a body that is thinner is drawn flat, and faces that turn by less are one.
FLATNESS = 1e-6


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
    the shape of ``tension``, None where there is none. ``attachments`` (N, n, 3) in m are where the cables hold a rigid
    body, None for a point mass.
    """

    time: Array
    platform: Array
    tension: Array
    paths: tuple[ScenePath, ...]
    measured_tension: Array | None = None
    magnification: int = 1
    attachments: Array | None = None


def frame_indices(
    sample_count: int, path_count: int, cable_count: int, has_attachments: bool = False
) -> NDArray[np.int64]:
    """Indices of the samples that become frames of a scene, spread evenly, so many as a page can hold."""
    # Time, platform and paths; tensions of model and load cells, and attachments.
    numbers_per_frame = 1 + 3 * (1 + path_count) + (5 if has_attachments else 2) * cable_count
    return evenly_spaced_indices(sample_count, min(MAX_FRAMES, MAX_SCENE_NUMBERS // numbers_per_frame))


def fill_unmeasured(points: Array, path: Array) -> Array:
    """Measured ``points`` (N, 3) with the coordinates of a ``path`` (N, 3) along axes that were not measured at all."""
    return np.where(np.isfinite(points).any(axis=0), points, path)


def measured_path(time: Array, points: Array, path: Array) -> Array:
    """The path through measured ``points`` (N, 3) at ``time`` (N,) in s, drawn beside another ``path`` (N, 3).

    Between points their deviation from that path is linear, where no gap is; along axes that were not measured it is 0.
    """
    return path + bridge_short_gaps(time, fill_unmeasured(points, path) - path)


def body_attachments(robot: Robot, position: Array, orientation: Array | None = None) -> Array | None:
    """Where the cables hold a rigid platform, (N, n, 3) in m, at positions (N, 3) in m; None for a point mass.

    ``orientation`` (N, 4), unit quaternions, is by default that of the robot file.
    """
    if not robot.platform.is_rigid_body:
        return None
    points = attachment_points(robot, position.T, None if orientation is None else orientation.T)
    return np.array(points).transpose(2, 0, 1)


def pack_columns(values: Array) -> list[str]:
    """Each column packed as base64 of float32."""
    return [pack_float32(column) for column in values.T]


def hull_edges(points: Array) -> list[tuple[int, int]]:
    """Edges of the convex hull of points (n, 3), as pairs of indices: of a body, a polygon or a segment."""
    arms = points - points.mean(axis=0)
    _, extents, axes = np.linalg.svd(arms, full_matrices=False)
    dimension = int(np.sum(extents > FLATNESS * max(float(extents[0]), np.finfo(float).tiny)))
    flat = arms @ axes[:dimension].T
    if dimension < 2:
        ends = (int(np.argmin(flat)), int(np.argmax(flat))) if dimension else (0, 0)
        return [ends] if ends[0] != ends[1] else []
    hull = ConvexHull(flat)
    if dimension == 2:
        return sorted((int(min(pair)), int(max(pair))) for pair in hull.simplices)
    normals: dict[tuple[int, int], list[Array]] = {}
    for triangle, normal in zip(hull.simplices, hull.equations[:, :3], strict=True):
        for first, second in ((0, 1), (1, 2), (0, 2)):
            low, high = sorted((int(triangle[first]), int(triangle[second])))
            normals.setdefault((low, high), []).append(normal)
    # Between two triangles of one face there is no edge.
    return sorted(edge for edge, (a, b) in normals.items() if float(a @ b) < 1.0 - FLATNESS)


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
        "attachments": _attachments_data(scene.attachments),
        "edges": [] if scene.attachments is None else hull_edges(_first_finite(scene.attachments)),
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


def _attachments_data(attachments: Array | None) -> list[list[str]] | None:
    return None if attachments is None else [pack_columns(point) for point in attachments.transpose(1, 0, 2)]


def _first_finite(attachments: Array) -> Array:
    """The attachments (n, 3) in the first frame in which all are known."""
    is_known = np.isfinite(attachments).all(axis=(1, 2))
    return np.asarray(attachments[int(np.argmax(is_known))] if is_known.any() else np.zeros(attachments.shape[1:]))


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
