"""The static start as CasADi expressions of a robot's free parameters: its tensions, and its orientation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws.effect_stages import Route
from tautwire_fmu.laws.mathematics import REAL, Mathematics
from tautwire_fmu.laws.rotation import Quaternion, multiply, rotate, rotation_vector_of
from tautwire_fmu.laws.vectors import Vector, cross, scale, subtract

from .active_effects import cable_effects, cables_have_weight, centre_of_mass
from .cable_routes import attachment_points, cable_routes
from .rigid_equilibrium import platform_size
from .schema import Robot
from .static_equilibrium import SINGULARITY_TOLERANCE, start_orientation, static_tensions
from .static_load import static_load
from .tension_distribution import DEFAULT_LIMITS

Array = NDArray[np.float64]

LIMIT_TOLERANCE = 1e-6
# Where cables have weight: each iteration gains some three digits.
WEIGHT_ITERATIONS = 6


@dataclass(frozen=True)
class SymbolicStatics:
    """The static start: ``tensions`` (n,) in N, and ``rotation`` (3,) in rad from a reference, empty of a point mass.

    ``orientation`` is that of the platform there, a unit quaternion.
    """

    tensions: list[SX]
    rotation: SX
    orientation: Quaternion


def symbolic_statics(
    nominal: Robot, symbolic_robot: Robot, reference: Quaternion, mathematics: Mathematics
) -> SymbolicStatics:
    """Static start of a robot with symbolic parameters; ``nominal`` has numbers instead.

    Cables at a tension limit stay there, the others share the remaining load.
    """
    orientation = start_orientation(nominal)
    tensions = _start_tensions(nominal, symbolic_robot, orientation, mathematics)
    if not nominal.platform.is_rigid_body:
        return SymbolicStatics(tensions, SX(0, 1), orientation)
    w, x, y, z = reference
    turned = rotation_vector_of(REAL, multiply(orientation, (w, -x, -y, -z)))
    return SymbolicStatics(tensions, SX(list(turned)), orientation)


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
