"""Vertical of a robot file that was written for gravity along another axis than -z."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..errors import UnreachableError
from .schema import Point, Robot
from .static_equilibrium import static_tensions

# By the axis of the file that points upwards: the file's numbers that are to stand for x, y, z, and the turn to these.
COORDINATES: Mapping[str, tuple[str, NDArray[np.float64]]] = {
    "x": ("-z, y, x", np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])),
    "-x": ("z, y, -x", np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])),
    "y": ("x, -z, y", np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])),
    "-y": ("x, z, -y", np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])),
    "-z": ("x, -y, -z", np.diag([1.0, -1.0, -1.0])),
}


def require_held_at_start(robot: Robot) -> None:
    """Raises UnreachableError where the cables cannot hold the platform at its start.

    The hint tells another vertical too where they hold it with one, and with one only.
    """
    try:
        static_tensions(robot)
    except UnreachableError as error:
        upward = [axis for axis, (_, turn) in COORDINATES.items() if _is_held(_turned(robot, turn))]
        if len(upward) != 1:
            raise
        (axis,) = upward
        hint = (
            f"{error.hint}; gravity acts along -z, and with {axis} upwards the cables hold it: if the file has it so, "
            f"write {COORDINATES[axis][0]} in place of x, y, z of all anchors and the start, and turn the recording "
            "alike"
        )
        where, reason = error.where, error.reason
        raise UnreachableError(where, error.position, error.cable, error.tension, reason, hint) from error


def _is_held(robot: Robot) -> bool:
    try:
        static_tensions(robot)
    except UnreachableError:
        return False
    return True


def _turned(robot: Robot, turn: NDArray[np.float64]) -> Robot:
    """The robot with its world turned; points of a rigid platform turn with its orientation."""

    def point(coordinates: Point) -> Point:
        x, y, z = (turn @ np.array(coordinates)).tolist()
        return x, y, z

    w, *vector = robot.platform.start_orientation
    x, y, z, scalar = (Rotation.from_matrix(turn) * Rotation.from_quat([*vector, w])).as_quat().tolist()
    platform = replace(robot.platform, start=point(robot.platform.start), start_orientation=(scalar, x, y, z))
    cables = tuple(replace(cable, anchor=point(cable.anchor)) for cable in robot.cables)
    return replace(robot, platform=platform, cables=cables)
