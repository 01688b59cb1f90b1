"""The start of a run as the position sensor shows it, and the true one: they differ by the sensor's gain and offset."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws.mathematics import REAL, Mathematics
from tautwire_fmu.laws.vectors import Vector, add, scale

from .active_effects import platform_effects
from .schema import Point, Quaternion, Robot


def shown_position(robot: Robot, position: Vector, mathematics: Mathematics = REAL) -> Vector:
    """A position ``p`` in m as the position sensor shows it, ``k p + o`` with its gain and offset.

    ``mathematics`` are the functions for the effects' parameters.
    """
    gain, offset = _gain_and_offset(robot, mathematics)
    return add(scale(gain, position), offset)


def true_position(robot: Robot, shown: Vector, mathematics: Mathematics = REAL) -> Vector:
    """The position ``(y - o) / k`` in m of which the sensor shows ``y``; also of columns, each with its coordinate."""
    gain, offset = _gain_and_offset(robot, mathematics)
    x, y, z = ((coordinate - error) / gain for coordinate, error in zip(shown, offset, strict=True))
    return x, y, z


def with_measured_start(robot: Robot, start: Point, orientation: Quaternion | None = None) -> Robot:
    """The robot at the start of a recording, in m: by axis as declared, or another one, as the sensor shows it.

    An ``orientation`` that is not None takes the place of the declared one.
    """
    if orientation is not None:
        robot = replace(robot, platform=replace(robot.platform, start_orientation=orientation))
    if start == robot.platform.start:
        return robot
    x, y, z = (measured != declared for measured, declared in zip(start, robot.platform.start, strict=True))
    return replace(robot, platform=replace(robot.platform, start=start), start_is_measured=(x, y, z))


def with_true_start(robot: Robot, mathematics: Mathematics = REAL) -> Robot:
    """The robot at its true start, ``(y - o) / k`` along each axis on which the start is a measured one, ``y``."""
    if not any(robot.start_is_measured):
        return robot
    true = true_position(robot, robot.platform.start, mathematics)
    x, y, z = (
        corrected if is_measured else coordinate
        for coordinate, corrected, is_measured in zip(robot.platform.start, true, robot.start_is_measured, strict=True)
    )
    true_platform = replace(robot.platform, start=(x, y, z))
    return replace(robot, platform=true_platform, start_is_measured=(False, False, False))


def _gain_and_offset(robot: Robot, mathematics: Mathematics) -> tuple[Any, Vector]:
    """Gain and offset of the position sensor."""
    effects = platform_effects(robot)
    _, gain = stages.sensor_gains(mathematics, effects)
    _, offset = stages.sensor_offsets(mathematics, effects)
    return gain, offset
