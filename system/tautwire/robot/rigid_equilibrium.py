"""Static equilibrium of a rigid platform: its orientation, where too few cables hold it in any, and the tensions.

    A(R) T = (w, R c x w)

A is the structure matrix about the origin of the platform's frame, c the centre of mass in that frame with payload, and
w the load: weight less the forces of effects, all of which act at the centre of mass. With six cables or more the
orientation is the declared one. With fewer it is the nearest to the declared one for which tensions exist.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, least_squares, minimize

from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws.mathematics import REAL
from tautwire_fmu.laws.rotation import rotate

from ..errors import ArgumentError, UnreachableError
from ..memoisation import memoised
from .active_effects import cable_effects, cables_have_weight, centre_of_mass
from .cable_routes import attachment_points, cable_routes, unreachable_error
from .kinematics import structure_matrix_at, turned_orientation, validated_pose
from .schema import Point, Quaternion, Robot, TensionLimits
from .static_load import fixed_point, static_load
from .tension_distribution import BOUNDED_RULES, DEFAULT_LIMITS, distribute_by_rule, least_limit_violations

Array = NDArray[np.float64]
Balance = tuple[Array, Array]

FREEDOMS = 6
# Wrench that may be left, relative to the load; moments are divided by the size of the platform.
BALANCE_TOLERANCE = 1e-9
# Force that two cables may leave, relative to the load: a survey knows no position better.
MAX_RESIDUAL_RATIO = 1e-3
# Singular values of the structure matrix below this share of the largest are zero.
RANK_TOLERANCE = 1e-9
# rad: a quaternion of four decimals errs by less.
MIN_NOTED_ANGLE = 1e-4
MAX_NEWTON_STEPS, MAX_SEARCH_STEPS = 40, 200
DIFFERENCE_STEP = 1e-6  # rad and m, of central differences
MIN_SIZE_RATIO = 1e-3  # of the mean cable length, the least size of a platform by which moments are divided


@dataclass(frozen=True)
class StaticEquilibrium:
    """Static equilibrium: ``orientation`` as a unit quaternion, ``tensions`` (n,) in N.

    ``moved_by`` is the angle in rad between the orientation and the declared one. ``residual_force``, in N, is what
    remains where two cables hold a position that is only nearly in their plane; it is at most a thousandth of the load.
    """

    orientation: Quaternion
    tensions: Array
    moved_by: float
    residual_force: float


def leaves_orientation_to_equilibrium(robot: Robot) -> bool:
    """Whether a robot's platform turns, on too few cables to be held in any orientation."""
    return robot.platform.is_rigid_body and robot.cable_count < FREEDOMS


def static_equilibrium(
    robot: Robot,
    position: Sequence[float] | Array | None = None,
    rule: str = "nearest",
    orientation: Sequence[float] | Array | None = None,
) -> StaticEquilibrium:
    """Static equilibrium of a rigid platform at a position in m, by default the start.

    The ``orientation`` is a unit quaternion, by default the declared one. Where it leaves a moment and fewer than six
    cables hold the platform, the nearest orientation in equilibrium is taken, with no tension below the minimum of the
    robot file if there is one such. Tensions that are not unique are distributed by a ``rule`` of
    :data:`tautwire.robot.tension_distribution.RULES`, with more than six cables, or by a rule that needs bounds, within
    the limits of the robot file.

    Raises UnreachableError where no orientation near the declared one is in equilibrium, or where a cable would have
    to push or to break a limit; ArgumentError for an invalid argument.
    """
    at, declared = validated_pose("static_equilibrium", robot, position, orientation)
    if not robot.platform.is_rigid_body:
        problem = "has a point mass, whose orientation is nothing"
        raise ArgumentError("static_equilibrium: robot", robot, problem, "use static_tensions")
    robot = replace(robot, platform=replace(robot.platform, start_orientation=declared))
    if robot.cable_count >= FREEDOMS or _is_balanced(*_balance(robot, at, declared, None)):
        rotation_vector = np.zeros(3)
    else:
        rotation_vector = np.array(_nearest_orientation(robot, tuple(at.tolist())))
    turned = turned_orientation(declared, rotation_vector)
    tensions = _tensions(robot, at, turned, rule)
    matrix, load = _balance(robot, at, turned, tensions)
    remaining = float(np.linalg.norm((matrix @ tensions - load)[:3]))
    return StaticEquilibrium(turned, tensions, float(np.linalg.norm(rotation_vector)), remaining)


def orientation_notes(robot: Robot) -> tuple[str, ...]:
    """A note where the platform does not start at its declared orientation, as that is in no equilibrium."""
    if not robot.platform.is_rigid_body:
        return ()
    equilibrium = static_equilibrium(robot)
    if equilibrium.moved_by < MIN_NOTED_ANGLE:
        return ()
    orientation = ", ".join(f"{part:.6f}" for part in equilibrium.orientation)
    angle = np.degrees(equilibrium.moved_by)
    return (
        f"{robot.name}: starts {angle:.3g} degrees from the declared orientation, where the {robot.cable_count} cables "
        f"leave a moment, at start_orientation = [{orientation}]",
    )


def platform_size(robot: Robot) -> float:
    """Length by which moments are divided: that of the farthest attachment from the centre of mass, in m."""
    centre = np.array(robot.platform.centre_of_mass)
    size = float(np.max(np.linalg.norm(np.array(robot.attachments) - centre, axis=1)))
    lengths = np.linalg.norm(np.array(robot.anchors) - robot.platform.start, axis=1)
    return max(size, MIN_SIZE_RATIO * float(np.mean(lengths)))


def load_wrench(robot: Robot, position: Array, orientation: Quaternion, tensions: Array | None = None) -> Array:
    """Wrench that the tensions balance: force in N, moment about the origin of the platform's frame in N m, shape (6,).

    Of cables that have weight, its part at the platform under ``tensions`` (n,) in N is taken off; by default those
    that would carry the weight of the platform each.
    """
    force = np.array(static_load(REAL, robot, position.tolist()), dtype=float)
    arm = np.array(rotate(orientation, centre_of_mass(robot)), dtype=float)
    wrench = np.concatenate([force, np.cross(arm, force)])
    if not cables_have_weight(robot):
        return wrench
    if tensions is None:
        tensions = np.full(robot.cable_count, float(np.linalg.norm(force)))
    routes = cable_routes(REAL, robot, position.tolist(), orientation)
    points = attachment_points(robot, position.tolist(), orientation)
    for index, (route, point, tension) in enumerate(zip(routes, points, tensions.tolist(), strict=True), start=1):
        end_force = np.array(stages.end_forces(REAL, cable_effects(robot, index), robot.gravity, route, tension)[0])
        wrench -= np.concatenate([end_force, np.cross(np.array(point) - position, end_force)])
    return wrench


def _balance(robot: Robot, position: Array, orientation: Quaternion, tensions: Array | None) -> Balance:
    """Structure matrix and load wrench, their moments divided by the platform's size."""
    scale = np.array([1.0] * 3 + [1.0 / platform_size(robot)] * 3)
    matrix = structure_matrix_at(robot, position, orientation)
    return scale[:, None] * matrix, scale * load_wrench(robot, position, orientation, tensions)


def _is_balanced(matrix: Array, load: Array) -> bool:
    """Whether some tensions, pulling or not, balance the load."""
    tensions = np.linalg.lstsq(matrix, load, rcond=RANK_TOLERANCE)[0]
    return bool(
        np.linalg.norm(matrix @ tensions - load) <= BALANCE_TOLERANCE * max(float(np.linalg.norm(load)), 1e-300)
    )


def _tensions(robot: Robot, position: Array, orientation: Quaternion, rule: str) -> Array:
    def iterate(tensions: Array | None) -> Array:
        return _balancing_tensions(robot, position, _balance(robot, position, orientation, tensions), rule)

    first = iterate(None)
    return fixed_point(iterate, first) if cables_have_weight(robot) else first


def _balancing_tensions(robot: Robot, position: Array, balance: Balance, rule: str) -> Array:
    matrix, load = balance
    left_vectors, singular_values, _ = np.linalg.svd(matrix, full_matrices=False)
    spanned = left_vectors[:, singular_values > RANK_TOLERANCE * singular_values[0]]
    remaining = load - spanned @ (spanned.T @ load)
    # Two cables leave something, and so do cables with weight until their tensions have converged.
    tolerance = MAX_RESIDUAL_RATIO if robot.cable_count < FREEDOMS else 1e3 * BALANCE_TOLERANCE
    if np.linalg.norm(remaining) > tolerance * max(float(np.linalg.norm(load)), 1e-300):
        raise unreachable_error(robot, position, _missing_closure(robot, remaining, spanned.shape[1]))
    matrix, load = spanned.T @ matrix, spanned.T @ load
    if len(load) == robot.cable_count:
        tensions = np.asarray(np.linalg.solve(matrix, load), dtype=np.float64)
        worst = int(np.argmin(tensions))
        if tensions[worst] < -BALANCE_TOLERANCE * float(np.max(np.abs(tensions))):
            raise unreachable_error(robot, position, "a cable cannot push", worst + 1, float(tensions[worst]))
        return np.maximum(tensions, 0.0)
    is_bounded = robot.cable_count > FREEDOMS or rule in BOUNDED_RULES
    limits = (robot.tension or DEFAULT_LIMITS) if is_bounded else DEFAULT_LIMITS
    distributed = distribute_by_rule(matrix, load, limits, rule)
    if distributed is None:
        raise _limit_error(robot, position, matrix, load, limits)
    return distributed


def _missing_closure(robot: Robot, remaining: Array, rank: int) -> str:
    """What the cables cannot exert, whatever their tensions."""
    force, moment = float(np.linalg.norm(remaining[:3])), float(np.linalg.norm(remaining[3:])) * platform_size(robot)
    left = f"{force:.3g} N and {moment:.3g} N m of the load remain"
    return f"no wrench closure, as the {robot.cable_count} cables exert wrenches of rank {rank} only: {left}"


def _limit_error(robot: Robot, position: Array, matrix: Array, load: Array, limits: TensionLimits) -> UnreachableError:
    pulling = replace(limits, minimum=0.0, maximum=float("inf"))
    if distribute_by_rule(matrix, load, replace(pulling, preferred=0.0), "least_norm") is None:
        excess = least_limit_violations(matrix, load, pulling)
        worst = int(np.argmin(excess))
        reason = "no wrench closure, as no tensions that only pull balance weight and moment"
        return unreachable_error(robot, position, reason, worst + 1, float(excess[worst]))
    excess = least_limit_violations(matrix, load, limits)
    worst = int(np.argmax(np.abs(excess)))
    bound = limits.minimum if excess[worst] < 0.0 else limits.maximum
    reason = f"no tensions between {limits.minimum:g} and {limits.maximum:g} N hold the platform there"
    return unreachable_error(robot, position, reason, worst + 1, bound + float(excess[worst]))


# The components of a robot, and those who note how it starts, ask for the same one.
@memoised(max_results=32)
def _nearest_orientation(robot: Robot, at: Point) -> Point:
    """Rotation vector, in rad, from the declared orientation to the nearest one in equilibrium at a position in m."""
    x, y, z = _nearest_rotation(robot, np.array(at)).tolist()
    return x, y, z


def _nearest_rotation(robot: Robot, position: Array) -> Array:
    """Rotation vector of ``min |r|^2`` with ``A(r) T = w(r)`` and ``T >= 0``, the tensions in shares of the load."""
    load = float(np.linalg.norm(static_load(REAL, robot, position.tolist())))

    def imbalance(variables: Array) -> Array:
        return _imbalance(robot, position, variables, load)

    matrix, wrench = _balance(robot, position, robot.platform.start_orientation, None)
    start = np.concatenate([np.zeros(3), np.linalg.lstsq(matrix, wrench / load, rcond=RANK_TOLERANCE)[0]])
    bounds = {0.0, robot.tension.minimum / load if robot.tension else 0.0}
    # Of two cables no orientation is left to choose.
    for bound in sorted(bounds, reverse=True) if robot.cable_count > 2 else ():
        found = _newton(imbalance, _searched(imbalance, start, bound))
        if found is not None and np.min(found[3:]) >= bound - BALANCE_TOLERANCE:
            return found[:3]
    found = _newton(imbalance, start)
    if found is None:
        found = _nearly_balanced(imbalance, start)
        if np.linalg.norm(imbalance(found)) > MAX_RESIDUAL_RATIO:
            raise _no_orientation_error(robot, position, imbalance(found) * load, start, load)
    worst = int(np.argmin(found[3:]))
    if found[3 + worst] >= 0.0:
        return found[:3]
    raise unreachable_error(robot, position, "a cable cannot push", worst + 1, load * float(found[3 + worst]))


def _imbalance(robot: Robot, position: Array, variables: Array, load: float) -> Array:
    """Wrench that remains, in shares of the load, with a rotation vector (rad) and tensions in shares of the load."""
    tensions = load * variables[3:]
    matrix, wrench = _balance(
        robot, position, turned_orientation(robot.platform.start_orientation, variables[:3]), tensions
    )
    remaining: Array = (matrix @ tensions - wrench) / load
    return remaining


def _searched(imbalance: Callable[[Array], Array], start: Array, bound: float) -> Array:
    """The smallest rotation in equilibrium with tensions above a bound, by sequential quadratic programming."""
    count = len(start) - 3

    def objective(variables: Array) -> tuple[float, Array]:
        return 0.5 * float(variables[:3] @ variables[:3]), np.concatenate([variables[:3], np.zeros(count)])

    balanced: Any = {"type": "eq", "fun": imbalance, "jac": lambda variables: _differences(imbalance, variables)}
    bounds: Any = Bounds([-np.pi] * 3 + [bound] * count, [np.pi] * 3 + [np.inf] * count)
    options: Any = {"maxiter": MAX_SEARCH_STEPS, "ftol": 1e-14}
    guess = np.concatenate([start[:3], np.maximum(start[3:], bound)])
    try:
        result = minimize(
            objective, guess, jac=True, bounds=bounds, constraints=balanced, method="SLSQP", options=options
        )
    except UnreachableError:
        # A search that leaves the robot, or numbers, has found nothing.
        return guess
    return np.asarray(result.x, dtype=np.float64)


def _nearly_balanced(imbalance: Callable[[Array], Array], start: Array) -> Array:
    """Rotation vector and tensions that leave the smallest wrench."""

    def jacobian(variables: Array) -> Array:
        return _differences(imbalance, variables)

    found = least_squares(imbalance, start, jacobian, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    return np.asarray(found.x, dtype=np.float64)


def _newton(imbalance: Callable[[Array], Array], start: Array) -> Array | None:
    """The nearby equilibrium, by Newton steps of least norm; None where they do not converge."""
    variables = start
    for _ in range(MAX_NEWTON_STEPS):
        remaining = imbalance(variables)
        if np.linalg.norm(remaining) <= 0.1 * BALANCE_TOLERANCE:
            return variables
        variables = variables - np.linalg.lstsq(_differences(imbalance, variables), remaining, rcond=RANK_TOLERANCE)[0]
        if not np.all(np.isfinite(variables)) or np.linalg.norm(variables[:3]) > np.pi:
            return None
    return None


def _differences(imbalance: Callable[[Array], Array], variables: Array) -> Array:
    """Jacobian by central differences, shape (6, 3 + n)."""
    steps = DIFFERENCE_STEP * np.eye(len(variables))
    columns = [(imbalance(variables + step) - imbalance(variables - step)) / (2.0 * DIFFERENCE_STEP) for step in steps]
    return np.array(columns).T


def _no_orientation_error(
    robot: Robot, position: Array, remaining: Array, start: Array, load: float
) -> UnreachableError:
    """The error about a position that no orientation holds, with the nearest one that can be held as its hint."""
    size = platform_size(robot)
    force, moment = float(np.linalg.norm(remaining[:3])), float(np.linalg.norm(remaining[3:])) * size
    left = f"{force:.3g} N and {moment:.3g} N m remain"
    reason = f"{robot.cable_count} cables balance no orientation near the declared one, {left}"

    def imbalance(variables: Array) -> Array:
        return _imbalance(robot, position + size * variables[:3], variables[3:], load)

    found = _newton(imbalance, np.concatenate([np.zeros(3), start]))
    if found is None or np.min(found[6:]) < 0.0:
        return unreachable_error(robot, position, reason)
    nearest = ", ".join(f"{coordinate:.6g}" for coordinate in position + size * found[:3])
    hint = f"start at [{nearest}], where the platform hangs in equilibrium"
    return UnreachableError(robot.name, position.tolist(), None, None, reason, hint)
