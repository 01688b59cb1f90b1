"""Static equilibrium at a position: tensions solved for three cables, distributed for more."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws import point_mass
from tautwire_fmu.laws.effect_stages import Route
from tautwire_fmu.laws.effects import BY_NAME, ActiveEffect
from tautwire_fmu.laws.formula import formula_effect
from tautwire_fmu.laws.mathematics import REAL, Mathematics
from tautwire_fmu.laws.vectors import Vector, add, scale, subtract

from ..errors import UnreachableError
from .schema import EffectSetting, Formula, Robot, TensionLimits

Array = NDArray[np.float64]

BALANCE_TOLERANCE = 1e-6


def distribute_tensions(unit_directions: Array, load: Array, limits: TensionLimits) -> Array | None:
    """Tension distribution: the feasible tensions nearest to the preferred one that balance a load, shape (n,), in N.

    ``min |T - T_p|^2`` with ``U T = w``, ``T_min <= T_i <= T_max``. Their dependence on ``U`` and ``w`` is
    continuous, as the objective is strictly convex. ``unit_directions`` U (3, n) points from the platform to the exit
    points, ``load`` w (3,) is in N. None if no tensions are feasible.
    """
    count = unit_directions.shape[1]
    problem: Any = {"h": casadi.Sparsity.dense(count, count), "a": casadi.Sparsity.dense(3, count)}
    solver = casadi.conic("tension_distribution", "daqp", problem, {"error_on_fail": False})
    scale = max(float(np.linalg.norm(load)), 1.0)
    solution = solver(
        h=np.eye(count),
        g=-np.full(count, limits.preferred / scale),
        a=unit_directions,
        lba=load / scale,
        uba=load / scale,
        lbx=limits.minimum / scale,
        ubx=limits.maximum / scale,
    )
    tensions: Array = np.asarray(solution["x"], dtype=float).ravel() * scale
    # The solver ignores a row of zeros, as with cables in one plane.
    is_balanced = np.linalg.norm(unit_directions @ tensions - load) <= BALANCE_TOLERANCE * scale
    return tensions if solver.stats()["success"] and is_balanced else None


def least_limit_violations(unit_directions: Array, load: Array, limits: TensionLimits) -> Array:
    """Least violation of the tension limits that balances a load, shape (n,), in N; negative below, positive above.

    ``min |s|^2`` with ``U (b + s) = w``, ``T_min <= b_i <= T_max``: of all tensions ``b + s`` that balance the
    load, those that violate the limits least. Cables that need not violate them have zero. Not a number where the
    cables cannot exert the load at all, such as cables in one plane.
    """
    scale = max(float(np.linalg.norm(load)), 1.0)
    left_vectors, singular_values, _ = np.linalg.svd(unit_directions, full_matrices=False)
    spanned = singular_values > 1e-9 * singular_values[0]
    rows = (left_vectors[:, spanned] / singular_values[spanned]).T
    unreachable_load = load - left_vectors[:, spanned] @ (left_vectors[:, spanned].T @ load)
    if np.linalg.norm(unreachable_load) > 1e-9 * scale:
        return np.full(unit_directions.shape[1], np.nan)
    solution = lsq_linear(
        rows @ unit_directions,
        rows @ load / scale,
        bounds=(limits.minimum / scale, limits.maximum / scale),
        method="bvls",
    )
    excess: Array = scale * unit_directions.T @ (rows.T @ (rows @ load / scale - rows @ unit_directions @ solution.x))
    return excess


DEFAULT_LIMITS = TensionLimits(minimum=0.0, maximum=float("inf"), preferred=0.0)
SINGULARITY_TOLERANCE = 1e-9
MIN_CABLE_LENGTH = 1e-6
MAX_ITERATIONS = 50
CONVERGENCE_TOLERANCE = 1e-14


def active_effect(setting: EffectSetting) -> ActiveEffect:
    """An effect setting with its parameter values, as the laws take it."""
    effect = BY_NAME[setting.name]
    return ActiveEffect(effect, effect.values(**effect.completed_values(setting.values)))


def cable_effects(robot: Robot, cable: int) -> tuple[ActiveEffect, ...]:
    """The effects and formulas that act on a cable, its winch or its load cell; ``cable`` counts from 1."""
    return (*map(active_effect, robot.effects_on_cable(cable)), *_formula_effects(robot.formulas_on(cable)))


def formula_texts(formulas: Sequence[Formula]) -> dict[str, list[str]]:
    """The texts of some formulas by their targets."""
    return {
        place: [f.text for f in formulas if f.target == place] for place in dict.fromkeys(f.target for f in formulas)
    }


def _formula_effects(formulas: Sequence[Formula]) -> tuple[ActiveEffect, ...]:
    """All formulas of a component as one effect; empty without formulas."""
    if not formulas:
        return ()
    numbers = {name: value for formula in formulas for name, value in formula.numbers.items()}
    return (ActiveEffect(formula_effect(formula_texts(formulas), tuple(numbers)), numbers),)


def platform_settings(robot: Robot) -> tuple[EffectSetting, ...]:
    """The effect settings that act on the platform or on its position sensor."""
    return tuple(s for s in robot.effects if not s.cables or BY_NAME[s.name].component == "sensor")


def has_sensor_effects(robot: Robot) -> bool:
    """Whether an effect distorts the measurements."""
    return any(BY_NAME[setting.name].component == "sensor" for setting in robot.effects)


def platform_effects(robot: Robot) -> tuple[ActiveEffect, ...]:
    """The effects of :func:`platform_settings` and the formulas on the platform, as the laws take them."""
    return (*map(active_effect, platform_settings(robot)), *_formula_effects(robot.formulas_on()))


def cable_routes(mathematics: Mathematics, robot: Robot, position: Sequence[Any]) -> tuple[Route, ...]:
    """Routes of the cables from the platform at a position (m) to their exit points, effects included.

    Raises UnreachableError where a cable has no length there, or the platform is inside a pulley.
    """
    route_list = []
    for index, anchor in enumerate(robot.anchors, start=1):
        try:
            route = stages.route(mathematics, cable_effects(robot, index), anchor, position)
        except (ArithmeticError, ValueError) as error:
            raise _no_length_error(robot, position, index) from error
        if isinstance(route.length, float) and not route.length >= MIN_CABLE_LENGTH:
            raise _no_length_error(robot, position, index)
        route_list.append(route)
    return tuple(route_list)


def unit_directions(robot: Robot, at: Array | None = None) -> Array:
    """Unit vectors of the cables at the platform, by default at its start, shape (3, n)."""
    position = np.array(robot.platform.start if at is None else at, dtype=float)
    return np.array([line.direction for line in cable_routes(REAL, robot, position.tolist())]).T


def total_weight(robot: Robot, mathematics: Mathematics = REAL) -> Any:
    """Weight of the platform with payload, in N."""
    constants = point_mass.PointMassConstants(robot.platform.mass, robot.gravity)
    return point_mass.total_mass(mathematics, constants, platform_effects(robot)) * robot.gravity


def static_load(mathematics: Mathematics, robot: Robot, position: Sequence[Any]) -> Vector:
    """Static load on the cables, in N: the platform's weight less the forces of effects."""
    effects = platform_effects(robot)
    effect_force = point_mass.wrench(mathematics, effects, point_mass.start_states(effects), position, (0.0, 0.0, 0.0))
    return subtract((0.0, 0.0, total_weight(robot, mathematics)), effect_force)


def has_routing_effects(robot: Robot) -> bool:
    """Whether a cable does not run straight to its declared exit point."""
    effects = (BY_NAME[setting.name] for setting in robot.effects)
    return any(effect.exit_point is not None or effect.path is not None for effect in effects)


def cables_have_weight(robot: Robot) -> bool:
    """Whether the cables have weight, so that their ends carry more than the tension."""
    return any(BY_NAME[setting.name].ends is not None for setting in robot.effects)


def cable_weight_force(
    mathematics: Mathematics, robot: Robot, cable_paths: Sequence[Route], tensions: Sequence[Any]
) -> Vector:
    """Force of cables under tensions (N) on the platform on top of these tensions, in N."""
    total: Vector = (0.0, 0.0, 0.0)
    for index, (route, tension) in enumerate(zip(cable_paths, tensions, strict=True), start=1):
        total = add(
            total, stages.end_forces(mathematics, cable_effects(robot, index), robot.gravity, route, tension)[0]
        )
    return total


def load_on_tensions(robot: Robot, position: Sequence[float], tensions: Array) -> Array:
    """Load that tensions (n,) in N along the cables balance at a position (m), (3,) in N."""
    cable_paths = cable_routes(REAL, robot, position)
    weight_force = cable_weight_force(REAL, robot, cable_paths, tensions.tolist())
    return np.array(subtract(static_load(REAL, robot, position), weight_force), dtype=float)


def static_tensions(robot: Robot, at: Array | None = None) -> Array:
    """Static tensions that hold the platform in equilibrium, shape (n,), in N.

    Solves ``sum T_i u_i = m g e_z``, with the loads of effects and the weight of cables. With more than three
    cables, the tensions nearest to the preferred one (least squares) within the limits of the robot file; without
    limits there, nearest to zero and not negative. ``at`` is a position in m, by default the start.

    Raises UnreachableError where a cable would have to push or to break a limit.
    """
    position = np.array(robot.platform.start if at is None else at, dtype=float)
    cable_paths = cable_routes(REAL, robot, position.tolist())
    direction_matrix = np.array([line.direction for line in cable_paths]).T
    load_vector = np.array(static_load(REAL, robot, position.tolist()), dtype=float)
    solver = _solve_three if len(robot.cables) == 3 else _distribute
    if not cables_have_weight(robot):
        return solver(robot, position, direction_matrix, load_vector)

    def iterate(tensions: Array) -> Array:
        return solver(
            robot,
            position,
            direction_matrix,
            load_vector - np.array(cable_weight_force(REAL, robot, cable_paths, tensions.tolist())),
        )

    return _fixed_point(iterate, np.full(len(cable_paths), float(np.linalg.norm(load_vector))))


def static_forces(robot: Robot) -> Array:
    """Forces of the cables on the platform at its start, shape (n, 3), in N."""
    cable_paths = cable_routes(REAL, robot, robot.platform.start)
    forces = []
    for index, (route, tension) in enumerate(zip(cable_paths, static_tensions(robot).tolist(), strict=True), start=1):
        weight_force = stages.end_forces(REAL, cable_effects(robot, index), robot.gravity, route, tension)[0]
        forces.append(add(scale(tension, route.direction), weight_force))
    return np.array(forces)


def _fixed_point(iterate: Callable[[Array], Array], guess: Array) -> Array:
    """Fixed-point iteration of a strong contraction: cables are light against their tensions."""
    tensions = guess
    for _ in range(MAX_ITERATIONS):
        previous, tensions = tensions, iterate(tensions)
        if np.max(np.abs(tensions - previous)) <= CONVERGENCE_TOLERANCE * np.max(tensions):
            break
    return tensions


def _no_length_error(robot: Robot, position: Sequence[Any], cable: int) -> UnreachableError:
    reason = f"cable {cable} has no length there"
    return UnreachableError(robot.name, tuple(map(float, position)), cable=cable, tension=None, reason=reason)


def _solve_three(robot: Robot, position: Array, direction_matrix: Array, load: Array) -> Array:
    if abs(np.linalg.det(direction_matrix)) < SINGULARITY_TOLERANCE:
        raise UnreachableError(
            robot.name,
            position=tuple(position),
            cable=None,
            tension=None,
            reason="the three cables lie in one plane there",
        )
    tensions = np.asarray(np.linalg.solve(direction_matrix, load), dtype=np.float64)
    worst = int(np.argmin(tensions))
    if tensions[worst] < 0.0:
        raise UnreachableError(
            robot.name,
            position=tuple(position),
            cable=worst + 1,
            tension=float(tensions[worst]),
            reason="a cable cannot push",
        )
    return tensions


def _distribute(robot: Robot, position: Array, direction_matrix: Array, load: Array) -> Array:
    limits = robot.tension or DEFAULT_LIMITS
    tensions = distribute_tensions(direction_matrix, load, limits)
    if tensions is not None:
        return tensions
    excess = least_limit_violations(direction_matrix, load, limits)
    if not np.all(np.isfinite(excess)):
        raise UnreachableError(
            robot.name,
            position=tuple(position),
            cable=None,
            tension=None,
            reason=f"the {len(excess)} cables lie in one plane there",
        )
    worst = int(np.argmax(np.abs(excess)))
    bound = limits.minimum if excess[worst] < 0.0 else limits.maximum
    raise UnreachableError(
        robot.name,
        position=tuple(position),
        cable=worst + 1,
        tension=bound + float(excess[worst]),
        reason=f"no tensions between {limits.minimum:g} and {limits.maximum:g} N hold the platform there",
    )
