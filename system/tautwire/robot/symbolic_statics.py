"""The static start as CasADi expressions of a robot's free parameters: its tensions, and its orientation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws.effect_stages import Route
from tautwire_fmu.laws.mathematics import REAL, Mathematics
from tautwire_fmu.laws.rotation import Quaternion, multiply, quaternion_of, rotate, rotation_vector_of
from tautwire_fmu.laws.vectors import Vector, cross, scale, subtract

from .active_effects import cable_effects, cables_have_weight, centre_of_mass
from .cable_routes import attachment_points, cable_routes
from .rigid_equilibrium import platform_size
from .robot_assembly import CableComponent
from .schema import Robot
from .static_equilibrium import SINGULARITY_TOLERANCE, start_orientation, static_tensions
from .static_load import static_load
from .static_start import ImplicitRoot, StaticStart
from .tension_distribution import DEFAULT_LIMITS

Array = NDArray[np.float64]

LIMIT_TOLERANCE = 1e-6
# Where cables have weight: each iteration gains some three digits.
WEIGHT_ITERATIONS = 6
# Fewer cables leave an orientation to its equilibrium.
FREEDOMS = 6
NEWTON_STEPS = 16
RANK_TOLERANCE = 1e-9
# rad: of a root that is the nearest, what multipliers leave of its rotation.
STATIONARITY_TOLERANCE = 1e-5


@dataclass(frozen=True)
class SymbolicStatics:
    """The static start: ``tensions`` (n,) in N, and ``rotation`` (3,) in rad from a reference, empty of a point mass.

    ``orientation`` is that of the platform there, a unit quaternion. Where these follow from no formula they depend on
    the unknowns of the ``roots``.
    """

    tensions: list[SX]
    rotation: SX
    orientation: Quaternion
    roots: tuple[ImplicitRoot, ...] = ()


def symbolic_statics(
    nominal: Robot, symbolic_robot: Robot, reference: Quaternion, mathematics: Mathematics
) -> SymbolicStatics:
    """Static start of a robot with symbolic parameters; ``nominal`` has numbers instead.

    Cables at a tension limit stay there, the others share the remaining load.
    """
    if nominal.platform.is_rigid_body and nominal.cable_count < FREEDOMS:
        return _equilibrium_on_few_cables(nominal, symbolic_robot, reference, mathematics)
    orientation = start_orientation(nominal)
    tensions = _start_tensions(nominal, symbolic_robot, orientation, mathematics)
    if not nominal.platform.is_rigid_body:
        return SymbolicStatics(tensions, SX(0, 1), orientation)
    return SymbolicStatics(tensions, SX(list(_rotation_from(reference, orientation))), orientation)


def _rotation_from(reference: Quaternion, orientation: Quaternion, mathematics: Mathematics = REAL) -> Vector:
    """Rotation vector, in rad, from one orientation to another."""
    w, x, y, z = reference
    return rotation_vector_of(mathematics, multiply(orientation, (w, -x, -y, -z)))


def _equilibrium_on_few_cables(
    nominal: Robot, symbolic_robot: Robot, reference: Quaternion, mathematics: Mathematics
) -> SymbolicStatics:
    """Static start of a platform whose orientation follows from its equilibrium.

    Of all equilibria the nearest to the declared orientation is taken. With the rotation vector r from it, tensions T
    in shares of the load, multipliers l, and what the balance lacks, g, it is a root of

        F(z) = (r + g_r' l, g_T' l, g),   z = (r, T, l)        z <- z - F_z^+ (F(z) - F(z_0))

    These Newton steps begin at the numbers' own root z_0, where the Jacobian is taken: their first derivatives are
    exact after one, and each further one gains as many digits as parameters are near those of the numbers.
    """
    declared, tensions = nominal.platform.start_orientation, static_tensions(nominal)
    equilibrium = start_orientation(replace(nominal, initial_state=None))
    load = float(np.linalg.norm(np.array(static_load(REAL, nominal, nominal.platform.start), dtype=float)))
    start = np.concatenate([np.array(_rotation_from(declared, equilibrium)), tensions / load])
    unknowns = SX.sym("unknowns", len(start))
    lacking, of_numbers = (
        _imbalance(nominal, each, unknowns[:3], load * unknowns[3:], mathematics) / load
        for each in (symbolic_robot, nominal)
    )
    root = _continued_root(unknowns, lacking, of_numbers, start)
    x, y, z, *shares = casadi.vertsplit(root.unknowns[: len(start)])
    orientation: Quaternion = multiply(quaternion_of(mathematics, (x, y, z)), declared)
    if nominal.initial_state is not None and nominal.initial_state.orientation is not None:
        orientation = nominal.initial_state.orientation
    rotation = _rotation_from(reference, orientation, mathematics)
    tensions_there = [load * share for share in shares]
    return SymbolicStatics(tensions_there, casadi.vertcat(*map(SX, rotation)), orientation, (root,))


def _imbalance(nominal: Robot, robot: Robot, rotation: SX, tensions: SX, mathematics: Mathematics) -> SX:
    """Wrench (6,) that tensions leave at a rotation from the declared orientation, moments over the platform's size."""
    turned = quaternion_of(mathematics, (rotation[0], rotation[1], rotation[2]))
    orientation = multiply(turned, nominal.platform.start_orientation)
    arms = _relative_arms(nominal, robot, orientation)
    routes = cable_routes(mathematics, robot, robot.platform.start, orientation)
    weights = _cable_weights(mathematics, robot, routes, casadi.vertsplit(tensions))
    pulls = casadi.mtimes(_wrenches(arms, [route.direction for route in routes]), tensions)
    return pulls + casadi.sum2(_wrenches(arms, weights)) - _load_wrench(nominal, robot, orientation, mathematics)


def _continued_root(unknowns: SX, lacking: SX, of_numbers: SX, start: Array) -> ImplicitRoot:
    """The unknowns at which the balance lacks nothing and the rotation is smallest, from the root for the numbers.

    Multipliers follow them, if the rotation is the smallest by these.
    """
    multipliers = SX.sym("multipliers", lacking.numel())
    jacobian = np.array(casadi.Function("jacobian", [unknowns], [casadi.jacobian(of_numbers, unknowns)])(start))
    rotation = np.append(start[:3], np.zeros(len(start) - 3))
    at_root = np.linalg.lstsq(jacobian.T, -rotation, rcond=RANK_TOLERANCE)[0]
    equations, numbers, point, variables = lacking, of_numbers, start, unknowns
    # With fewer cables than three, or a tension that is at its bound, the nearest root is found by its distance.
    if np.linalg.norm(jacobian.T @ at_root + rotation) <= STATIONARITY_TOLERANCE and len(start) > FREEDOMS - 1:
        variables, point = casadi.vertcat(unknowns, multipliers), np.concatenate([start, at_root])
        equations, numbers = (_stationarity(unknowns, multipliers, each) for each in (lacking, of_numbers))
    slopes = np.array(casadi.Function("slope", [variables], [casadi.jacobian(numbers, variables)])(point))
    inverse = np.asarray(np.linalg.pinv(slopes, RANK_TOLERANCE), dtype=float)
    residual = np.array(casadi.Function("residual", [variables], [numbers])(point)).ravel()
    equations, root = equations - residual, SX(point)
    for _ in range(NEWTON_STEPS):
        (lack,) = casadi.substitute([equations], [variables], [root])
        root = root - casadi.mtimes(SX(inverse), lack)
    return ImplicitRoot(variables, root, equations, inverse, inverse @ slopes)


def _stationarity(unknowns: SX, multipliers: SX, lacking: SX) -> SX:
    """Gradient of half the squared rotation with a constraint, and the constraint."""
    rotation = unknowns[:3]
    function = 0.5 * casadi.dot(rotation, rotation) + casadi.dot(multipliers, lacking)
    return casadi.vertcat(casadi.gradient(function, unknowns), lacking)


@dataclass(frozen=True)
class HeldStatics:
    """Cables whose static start, and whose length shifts (n,), are symbols where they depend on others.

    The start is the same from one update of these to the next, and is not to be computed again with each of the rates.
    """

    cables: tuple[CableComponent, ...]
    length_shifts: SX
    start: StaticStart


def held_statics(
    cables: Sequence[CableComponent], length_shifts: SX, others: Sequence[SX], roots: tuple[ImplicitRoot, ...]
) -> HeldStatics:
    """Holds what depends on ``others`` or on roots; numbers stay numbers."""
    held: list[tuple[SX, SX]] = []
    symbols = casadi.vertcat(SX(0, 1), *others, *(root.unknowns for root in roots))

    def hold(name: str, value: Any) -> SX:
        expression = SX(value)
        if not casadi.depends_on(expression, symbols):
            return expression
        held.append((SX.sym(name), expression))
        return held[-1][0]

    components = []
    for number, component in enumerate(cables, start=1):
        constants = component.constants
        x, y, z = (hold(f"start_direction_{number}", part) for part in constants.start_direction)
        held_constants = constants._replace(
            start_length=hold(f"start_length_{number}", constants.start_length),
            start_tension=hold(f"start_tension_{number}", constants.start_tension),
            start_direction=(x, y, z),
            start_cell_tension=hold(f"start_cell_tension_{number}", constants.start_cell_tension),
        )
        components.append(replace(component, constants=held_constants))
    shifts = casadi.vertcat(*(hold("length_shift", shift) for shift in casadi.vertsplit(length_shifts)))
    held_symbols, expressions = (casadi.vertcat(SX(0, 1), *(pair[k] for pair in held)) for k in (0, 1))
    return HeldStatics(tuple(components), shifts, StaticStart(held_symbols, expressions, roots))


def _start_tensions(
    nominal: Robot, symbolic_robot: Robot, orientation: Quaternion, mathematics: Mathematics
) -> list[SX]:
    """Static tensions, in N, at an orientation."""
    tensions = static_tensions(nominal)
    start, freedoms = symbolic_robot.platform.start, 6 if nominal.platform.is_rigid_body else 3
    limits = nominal.tension or DEFAULT_LIMITS
    limit_distance = max(float(np.max(tensions)), 1.0) * LIMIT_TOLERANCE
    at_limit = np.zeros(len(tensions), dtype=bool)
    if len(tensions) > freedoms:
        at_limit = (tensions - limits.minimum < limit_distance) | (limits.maximum - tensions < limit_distance)
    arms = _relative_arms(nominal, symbolic_robot, orientation)
    routes = cable_routes(mathematics, symbolic_robot, start, orientation)
    directions = _wrenches(arms, [route.direction for route in routes])
    nominal_routes = cable_routes(REAL, nominal, nominal.platform.start, orientation)
    nominal_arms = _relative_arms(nominal, nominal, orientation)
    basis = SX(_wrench_basis(np.array(casadi.DM(_wrenches(nominal_arms, [r.direction for r in nominal_routes]))))).T
    directions_in_basis = casadi.mtimes(basis, directions)
    load = _load_wrench(nominal, symbolic_robot, orientation, mathematics)
    result = [SX(float(tension)) for tension in tensions]
    for _ in range(WEIGHT_ITERATIONS if cables_have_weight(symbolic_robot) else 1):
        weights = _cable_weights(mathematics, symbolic_robot, routes, result)
        remaining_load = casadi.mtimes(basis, load - casadi.sum2(_wrenches(arms, weights)))
        result = _distribute_symbolically(directions_in_basis, remaining_load, result, at_limit, limits.preferred)
    return result


def _relative_arms(nominal: Robot, robot: Robot, orientation: Quaternion) -> list[Vector]:
    """Arms of the cables' forces about the origin over the platform's size; none of a point mass."""
    if not nominal.platform.is_rigid_body:
        return []
    start, size = robot.platform.start, platform_size(nominal)
    return [scale(1.0 / size, subtract(p, start)) for p in attachment_points(robot, start, orientation)]


def _wrenches(arms: Sequence[Vector], forces: Sequence[Vector]) -> SX:
    """Forces with their moments about the origin over the platform's size, a column each; forces alone without arms."""
    rows = casadi.horzcat(*(casadi.vertcat(*map(SX, force)) for force in forces))
    if not arms:
        return rows
    moments = [casadi.vertcat(*map(SX, cross(arm, force))) for arm, force in zip(arms, forces, strict=True)]
    return casadi.vertcat(rows, casadi.horzcat(*moments))


def _load_wrench(nominal: Robot, robot: Robot, orientation: Quaternion, mathematics: Mathematics) -> SX:
    """Load that the cables balance, in the form of :func:`_wrenches`."""
    force = static_load(mathematics, robot, robot.platform.start)
    if not nominal.platform.is_rigid_body:
        return _wrenches([], [force])
    arm = scale(1.0 / platform_size(nominal), rotate(orientation, centre_of_mass(robot, mathematics)))
    return _wrenches([arm], [force])


def _cable_weights(
    mathematics: Mathematics, robot: Robot, routes: Sequence[Route], tensions: Sequence[SX]
) -> list[Vector]:
    """Forces of the cables on the platform beside their tensions, in N."""
    return [
        stages.end_forces(mathematics, cable_effects(robot, index), robot.gravity, route, tension)[0]
        for index, (route, tension) in enumerate(zip(routes, tensions, strict=True), start=1)
    ]


def _wrench_basis(wrenches: Array) -> Array:
    """Orthonormal basis of the wrenches that the cables can exert; the coordinate axes if these span the space."""
    basis, singular_values, _ = np.linalg.svd(wrenches)
    rank = int(np.sum(singular_values > SINGULARITY_TOLERANCE))
    return np.eye(rank) if rank == len(wrenches) else basis[:, :rank]


def _distribute_symbolically(
    wrenches: SX, remaining_load: SX, tensions: list[SX], at_limit: NDArray[np.bool_], preferred: float
) -> list[SX]:
    """Tensions with those not at a limit recomputed to balance ``remaining_load``."""
    free_cables = np.flatnonzero(~at_limit).tolist()
    for index in np.flatnonzero(at_limit).tolist():
        remaining_load = remaining_load - wrenches[:, index] * tensions[index]
    free_wrenches = wrenches[:, free_cables]
    if free_wrenches.shape[0] == free_wrenches.shape[1] == len(tensions):
        free_tensions = casadi.solve(free_wrenches, remaining_load)
    else:
        load_residual = remaining_load - preferred * casadi.sum2(free_wrenches)
        free_tensions = preferred + casadi.mtimes(_pseudo_inverse(free_wrenches), load_residual)
    result = list(tensions)
    for position, index in enumerate(free_cables):
        result[index] = free_tensions[position]
    return result


def _pseudo_inverse(matrix: SX) -> SX:
    """Moore-Penrose inverse of a matrix of full rank."""
    if matrix.shape[1] < matrix.shape[0]:
        return casadi.solve(casadi.mtimes(matrix.T, matrix), matrix.T)
    return casadi.solve(casadi.mtimes(matrix, matrix.T), matrix).T
