"""Grids of poses: positions at an orientation or over a range of orientations, and orientations at a position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .kinematics import require_rigid_body, turned_orientation, validated_pose
from .schema import Quaternion, Robot

Array = NDArray[np.float64]
Axes = tuple[Array, Array, Array]

DEFAULT_INTERVALS = 20
MAX_POINTS = 1_000_000
NO_ROTATION = (0.0, 0.0, 0.0)


class PoseGrid(Protocol):
    """A grid over three coordinates, each point with a position in m and the orientations that have to be possible."""

    @property
    def axes(self) -> Axes:
        """The coordinates of the grid."""

    @property
    def axis_names(self) -> tuple[str, str, str]:
        """Their names, in m or rad."""

    @property
    def centre(self) -> tuple[float, float, float]:
        """The point through which slices are drawn."""

    def poses(self, coordinates: Array) -> tuple[Array, tuple[Quaternion, ...]]:
        """Position and orientations at a point of the grid."""


@dataclass(frozen=True)
class PositionGrid:
    """Positions; at each all ``orientations`` have to be possible."""

    axes: Axes
    centre: tuple[float, float, float]
    orientations: tuple[Quaternion, ...]
    axis_names: tuple[str, str, str] = ("x", "y", "z")

    def poses(self, coordinates: Array) -> tuple[Array, tuple[Quaternion, ...]]:
        """The position, and all orientations."""
        return coordinates, self.orientations


@dataclass(frozen=True)
class OrientationGrid:
    """Rotation vectors (rad), along the world's axes, from an ``orientation`` at one position."""

    axes: Axes
    position: Array
    orientation: Quaternion
    centre: tuple[float, float, float] = NO_ROTATION
    axis_names: tuple[str, str, str] = ("rotation_x", "rotation_y", "rotation_z")

    def poses(self, coordinates: Array) -> tuple[Array, tuple[Quaternion, ...]]:
        """The position, and the turned orientation."""
        return self.position, (turned_orientation(self.orientation, coordinates),)


def position_grid(
    robot: Robot,
    lower: Sequence[float] | None = None,
    upper: Sequence[float] | None = None,
    spacing: float | None = None,
    orientation: Sequence[float] | None = None,
    rotation_range: Sequence[float] = NO_ROTATION,
) -> PositionGrid:
    """Positions in a box in m, one of them the robot's start where that is inside.

    ``lower`` and ``upper`` are its corners, by default about all exit points and the start; ``spacing`` in m is by
    default a twentieth of the longest side. Of a rigid platform ``orientation``, by default the declared one, and where
    ``rotation_range`` (rad, about each of the world's axes) is not zero all that are turned from it by none, the least
    or the largest rotation about each axis: 27 at most.

    Raises InputError for an invalid box, spacing or range.
    """
    _, declared = validated_pose("position_grid", robot, None, orientation)
    ranges = _validated_range(robot, rotation_range)
    rotations = product(*((0.0,) if each == 0.0 else (-each, 0.0, each) for each in ranges))
    start = robot.platform.start
    corners = _box(robot, lower, upper)
    axes = _axes(*corners, np.array(start), spacing, "m")
    return PositionGrid(axes, start, tuple(turned_orientation(declared, np.array(each)) for each in rotations))


def orientation_grid(
    robot: Robot,
    rotation_range: Sequence[float],
    position: Sequence[float] | None = None,
    spacing: float | None = None,
    orientation: Sequence[float] | None = None,
) -> OrientationGrid:
    """Orientations at a position in m, by default the start: rotation vectors up to ``rotation_range`` both ways.

    In rad, along the world's axes, from ``orientation``, by default the declared one; ``spacing`` in rad is by default
    a twentieth of the longest side.

    Raises InputError for a point mass, or an invalid range or spacing.
    """
    ranges = np.array(_validated_range(robot, rotation_range))
    require_rigid_body(robot)
    at, declared = validated_pose("orientation_grid", robot, position, orientation)
    return OrientationGrid(_axes(-ranges, ranges, np.zeros(3), spacing, "rad"), at, declared)


def _validated_range(robot: Robot, rotation_range: Sequence[float]) -> list[float]:
    ranges = np.asarray(rotation_range, dtype=float)
    if ranges.shape != (3,) or not np.all((ranges >= 0.0) & (ranges <= np.pi)):
        shown = np.array2string(ranges, separator=", ")
        raise InputError("rotation range", f"{shown} is none", "give three rotations from 0 to pi rad")
    if np.any(ranges > 0.0):
        require_rigid_body(robot)
    return [float(each) for each in ranges]


def _box(robot: Robot, lower: Sequence[float] | None, upper: Sequence[float] | None) -> tuple[Array, Array]:
    points = np.vstack([robot.anchors, robot.platform.start])
    lower_corner = np.min(points, axis=0) if lower is None else np.asarray(lower, dtype=float)
    upper_corner = np.max(points, axis=0) if upper is None else np.asarray(upper, dtype=float)
    if (
        lower_corner.shape != (3,)
        or upper_corner.shape != (3,)
        or not np.all(np.isfinite([lower_corner, upper_corner]))
        or np.any(lower_corner > upper_corner)
    ):
        corners = f"{lower_corner.tolist()} to {upper_corner.tolist()}"
        raise InputError("box", f"{corners} is none", "give three finite coordinates in m each, the lower ones first")
    return lower_corner, upper_corner


def _axes(lower: Array, upper: Array, base: Array, spacing: float | None, unit: str) -> Axes:
    longest = float(np.max(upper - lower))
    step = longest / DEFAULT_INTERVALS if spacing is None else spacing
    if not (np.isfinite(step) and step > 0.0):
        raise InputError("spacing", f"{step:g} {unit} is not positive", f"give a distance in {unit}")
    axes = [_grid_axis(a, b, s, step) for a, b, s in zip(lower, upper, base, strict=True)]
    count = int(np.prod([len(axis) for axis in axes], dtype=float))
    if count > MAX_POINTS:
        raise InputError(
            "spacing", f"{step:g} {unit} makes {count} points, more than {MAX_POINTS}", "give a larger one"
        )
    return axes[0], axes[1], axes[2]


def _grid_axis(lower: float, upper: float, start: float, step: float) -> Array:
    """Grid points from ``lower`` to ``upper``, one of them at the start if it lies between."""
    base = start if lower <= start <= upper else lower
    rounding = 1e-9
    below, above = int((base - lower) / step + rounding), int((upper - base) / step + rounding)
    points: Array = base + step * np.arange(-below, above + 1, dtype=float)
    return points
