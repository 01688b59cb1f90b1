"""Assembles a robot for the physical laws: constants and active effects of each component; NumPy mathematics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.cable import LAWS, CableConstants, with_start_cell_tension
from tautwire_fmu.laws.effects import ActiveEffect
from tautwire_fmu.laws.mathematics import REAL, Mathematics
from tautwire_fmu.laws.point_mass import PointMassConstants

from .active_effects import cable_effects, platform_effects
from .cable_routes import cable_routes
from .schema import Robot
from .static_equilibrium import start_orientation, static_tensions

NUMPY_MATHEMATICS = Mathematics(
    log=np.log,
    exp=np.exp,
    sqrt=np.sqrt,
    sin=np.sin,
    cos=np.cos,
    tanh=np.tanh,
    atan2=np.arctan2,
    absolute=np.abs,
    maximum=np.maximum,
    where=lambda condition, a, b: np.where(condition > 0.0, a, b),
)


@dataclass(frozen=True)
class CableComponent:
    """One cable: its declared constants, and the effects that act in it."""

    constants: CableConstants
    effects: tuple[ActiveEffect, ...]


@dataclass(frozen=True)
class RobotAssembly:
    """A robot as the laws take it; positions in m, the initial velocity in m/s, and angular velocity in rad/s."""

    cables: tuple[CableComponent, ...]
    platform: PointMassConstants
    platform_effects: tuple[ActiveEffect, ...]
    start: tuple[float, float, float]
    velocity: tuple[float, float, float]
    angular_velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)


def assemble_robot(
    robot: Robot,
    start_tensions: Sequence[Any] | None = None,
    mathematics: Mathematics = REAL,
    orientation: Sequence[Any] | None = None,
) -> RobotAssembly:
    """Assembles constants and effects; start tensions and orientation are by default those of static equilibrium.

    ``mathematics`` are the functions for the effects' parameters.

    Raises UnreachableError where the cables cannot hold the platform at its start.
    """
    tensions = static_tensions(robot) if start_tensions is None else start_tensions
    if robot.initial_state:
        tensions = [tension + beside for tension, beside in zip(tensions, robot.initial_state.tensions, strict=True)]
    if orientation is None:
        orientation = start_orientation(robot)
    cables = cable_components(robot, tensions, mathematics, robot.platform.start, orientation)
    return RobotAssembly(
        cables=cables,
        platform=PointMassConstants(robot.platform.mass, robot.gravity),
        platform_effects=platform_effects(robot),
        start=robot.platform.start,
        velocity=robot.initial_state.velocity if robot.initial_state else (0.0, 0.0, 0.0),
        angular_velocity=robot.initial_state.angular_velocity if robot.initial_state else (0.0, 0.0, 0.0),
    )


def cable_components(
    robot: Robot,
    tensions: Sequence[Any] | NDArray[np.float64],
    mathematics: Mathematics,
    position: Sequence[Any],
    orientation: Sequence[Any],
) -> tuple[CableComponent, ...]:
    """The cables of a robot that rests at a pose (m, unit quaternion) under tensions (n,) in N."""
    routes = cable_routes(mathematics, robot, position, orientation)
    components = []
    for index, (cable, route, tension) in enumerate(zip(robot.cables, routes, tensions, strict=True), start=1):
        constants = CableConstants(
            law=LAWS[cable.law],
            anchor=cable.anchor,
            modulus=cable.modulus,
            area=cable.area,
            damping=cable.damping,
            start_length=route.length,
            start_tension=tension,
            start_direction=route.direction,
            gravity=robot.gravity,
            swivel_axis=cable.swivel_axis,
        )
        effects = cable_effects(robot, index)
        constants = with_start_cell_tension(mathematics, constants, effects, route.chord)
        components.append(CableComponent(constants, effects))
    return tuple(components)
