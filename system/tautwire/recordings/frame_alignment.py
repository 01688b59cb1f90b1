"""Alignment of a tracker's frame with the robot's, by forward kinematics of the winches and Procrustes analysis."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from ..robot.schema import AXES, Robot
from .alternative_readings import LENGTH_UNITS
from .geometry_reading import IDENTITY, GeometryReading, RecordedPoses, signed_axes

Array = NDArray[np.float64]

ROWS_USED, NEWTON_STEPS = 200, 30
# Singular values of positions over the largest: below it they are on a line, or in a plane.
MIN_SINGULAR_RATIO = 0.02
MAX_SCALE_ERROR = 0.1
# Axes that are nearer to those of the robot file, or to others of the tracker, are these.
MAX_AXES_ERROR = np.radians(3.0)
WORLD_UNITS = ("m", "mm")
INSIDE_PULLEY = 1e6  # m, an error of lengths where a position has none


def aligned_frames(robot: Robot, poses: RecordedPoses, wound: Array) -> Iterator[GeometryReading]:
    """Frames of recorded poses (M,) in which they follow the lengths (M, n) that the winches wound.

    Positions by forward kinematics from the declared start give unit, axes and rotation by Procrustes analysis
    (Umeyama 1991); the origin, and a rotation that is none of the axes alone, then fit the lengths. First with the axes
    as they are, then as they fit; of a rigid platform worlds in which it begins turned as declared. None along a line,
    of no unit, or where a coordinate in the robot's plane is missing.
    """
    rows = slice(None, None, max(1, len(wound) // ROWS_USED))
    poses, wound = RecordedPoses(poses.position[rows], poses.orientation[rows]), wound[rows]
    yield _with_fitted_frame(robot, GeometryReading(), poses, wound, is_turned=False)
    recorded, in_plane = poses.position, list(robot.axes_in_plane)
    if robot.platform.is_rigid_body:
        yield from _turned_worlds(robot, poses, wound)
        return
    if not np.isfinite(recorded[:, in_plane]).all():
        return
    scale, axes = _procrustes(recorded[:, in_plane], forward_kinematics_of_travel(robot, wound)[:, in_plane])
    unit = min(LENGTH_UNITS, key=lambda symbol: abs(np.log(max(scale, 1e-300) / LENGTH_UNITS[symbol])))
    if axes is None or abs(scale / LENGTH_UNITS[unit] - 1.0) > MAX_SCALE_ERROR:
        return
    turned = np.eye(len(AXES))
    turned[np.ix_(in_plane, in_plane)] = axes
    geometry, error = _nearest_axes(turned, unit)
    geometry = geometry if error > MAX_AXES_ERROR else replace(geometry, rotation=IDENTITY)
    yield _with_fitted_frame(robot, geometry, poses, wound, is_turned=error > MAX_AXES_ERROR)


def _turned_worlds(robot: Robot, poses: RecordedPoses, wound: Array) -> Iterator[GeometryReading]:
    """Worlds turned against the robot file's, in which a rigid platform begins as declared: along axes, or as fits."""
    if not np.isfinite(poses.orientation[0]).all() or not np.isfinite(poses.position).all():
        return
    declared, shown = (
        Rotation.from_quat(np.asarray(quaternion)[[1, 2, 3, 0]])
        for quaternion in (robot.platform.start_orientation, poses.orientation[0])
    )
    turn = (declared * shown.inv()).as_matrix()
    axes, error = _nearest_axes(turn, "m")
    along_axes = np.eye(len(AXES))[list(axes.axes)] * np.array(axes.signs)[:, None]
    is_turned = error > MAX_AXES_ERROR
    matrix = turn if is_turned else along_axes
    if np.allclose(matrix, np.eye(len(AXES))):
        return
    for unit in WORLD_UNITS:
        geometry = GeometryReading(unit, rotation=tuple(tuple(row) for row in matrix.tolist()))
        yield _with_fitted_frame(robot, geometry, poses, wound, is_turned)


def forward_kinematics_of_travel(robot: Robot, wound: Array) -> Array:
    """Positions (M, 3) of a point mass, by Gauss and Newton, at which straight ropes have the lengths wound (M, n)."""
    anchors, in_plane = np.array(robot.anchors), list(robot.axes_in_plane)
    positions = np.tile(np.array(robot.platform.start, dtype=float), (len(wound), 1))
    lengths = np.linalg.norm(anchors - positions[:1], axis=1) - (wound - wound[0])
    for _ in range(NEWTON_STEPS):
        vectors = positions[:, None] - anchors
        distances = np.maximum(np.linalg.norm(vectors, axis=2), 1e-9)
        jacobian = (vectors / distances[..., None])[..., in_plane]
        positions[:, in_plane] += np.einsum("mij,mj->mi", np.linalg.pinv(jacobian), lengths - distances)
    return positions


def _procrustes(recorded: Array, positions: Array) -> tuple[float, Array | None]:
    """Scale and orthogonal matrix that map recorded positions on others, both (M, d); no matrix along a line."""
    recorded, positions = recorded - recorded.mean(axis=0), positions - positions.mean(axis=0)
    spread = np.linalg.svd(recorded, compute_uv=False)
    left, values, right = np.linalg.svd(positions.T @ recorded)
    scale = float(values.sum() / max(np.sum(spread**2), 1e-300))
    if spread[1] < MIN_SINGULAR_RATIO * spread[0]:
        return scale, None
    mirror = np.ones(len(values))
    if spread[-1] < MIN_SINGULAR_RATIO * spread[0]:
        # Positions in a plane do not tell an axis across it from its mirror image.
        mirror[-1] = np.sign(np.linalg.det(left) * np.linalg.det(right))
    return scale, np.asarray(left @ np.diag(mirror) @ right)


def _nearest_axes(orthogonal: Array, unit: str) -> tuple[GeometryReading, float]:
    """The signed order of axes nearest to an orthogonal matrix, its mirror image included, and the angle in between."""
    sides = [
        (order, signs)
        for order, signs in signed_axes()
        if np.linalg.det(np.eye(len(AXES))[list(order)] * np.array(signs)[:, None]) * np.linalg.det(orthogonal) > 0.0
    ]

    def between(order: tuple[int, ...], signs: tuple[int, ...]) -> Array:
        return np.asarray(orthogonal @ (np.eye(len(AXES))[list(order)] * np.array(signs)[:, None]).T)

    order, signs = max(sides, key=lambda side: float(np.trace(between(*side))))
    turned = between(order, signs)
    angle = float(np.arccos(np.clip((np.trace(turned) - 1.0) / 2.0, -1.0, 1.0)))
    rotation = tuple(tuple(row) for row in turned.tolist())
    return GeometryReading(unit, axes=order, signs=signs, rotation=rotation), angle


def _with_fitted_frame(
    robot: Robot, geometry: GeometryReading, poses: RecordedPoses, wound: Array, is_turned: bool
) -> GeometryReading:
    """The geometry with the origin in the robot's plane, and the rotation if it is turned, that fit lengths best."""
    axes = list(robot.axes_in_plane)
    turned = Rotation.from_matrix(geometry.rotation if is_turned else np.eye(len(AXES))).as_rotvec()
    free = [axis for axis in range(len(AXES)) if len(axes) == len(AXES) or axis not in axes] if is_turned else []

    def frame(parameters: Array) -> GeometryReading:
        origin, vector = np.zeros(len(AXES)), turned.copy()
        origin[axes], vector[free] = parameters[: len(axes)], parameters[len(axes) :]
        rotation = geometry.rotation
        if is_turned:
            rotation = tuple(tuple(row) for row in Rotation.from_rotvec(vector).as_matrix().tolist())
        return replace(geometry, origin=tuple(origin.tolist()), rotation=rotation)

    def errors(parameters: Array) -> Array:
        lengths = frame(parameters).directions(robot, poses)[0] + wound
        return np.nan_to_num((lengths - lengths.mean(axis=0)).ravel(), nan=INSIDE_PULLEY)

    at_start = frame(np.concatenate([np.zeros(len(axes)), turned[free]])).positions(robot, poses)[0]
    start = (np.array(robot.platform.start) - at_start)[axes]
    return frame(least_squares(errors, np.concatenate([start, turned[free]]), loss="soft_l1").x)
