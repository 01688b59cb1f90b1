"""Start tensions: what statics asks for, or the distribution nearest to the preferred tension."""

from __future__ import annotations

import numpy as np
from scipy import optimize

from tests.rig.robot import TensionLimits, Vector


def start_tensions(directions: Vector, load: Vector, limits: TensionLimits) -> Vector:
    """Tensions T with sum T_i u_i = -load, N; `directions` holds u_i by rows, `load` in N."""
    if len(directions) == 3:
        tensions = np.linalg.solve(directions.T, -load)
    else:
        tensions = nearest_to_preferred(directions, load, limits)
    if np.any(tensions <= 0):
        raise ValueError(f"not every cable pulls at the start: {tensions} N")
    return tensions


def nearest_to_preferred(directions: Vector, load: Vector, limits: TensionLimits) -> Vector:
    """Minimise sum (T_i - preferred)^2 under equilibrium and minimum <= T_i <= maximum.

    Optimality gives T = clip(preferred + u_i . m, minimum, maximum); the three multipliers m (N)
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

    missing = load + limits.preferred * directions.sum(axis=0)
    # Cables in one plane leave the multiplier across it open.
    guess = -np.linalg.lstsq(directions.T @ directions, missing, rcond=None)[0]
    scale = np.linalg.norm(load) + 1.0
    result = optimize.least_squares(imbalance, guess, jacobian, xtol=1e-15, ftol=1e-15, gtol=1e-15)
    if np.linalg.norm(imbalance(result.x)) > 1e-9 * scale:
        raise ValueError("no tensions within the limits hold the platform at its start")
    return tensions(result.x)
