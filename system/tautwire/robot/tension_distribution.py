"""Tension distribution of a redundantly actuated robot: which of all balancing tensions its cables carry."""

from __future__ import annotations

from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from .schema import TensionLimits

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
