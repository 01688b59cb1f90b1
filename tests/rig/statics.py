"""Start tensions: what statics asks for, or the distribution nearest to the preferred tension."""

from __future__ import annotations

import numpy as np
from scipy import optimize

from tests.rig.robot import TensionLimits, Vector

# Of the load: how far below zero rounding puts the tension of a rope that is just slack.
SLACK_TOLERANCE = 1e-12


def start_tensions(directions: Vector, load: Vector, limits: TensionLimits) -> Vector:
    """Tensions T with sum T_i u_i = -load, N; `directions` holds u_i by rows, `load` in N.

    Ropes in one plane hold a load in that plane. Of a platform that turns, rows and load have moments behind the
    forces, divided by a length.
    """
    basis = span_of(directions)
    if not holds(directions.T, load):
        raise ValueError("the ropes lie in a plane and the load does not")
    within, wanted = directions @ basis.T, basis @ load
    if len(directions) == len(basis):
        tensions = np.linalg.solve(within.T, -wanted)
    else:
        tensions = nearest_to_preferred(within, wanted, limits)
    if np.any(tensions < -SLACK_TOLERANCE * np.linalg.norm(load)):
        raise ValueError(f"a cable would have to push at the start: {tensions} N")
    return np.maximum(tensions, 0.0)


def holds(matrix: Vector, load: Vector) -> bool:
    """Whether cables, by columns, could hold a load if they could push."""
    basis = span_of(matrix.T)
    return bool(np.linalg.norm(load - basis.T @ (basis @ load)) <= 1e-9 * np.linalg.norm(load))


def nearest_to_preferred(directions: Vector, load: Vector, limits: TensionLimits) -> Vector:
    """Minimise sum (T_i - preferred)^2 under equilibrium and minimum <= T_i <= maximum.

    Optimality gives T = clip(preferred + u_i . m, minimum, maximum); the multipliers m (N)
    follow from equilibrium, as the minimum of the convex dual.
    """

    def tensions(multipliers: Vector) -> Vector:
        return np.clip(limits.preferred + directions @ multipliers, limits.minimum, limits.maximum)

    def imbalance(multipliers: Vector) -> Vector:
        return directions.T @ tensions(multipliers) + load

    def jacobian(multipliers: Vector) -> Vector:
        raw = limits.preferred + directions @ multipliers
        free = (raw > limits.minimum) & (raw < limits.maximum)
        return (directions * free[:, None]).T @ directions

    missing = load + directions.T @ (limits.preferred * np.ones(len(directions)))
    guess = -np.linalg.lstsq(directions.T @ directions, missing, rcond=None)[0]
    scale = np.linalg.norm(load) + 1.0
    result = optimize.least_squares(imbalance, guess, jacobian, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    if np.linalg.norm(imbalance(result.x)) > 1e-9 * scale:
        raise ValueError("no tensions within the limits hold the platform at its start")
    return tensions(result.x)


def span_of(directions: Vector) -> Vector:
    """Unit vectors, by rows, of the directions in which cables can pull: all three, or two of a plane of cables."""
    _, sizes, rows = np.linalg.svd(directions)
    rank = int(np.sum(sizes > 1e-6 * sizes[0]))
    return np.eye(rank) if rank == directions.shape[1] else np.asarray(rows[:rank], float)
