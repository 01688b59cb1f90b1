"""Limits within which an excitation moves a robot: winch speed, reach, rotation and tensions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..robot.rigid_equilibrium import FREEDOMS, platform_size
from ..robot.schema import Robot
from ..robot.static_equilibrium import static_tensions

DEFAULT_SPEED_LIMIT = 0.5
# Shares of the mean rope length, of the smallest and of the largest static tension.
DEFAULT_REACH_RATIO, MIN_TENSION_RATIO, MAX_TENSION_RATIO = 0.05, 0.1, 3.0
# rad, of a platform that turns; attachments then move about as far as its origin does.
MAX_DEFAULT_TURN = 0.2


@dataclass(frozen=True)
class ExcitationLimits:
    """Limits of an excitation: winch speed in m/s, distance from the start along each axis in m, tensions in N.

    ``turn``, in rad, limits the rotation about each axis of a platform that six cables or more turn.
    """

    speed: float
    reach: float
    min_tension: float
    max_tension: float
    turn: float = 0.0


def default_limits(robot: Robot, speed: float | None = None, reach: float | None = None) -> ExcitationLimits:
    """Default limits: [winch] speed_limit or 0.5 m/s, a twentieth of the mean rope length, and [tension].

    Without [tension] a tenth of the least static tension to three times the largest.
    """
    if robot.platform.is_rigid_body and robot.cable_count < FREEDOMS:
        problem = f"has a platform on {robot.cable_count} cables, whose orientation statics decides along a path"
        raise InputError(robot.name, problem, "record a motion of your own; six cables or more turn it as designed")
    tensions = static_tensions(robot)
    lengths = np.linalg.norm(np.array(robot.anchors) - np.array(robot.platform.start), axis=1)
    declared_speed = robot.winch.speed_limit if robot.winch else None
    distance = reach or DEFAULT_REACH_RATIO * float(np.mean(lengths))
    return ExcitationLimits(
        speed=speed or declared_speed or DEFAULT_SPEED_LIMIT,
        reach=distance,
        min_tension=robot.tension.minimum if robot.tension else MIN_TENSION_RATIO * float(np.min(tensions)),
        max_tension=robot.tension.maximum if robot.tension else MAX_TENSION_RATIO * float(np.max(tensions)),
        turn=min(MAX_DEFAULT_TURN, distance / platform_size(robot)) if can_turn(robot) else 0.0,
    )


def can_turn(robot: Robot) -> bool:
    """Whether the winches can turn the platform as they like: fewer cables leave its orientation to statics."""
    return robot.platform.is_rigid_body and robot.cable_count >= FREEDOMS
