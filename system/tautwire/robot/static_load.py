"""Static load on the cables: weight less the forces of effects, and what cables weigh themselves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import log
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws import point_mass
from tautwire_fmu.laws.effect_stages import Route
from tautwire_fmu.laws.effects import SLACK
from tautwire_fmu.laws.mathematics import REAL, Mathematics
from tautwire_fmu.laws.vectors import Vector, add, subtract

from .active_effects import cable_effects, platform_effects, total_mass
from .cable_routes import cable_routes
from .schema import Robot

Array = NDArray[np.float64]

MAX_ITERATIONS = 50
CONVERGENCE_TOLERANCE = 1e-14


def total_weight(robot: Robot, mathematics: Mathematics = REAL) -> Any:
    """Weight of the platform with payload, in N."""
    return total_mass(robot, mathematics) * robot.gravity


def static_load(mathematics: Mathematics, robot: Robot, position: Sequence[Any]) -> Vector:
    """Static load on the cables, in N: the platform's weight less the forces of effects."""
    effects = platform_effects(robot)
    effect_force = point_mass.wrench(mathematics, effects, point_mass.start_states(effects), position, (0.0, 0.0, 0.0))
    return subtract((0.0, 0.0, total_weight(robot, mathematics)), effect_force)


def cable_weight_force(
    mathematics: Mathematics, robot: Robot, routes: Sequence[Route], tensions: Sequence[Any]
) -> Vector:
    """Force of cables under tensions (N) on the platform on top of these tensions, in N."""
    total: Vector = (0.0, 0.0, 0.0)
    for index, (route, tension) in enumerate(zip(routes, tensions, strict=True), start=1):
        total = add(
            total, stages.end_forces(mathematics, cable_effects(robot, index), robot.gravity, route, tension)[0]
        )
    return total


def load_on_tensions(robot: Robot, position: Sequence[float], tensions: Array) -> Array:
    """Load that tensions (n,) in N along the cables balance at a position (m), (3,) in N."""
    routes = cable_routes(REAL, robot, position)
    weight_force = cable_weight_force(REAL, robot, routes, tensions.tolist())
    return np.array(subtract(static_load(REAL, robot, position), weight_force), dtype=float)


def fixed_point(iterate: Callable[[Array], Array], guess: Array) -> Array:
    """Tensions by fixed-point iteration, which is a strong contraction: cables are light against their tensions."""
    tensions = guess
    for _ in range(MAX_ITERATIONS):
        previous, tensions = tensions, iterate(tensions)
        if np.max(np.abs(tensions - previous)) <= CONVERGENCE_TOLERANCE * np.max(tensions):
            break
    return tensions


def slack_tensions(robot: Robot) -> Array:
    """Tension (n,) in N of a cable that nothing pulls at: zero, or ``s ln 2`` of the effect slack's softness s."""
    tension = np.zeros(robot.cable_count)
    for setting in robot.effects:
        if setting.name == SLACK.name:
            tension[[cable - 1 for cable in setting.cables]] = setting.values["softness"] * log(2.0)
    return tension
