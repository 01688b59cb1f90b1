"""The orientation in which fewer than six cables hold a platform: the nearest to a declared one that is in equilibrium.

min g.g/2 with h(g, T) = A(g) T + w(g) = 0 and T >= 0: a search, and then the root of its Lagrangian's gradient.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize, root

from tests.rig.robot import Vector

STEP = 1e-5
LEFT = 1e-10


def hanging(balance: Callable[[Vector], tuple[Vector, Vector]], count: int) -> Vector:
    """Gibbs vector at which tensions balance a load; `balance` gives A (6, n) and w (6) for one, in like units."""
    matrix, load = balance(np.zeros(3))
    size = float(np.linalg.norm(load))
    weights = np.array([1.0] * 3 + [0.0] * count)

    def left(unknown: Vector) -> Vector:
        matrix, load = balance(unknown[:3])
        return matrix @ unknown[3:] + load / size

    def gradient(unknown: Vector) -> Vector:
        place, multipliers = unknown[: 3 + count], unknown[3 + count :]
        return np.concatenate([weights * place + multipliers @ _slopes(left, place), left(place)])

    tensions = np.linalg.lstsq(matrix, -load / size, rcond=None)[0]
    found = minimize(
        lambda unknown: 0.5 * float(unknown[:3] @ unknown[:3]),
        np.concatenate([np.zeros(3), np.maximum(tensions, 0.0)]),
        jac=lambda unknown: weights * unknown,
        method="SLSQP",
        bounds=[(-1.0, 1.0)] * 3 + [(0.0, None)] * count,
        constraints={"type": "eq", "fun": left, "jac": lambda unknown: _slopes(left, unknown)},
        options={"maxiter": 300, "ftol": 1e-14},
    ).x
    multipliers = np.linalg.lstsq(_slopes(left, found).T, -weights * found, rcond=None)[0]
    refined = root(gradient, np.concatenate([found, multipliers]), tol=1e-13).x[: 3 + count]
    if np.linalg.norm(left(refined)) > LEFT or np.any(refined[3:] <= 0.0):
        raise ValueError("no orientation near the declared one is in equilibrium")
    return np.asarray(refined[:3], float)


def _slopes(function: Callable[[Vector], Vector], at: Vector) -> Vector:
    steps = STEP * np.eye(len(at))
    return np.array([(function(at + step) - function(at - step)) / (2.0 * STEP) for step in steps]).T
