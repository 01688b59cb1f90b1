"""The static start tensions as CasADi expressions of a robot's free parameters."""

from __future__ import annotations

import casadi
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from tautwire_fmu.laws.mathematics import Mathematics

from .active_effects import cables_have_weight
from .cable_routes import cable_routes, unit_directions
from .schema import Robot
from .static_equilibrium import SINGULARITY_TOLERANCE, static_tensions
from .static_load import cable_weight_force, static_load
from .tension_distribution import DEFAULT_LIMITS

Array = NDArray[np.float64]

LIMIT_TOLERANCE = 1e-6
# Where cables have weight: each iteration gains some three digits.
WEIGHT_ITERATIONS = 6


def symbolic_start_tensions(nominal: Robot, symbolic_robot: Robot, mathematics: Mathematics) -> list[SX]:
    """Static tensions, in N, of a robot with symbolic parameters; ``nominal`` has numbers instead.

    Cables at a tension limit stay there, the others share the remaining load.
    """
    tensions = static_tensions(nominal)
    limits = nominal.tension or DEFAULT_LIMITS
    limit_distance = max(float(np.max(tensions)), 1.0) * LIMIT_TOLERANCE
    at_limit = np.zeros(len(tensions), dtype=bool)
    if len(tensions) > 3:
        at_limit = (tensions - limits.minimum < limit_distance) | (limits.maximum - tensions < limit_distance)
    start = symbolic_robot.platform.start
    routes = cable_routes(mathematics, symbolic_robot, start)
    basis = SX(_wrench_basis(unit_directions(nominal))).T
    directions_in_basis = casadi.mtimes(basis, casadi.horzcat(*(casadi.vertcat(*route.direction) for route in routes)))
    load_vector = SX(casadi.vertcat(*static_load(mathematics, symbolic_robot, start)))
    result = [SX(float(tension)) for tension in tensions]
    for _ in range(WEIGHT_ITERATIONS if cables_have_weight(symbolic_robot) else 1):
        remaining_load = casadi.mtimes(
            basis, load_vector - casadi.vertcat(*cable_weight_force(mathematics, symbolic_robot, routes, result))
        )
        result = _distribute_symbolically(directions_in_basis, remaining_load, result, at_limit, limits.preferred)
    return result


def _wrench_basis(unit_directions: Array) -> Array:
    """Orthonormal basis of the forces that the cables can exert; the coordinate axes if these span the space."""
    basis, singular_values, _ = np.linalg.svd(unit_directions)
    return (
        np.eye(3) if singular_values[-1] > SINGULARITY_TOLERANCE else basis[:, singular_values > SINGULARITY_TOLERANCE]
    )


def _distribute_symbolically(
    unit_directions: SX, remaining_load: SX, tensions: list[SX], at_limit: NDArray[np.bool_], preferred: float
) -> list[SX]:
    """Tensions with those not at a limit recomputed to balance ``remaining_load``."""
    free_cables = np.flatnonzero(~at_limit).tolist()
    for index in np.flatnonzero(at_limit).tolist():
        remaining_load = remaining_load - unit_directions[:, index] * tensions[index]
    free_directions = unit_directions[:, free_cables]
    if len(tensions) == 3:
        free_tensions = casadi.solve(free_directions, remaining_load)
    else:
        load_residual = remaining_load - preferred * casadi.sum2(free_directions)
        free_tensions = preferred + casadi.mtimes(_pseudo_inverse(free_directions), load_residual)
    result = list(tensions)
    for position, index in enumerate(free_cables):
        result[index] = free_tensions[position]
    return result


def _pseudo_inverse(matrix: SX) -> SX:
    """Moore-Penrose inverse of a matrix of full rank."""
    if matrix.shape[1] < matrix.shape[0]:
        return casadi.solve(casadi.mtimes(matrix.T, matrix), matrix.T)
    return casadi.solve(casadi.mtimes(matrix, matrix.T), matrix).T
