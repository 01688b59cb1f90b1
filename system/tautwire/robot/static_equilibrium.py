"""Static equilibrium at a position: the tensions that balance the load on the cables."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws.mathematics import REAL
from tautwire_fmu.laws.vectors import add, scale

from .active_effects import cable_effects, cables_have_weight
from .cable_routes import Points, attachment_points, cable_routes, unreachable_error
from .rigid_equilibrium import static_equilibrium
from .schema import Quaternion, Robot
from .static_load import cable_weight_force, fixed_point, static_load
from .tension_distribution import DEFAULT_LIMITS, distribute_by_rule, least_limit_violations

Array = NDArray[np.float64]

SINGULARITY_TOLERANCE = 1e-9


def static_tensions(robot: Robot, at: Array | None = None, rule: str = "nearest") -> Array:
    """Static tensions that hold the platform in equilibrium, shape (n,), in N.

    Solves ``sum T_i u_i = m g e_z``, with the loads of effects and the weight of cables. With more than three
    cables, by default those nearest to the preferred tension (least squares) within the limits of the robot file;
    without limits there, nearest to zero and not negative; or by another ``rule`` of
    :data:`tautwire.robot.tension_distribution.RULES`. ``at`` is a position in m, by default the start. Of a rigid
    platform they are those of :func:`tautwire.robot.rigid_equilibrium.static_equilibrium`.

    Raises UnreachableError where a cable would have to push or to break a limit.
    """
    if robot.platform.is_rigid_body:
        return static_equilibrium(robot, at, rule).tensions
    position = np.array(robot.platform.start if at is None else at, dtype=float)
    routes = cable_routes(REAL, robot, position.tolist())
    direction_matrix = np.array([route.direction for route in routes]).T
    load_vector = np.array(static_load(REAL, robot, position.tolist()), dtype=float)
    # Three cables in one plane hold a load in it, if at all, by many tensions.
    is_determinate = len(routes) == 3 and abs(np.linalg.det(direction_matrix)) >= SINGULARITY_TOLERANCE
    solver = _solve_three if is_determinate else partial(_distribute, rule=rule)
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


def tensions_at(robot: Robot, position: Array, orientation: Quaternion, rule: str = "nearest") -> Array:
    """As :func:`static_tensions`, at an orientation too; of fewer than six cables the equilibrium nearest to it."""
    if robot.platform.is_rigid_body:
        return static_equilibrium(robot, position, rule, orientation).tensions
    return static_tensions(robot, position, rule)


def start_orientation(robot: Robot) -> Quaternion:
    """Orientation of the platform at the static start, or where a run begins; identity for a point mass.

    Raises UnreachableError where the cables cannot hold a rigid platform there.
    """
    if robot.initial_state is not None and robot.initial_state.orientation is not None:
        return robot.initial_state.orientation
    is_rigid = robot.platform.is_rigid_body
    return static_equilibrium(robot).orientation if is_rigid else robot.platform.start_orientation


def start_attachments(robot: Robot) -> Points:
    """Where the cables hold the platform at the static start, in m."""
    orientation = start_orientation(robot) if robot.platform.is_rigid_body else None
    return attachment_points(robot, robot.platform.start, orientation)


def static_forces(robot: Robot) -> Array:
    """Forces of the cables on the platform at its start, shape (n, 3), in N."""
    if robot.platform.is_rigid_body:
        equilibrium = static_equilibrium(robot)
        orientation, tensions = equilibrium.orientation, equilibrium.tensions
    else:
        orientation, tensions = robot.platform.start_orientation, static_tensions(robot)
    routes = cable_routes(REAL, robot, robot.platform.start, orientation)
    forces = []
    for index, (route, tension) in enumerate(zip(routes, tensions.tolist(), strict=True), start=1):
        weight_force = stages.end_forces(REAL, cable_effects(robot, index), robot.gravity, route, tension)[0]
        forces.append(add(scale(tension, route.direction), weight_force))
    return np.array(forces)


def _solve_three(robot: Robot, position: Array, direction_matrix: Array, load: Array) -> Array:
    tensions = np.asarray(np.linalg.solve(direction_matrix, load), dtype=np.float64)
    worst = int(np.argmin(tensions))
    if tensions[worst] < 0.0:
        raise unreachable_error(robot, position, "a cable cannot push", worst + 1, float(tensions[worst]))
    return tensions


def _distribute(robot: Robot, position: Array, direction_matrix: Array, load: Array, rule: str) -> Array:
    limits = robot.tension or DEFAULT_LIMITS
    tensions = distribute_by_rule(direction_matrix, load, limits, rule)
    if tensions is not None:
        return tensions
    excess = least_limit_violations(direction_matrix, load, limits)
    if not np.all(np.isfinite(excess)):
        raise unreachable_error(robot, position, _reason_out_of_plane(robot, position))
    worst = int(np.argmax(np.abs(excess)))
    bound = limits.minimum if excess[worst] < 0.0 else limits.maximum
    reason = f"no tensions between {limits.minimum:g} and {limits.maximum:g} N hold the platform there"
    raise unreachable_error(robot, position, reason, worst + 1, bound + float(excess[worst]))


def _reason_out_of_plane(robot: Robot, position: Array) -> str:
    """Why cables in one plane do not hold the load: of two, how far they hang out of the vertical plane."""
    if robot.cable_count > 2:
        return f"the {robot.cable_count} cables lie in one plane there"
    first, second = (np.array(anchor, dtype=float) for anchor in robot.anchors)
    across = np.cross(second - first, (0.0, 0.0, 1.0))
    width = float(np.linalg.norm(across))
    distance = abs(float(across @ (position - first))) / width if width > 0.0 else 0.0
    return (
        f"two cables hold a load in the vertical plane of their exit points alone, and it is {distance:.3g} m beside it"
    )
