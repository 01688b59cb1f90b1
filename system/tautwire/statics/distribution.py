"""How the tensions of more than three cables are shared out, and what is missing where no sharing holds the load."""

from __future__ import annotations

from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from ..robots.robot import TensionLimits

Array = NDArray[np.float64]

HELD = 1e-6


def nearest_tensions(unit: Array, load: Array, limits: TensionLimits) -> Array | None:
    """The tensions within their limits that hold a load and lie nearest to the preferred one, shape (n,), in N.

    ``min |T - T_p|^2`` with ``U T = w``, ``T_min <= T_i <= T_max``. Their dependence on ``U`` and ``w`` is
    continuous, as the aim is strictly convex. ``unit`` U (3, n) points from the platform to the exit points, ``load``
    w (3,) is in N. None where there are no such tensions.
    """
    count = unit.shape[1]
    problem: Any = {"h": casadi.Sparsity.dense(count, count), "a": casadi.Sparsity.dense(3, count)}
    solver = casadi.conic("tension_distribution", "daqp", problem, {"error_on_fail": False})
    scale = max(float(np.linalg.norm(load)), 1.0)
    solution = solver(
        h=np.eye(count),
        g=-np.full(count, limits.preferred / scale),
        a=unit,
        lba=load / scale,
        uba=load / scale,
        lbx=limits.minimum / scale,
        ubx=limits.maximum / scale,
    )
    tensions: Array = np.asarray(solution["x"], dtype=float).ravel() * scale
    # The solver passes over a row of zeros, as of cables that lie in one plane.
    held = np.linalg.norm(unit @ tensions - load) <= HELD * scale
    return tensions if solver.stats()["success"] and held else None


def excess_tensions(unit: Array, load: Array, limits: TensionLimits) -> Array:
    """By how much each cable must leave its limits to hold a load, shape (n,), in N; negative below, positive above.

    ``min |s|^2`` with ``U (b + s) = w``, ``T_min <= b_i <= T_max``: of all tensions ``b + s`` that hold the load,
    those that break the limits least. Cables that need not break them have zero. Not a number where the cables cannot
    make the load at all, as those that lie in one plane.
    """
    scale = max(float(np.linalg.norm(load)), 1.0)
    across, stretch, _ = np.linalg.svd(unit, full_matrices=False)
    spanned = stretch > 1e-9 * stretch[0]
    rows = (across[:, spanned] / stretch[spanned]).T
    left = load - across[:, spanned] @ (across[:, spanned].T @ load)
    if np.linalg.norm(left) > 1e-9 * scale:
        return np.full(unit.shape[1], np.nan)
    found = lsq_linear(
        rows @ unit, rows @ load / scale, bounds=(limits.minimum / scale, limits.maximum / scale), method="bvls"
    )
    excess: Array = scale * unit.T @ (rows.T @ (rows @ load / scale - rows @ unit @ found.x))
    return excess
