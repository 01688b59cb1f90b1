"""From a robot to what the laws take: constants and active effects of each component."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from tautwire_fmu.laws.cable import LAWS, CableConstants
from tautwire_fmu.laws.effects import ActiveEffect
from tautwire_fmu.laws.mathematics import REAL, Mathematics
from tautwire_fmu.laws.point_mass import PointMassConstants

from ..robots.robot import Robot
from ..statics.equilibrium import cable_effects, platform_effects, routes, static_tensions


@dataclass(frozen=True)
class CableComponent:
    """One cable: what is declared of it, and the effects that act in it."""

    constants: CableConstants
    effects: tuple[ActiveEffect, ...]


@dataclass(frozen=True)
class Assembly:
    """A robot as the laws see it; positions in m, the start's velocity in m/s."""

    cables: tuple[CableComponent, ...]
    platform: PointMassConstants
    platform_effects: tuple[ActiveEffect, ...]
    start: tuple[float, float, float]
    velocity: tuple[float, float, float]


def assemble(robot: Robot, start_tensions: Sequence[Any] | None = None, m: Mathematics = REAL) -> Assembly:
    """Gather constants and effects; the static start gives the tensions where none are handed in.

    ``m`` is the mathematics of the effects' parameters.

    Raises UnreachableError where the cables cannot hold the platform at its start.
    """
    tensions = static_tensions(robot) if start_tensions is None else start_tensions
    if robot.release:
        tensions = [tension + beside for tension, beside in zip(tensions, robot.release.tensions, strict=True)]
    lines = routes(m, robot, robot.platform.start)
    cables = tuple(
        CableComponent(
            constants=CableConstants(
                law=LAWS[cable.law],
                anchor=cable.anchor,
                modulus=cable.modulus,
                area=cable.area,
                damping=cable.damping,
                start_length=line.length,
                start_tension=tension,
                start_direction=line.direction,
                gravity=robot.gravity,
            ),
            effects=cable_effects(robot, index),
        )
        for index, (cable, line, tension) in enumerate(zip(robot.cables, lines, tensions, strict=True), start=1)
    )
    return Assembly(
        cables=cables,
        platform=PointMassConstants(robot.platform.mass, robot.gravity),
        platform_effects=platform_effects(robot),
        start=robot.platform.start,
        velocity=robot.release.velocity if robot.release else (0.0, 0.0, 0.0),
    )
