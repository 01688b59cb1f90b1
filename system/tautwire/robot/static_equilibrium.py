"""Static equilibrium at a position: the cables' routes, the load on them, and the tensions that balance it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws import point_mass
from tautwire_fmu.laws.effect_stages import Route
from tautwire_fmu.laws.mathematics import REAL, Mathematics
from tautwire_fmu.laws.rotation import rotate
from tautwire_fmu.laws.vectors import Vector, add, scale, subtract

from ..errors import UnreachableError
from .active_effects import cable_effects, cables_have_weight, platform_effects
from .schema import Quaternion, Robot, TensionLimits
from .tension_distribution import distribute_tensions, least_limit_violations

if TYPE_CHECKING:
    from .rigid_equilibrium import StaticEquilibrium

Array = NDArray[np.float64]
Points = tuple[Sequence[Any], ...]


DEFAULT_LIMITS = TensionLimits(minimum=0.0, maximum=float("inf"), preferred=0.0)
SINGULARITY_TOLERANCE = 1e-9
MIN_CABLE_LENGTH = 1e-6
MAX_ITERATIONS = 50
CONVERGENCE_TOLERANCE = 1e-14


def attachment_points(robot: Robot, position: Sequence[Any], orientation: Sequence[Any] | None = None) -> Points:
    """Where the cables hold the platform in the world, in m; ``orientation`` is by default that of the robot file."""
    if not robot.platform.is_rigid_body:
        return (position,) * robot.cable_count
    quaternion = robot.platform.start_orientation if orientation is None else orientation
    return tuple(add(position, rotate(quaternion, attachment)) for attachment in robot.attachments)


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


def total_weight(robot: Robot, mathematics: Mathematics = REAL) -> Any:
    """Weight of the platform with payload, in N."""
    constants = point_mass.PointMassConstants(robot.platform.mass, robot.gravity)
    return point_mass.total_mass(mathematics, constants, platform_effects(robot)) * robot.gravity


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


def static_tensions(robot: Robot, at: Array | None = None) -> Array:
    """Static tensions that hold the platform in equilibrium, shape (n,), in N.

    Solves ``sum T_i u_i = m g e_z``, with the loads of effects and the weight of cables. With more than three
    cables, the tensions nearest to the preferred one (least squares) within the limits of the robot file; without
    limits there, nearest to zero and not negative. ``at`` is a position in m, by default the start. Of a rigid
    platform they are those of :func:`tautwire.robot.rigid_equilibrium.static_equilibrium`.

    Raises UnreachableError where a cable would have to push or to break a limit.
    """
    if robot.platform.is_rigid_body:
        return _rigid_equilibrium(robot, at).tensions
    position = np.array(robot.platform.start if at is None else at, dtype=float)
    routes = cable_routes(REAL, robot, position.tolist())
    direction_matrix = np.array([route.direction for route in routes]).T
    load_vector = np.array(static_load(REAL, robot, position.tolist()), dtype=float)
    solver = _solve_three if len(robot.cables) == 3 else _distribute
    if not cables_have_weight(robot):
        return solver(robot, position, direction_matrix, load_vector)

    def iterate(tensions: Array) -> Array:
        return solver(
            robot,
            position,
            direction_matrix,
            load_vector - np.array(cable_weight_force(REAL, robot, routes, tensions.tolist())),
        )

    return fixed_point(iterate, np.full(len(routes), float(np.linalg.norm(load_vector))))


def start_orientation(robot: Robot) -> Quaternion:
    """Orientation of the platform at the static start; identity for a point mass.

    Raises UnreachableError where the cables cannot hold a rigid platform there.
    """
    is_rigid = robot.platform.is_rigid_body
    return _rigid_equilibrium(robot).orientation if is_rigid else robot.platform.start_orientation


def start_attachments(robot: Robot) -> Points:
    """Where the cables hold the platform at the static start, in m."""
    orientation = start_orientation(robot) if robot.platform.is_rigid_body else None
    return attachment_points(robot, robot.platform.start, orientation)


def static_forces(robot: Robot) -> Array:
    """Forces of the cables on the platform at its start, shape (n, 3), in N."""
    if robot.platform.is_rigid_body:
        equilibrium = _rigid_equilibrium(robot)
        orientation, tensions = equilibrium.orientation, equilibrium.tensions
    else:
        orientation, tensions = robot.platform.start_orientation, static_tensions(robot)
    routes = cable_routes(REAL, robot, robot.platform.start, orientation)
    forces = []
    for index, (route, tension) in enumerate(zip(routes, tensions.tolist(), strict=True), start=1):
        weight_force = stages.end_forces(REAL, cable_effects(robot, index), robot.gravity, route, tension)[0]
        forces.append(add(scale(tension, route.direction), weight_force))
    return np.array(forces)


def _rigid_equilibrium(robot: Robot, position: Array | None = None) -> StaticEquilibrium:
    # It builds on this module's routes and loads.
    from .rigid_equilibrium import static_equilibrium

    return static_equilibrium(robot, position)


def fixed_point(iterate: Callable[[Array], Array], guess: Array) -> Array:
    """Tensions by fixed-point iteration, which is a strong contraction: cables are light against their tensions."""
    tensions = guess
    for _ in range(MAX_ITERATIONS):
        previous, tensions = tensions, iterate(tensions)
        if np.max(np.abs(tensions - previous)) <= CONVERGENCE_TOLERANCE * np.max(tensions):
            break
    return tensions


def _solve_three(robot: Robot, position: Array, direction_matrix: Array, load: Array) -> Array:
    if abs(np.linalg.det(direction_matrix)) < SINGULARITY_TOLERANCE:
        raise unreachable_error(robot, position, "the three cables lie in one plane there")
    tensions = np.asarray(np.linalg.solve(direction_matrix, load), dtype=np.float64)
    worst = int(np.argmin(tensions))
    if tensions[worst] < 0.0:
        raise unreachable_error(robot, position, "a cable cannot push", worst + 1, float(tensions[worst]))
    return tensions


def _distribute(robot: Robot, position: Array, direction_matrix: Array, load: Array) -> Array:
    limits = robot.tension or DEFAULT_LIMITS
    tensions = distribute_tensions(direction_matrix, load, limits)
    if tensions is not None:
        return tensions
    excess = least_limit_violations(direction_matrix, load, limits)
    if not np.all(np.isfinite(excess)):
        raise unreachable_error(robot, position, f"the {len(excess)} cables lie in one plane there")
    worst = int(np.argmax(np.abs(excess)))
    bound = limits.minimum if excess[worst] < 0.0 else limits.maximum
    reason = f"no tensions between {limits.minimum:g} and {limits.maximum:g} N hold the platform there"
    raise unreachable_error(robot, position, reason, worst + 1, bound + float(excess[worst]))


def unreachable_error(
    robot: Robot, position: Iterable[Any], reason: str, cable: int | None = None, tension: float | None = None
) -> UnreachableError:
    """The error about a position (m) that the cables cannot hold."""
    return UnreachableError(robot.name, tuple(map(float, position)), cable=cable, tension=tension, reason=reason)
