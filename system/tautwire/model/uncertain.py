"""Declared numbers that are not quite known, as states that never move.

Such a state is counted in standard deviations ``s`` of what the robot file says: the number is ``declared + s d``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from ..robots.robot import Robot

AXES = ("x", "y", "z")
MODULUS, DAMPING, MASS = "modulus", "damping", "mass"
TENSION_OFFSET, POSITION_OFFSET = "tension_offset", "position_offset"
UNITS = {MODULUS: "Pa", DAMPING: "Pa s", MASS: "kg", TENSION_OFFSET: "N", POSITION_OFFSET: "m"}


@dataclass(frozen=True)
class UncertainNumber:
    """One of them: what it is, of which cable or axis (from 1, 0 of the platform), and its standard deviation in SI."""

    kind: str
    place: int
    deviation: float

    @property
    def unit(self) -> str:
        """As in ``Pa s``."""
        return UNITS[self.kind]

    def declared(self, robot: Robot) -> float:
        """What the robot file has; nothing is declared of a sensor's constant error, which is zero then."""
        if self.kind == MASS:
            return robot.platform.mass
        if self.kind in (MODULUS, DAMPING):
            return float(getattr(robot.cables[self.place - 1], self.kind))
        return 0.0

    @property
    def label(self) -> str:
        """As in ``modulus of cable 2``."""
        if self.kind == MASS:
            return MASS
        if self.kind == POSITION_OFFSET:
            return f"offset of {AXES[self.place - 1]}"
        return f"{'offset of tension' if self.kind == TENSION_OFFSET else f'{self.kind} of cable'} {self.place}"


def uncertain_numbers(robot: Robot) -> tuple[UncertainNumber, ...]:
    """All numbers for which the robot file states an uncertainty above zero."""
    sensors = robot.sensors
    found = [UncertainNumber(MASS, 0, robot.platform.mass_uncertainty)]
    for place, cable in enumerate(robot.cables, start=1):
        found.append(UncertainNumber(MODULUS, place, cable.modulus_uncertainty))
        found.append(UncertainNumber(DAMPING, place, cable.damping_uncertainty))
        found.append(UncertainNumber(TENSION_OFFSET, place, sensors.tension_offset_uncertainty))
    found += [UncertainNumber(POSITION_OFFSET, axis, sensors.position_offset_uncertainty) for axis in (1, 2, 3)]
    return tuple(number for number in found if number.deviation > 0.0)


def with_moves(robot: Robot, numbers: Sequence[UncertainNumber], moves: Sequence[Any]) -> Robot:
    """The robot whose declared numbers are moved by so many standard deviations each; offsets are no part of it."""
    platform, cables = robot.platform, list(robot.cables)
    for number, move in zip(numbers, moves, strict=True):
        step = number.deviation * move
        if number.kind == MASS:
            platform = replace(platform, mass=platform.mass + step)
        elif number.kind in (MODULUS, DAMPING):
            old = cables[number.place - 1]
            cables[number.place - 1] = replace(old, **{number.kind: getattr(old, number.kind) + step})
    return replace(robot, platform=platform, cables=tuple(cables))


def offsets(numbers: Sequence[UncertainNumber], moves: Sequence[Any], cable_count: int) -> list[Any]:
    """What sensors add to x, y, z (m) and to each tension (N), by so many standard deviations each."""
    found: list[Any] = [0.0] * (3 + cable_count)
    for number, move in zip(numbers, moves, strict=True):
        if number.kind == POSITION_OFFSET:
            found[number.place - 1] = number.deviation * move
        elif number.kind == TENSION_OFFSET:
            found[2 + number.place] = number.deviation * move
    return found
