"""Routes of the cables from a platform's attachments to their exit points, effects included."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws.effect_stages import Route
from tautwire_fmu.laws.mathematics import REAL, Mathematics
from tautwire_fmu.laws.rotation import rotate
from tautwire_fmu.laws.vectors import add

from ..errors import UnreachableError
from .active_effects import attachments, cable_effects
from .schema import Robot

Array = NDArray[np.float64]
Points = tuple[Sequence[Any], ...]

MIN_CABLE_LENGTH = 1e-6


def attachment_points(robot: Robot, position: Sequence[Any], orientation: Sequence[Any] | None = None) -> Points:
    """Where the cables hold the platform in the world, in m; ``orientation`` is by default that of the robot file."""
    if not robot.platform.is_rigid_body:
        return (position,) * robot.cable_count
    quaternion = robot.platform.start_orientation if orientation is None else orientation
    return tuple(add(position, rotate(quaternion, attachment)) for attachment in attachments(robot))


def cable_routes(
    mathematics: Mathematics, robot: Robot, position: Sequence[Any], orientation: Sequence[Any] | None = None
) -> tuple[Route, ...]:
    """Routes of the cables from the platform at a position (m) to their exit points, effects included.

    A rigid platform has an ``orientation`` (unit quaternion), by default that of the robot file.

    Raises UnreachableError where a cable has no length there, or the platform is inside a pulley.
    """
    route_list = []
    points = attachment_points(robot, position, orientation)
    for index, (cable, point) in enumerate(zip(robot.cables, points, strict=True), start=1):
        try:
            route = stages.route(mathematics, cable_effects(robot, index), cable.anchor, point, cable.swivel_axis)
        except (ArithmeticError, ValueError) as error:
            raise unreachable_error(robot, position, f"cable {index} has no length there", index) from error
        if isinstance(route.length, float) and not route.length >= MIN_CABLE_LENGTH:
            raise unreachable_error(robot, position, f"cable {index} has no length there", index)
        route_list.append(route)
    return tuple(route_list)


def unit_directions(robot: Robot, at: Array | None = None) -> Array:
    """Unit vectors of the cables at the platform, by default at its start, shape (3, n)."""
    position = np.array(robot.platform.start if at is None else at, dtype=float)
    return np.array([route.direction for route in cable_routes(REAL, robot, position.tolist())]).T


def unreachable_error(
    robot: Robot, position: Iterable[Any], reason: str, cable: int | None = None, tension: float | None = None
) -> UnreachableError:
    """The error about a position (m) that the cables cannot hold."""
    return UnreachableError(robot.name, tuple(map(float, position)), cable=cable, tension=tension, reason=reason)
