"""The static start's tensions as expressions of a robot's free numbers."""

from __future__ import annotations

import casadi
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from tautwire_fmu.laws.mathematics import Mathematics

from ..robots.robot import Robot
from ..statics.equilibrium import DEFAULT_LIMITS, PARALLEL, directions, has_weight, hung, load, routes, static_tensions

Array = NDArray[np.float64]

AT_BOUND = 1e-6
# Where ropes have weight: each gains some three digits.
SWEEPS = 6


def start_tensions(nominal: Robot, opened: Robot, m: Mathematics) -> list[SX]:
    """Static tensions, N, of a robot some of whose numbers are expressions; ``nominal`` has numbers in their place.

    Cables at a limit stay there, the others share the rest.
    """
    tensions = static_tensions(nominal)
    limits = nominal.tension or DEFAULT_LIMITS
    span = max(float(np.max(tensions)), 1.0) * AT_BOUND
    held = np.zeros(len(tensions), dtype=bool)
    if len(tensions) > 3:
        held = (tensions - limits.minimum < span) | (limits.maximum - tensions < span)
    start = nominal.platform.start
    lines = routes(m, opened, start)
    across = SX(_spanned(directions(nominal))).T
    unit = casadi.mtimes(across, casadi.horzcat(*(casadi.vertcat(*line.direction) for line in lines)))
    weight = SX(casadi.vertcat(*load(m, opened, start)))
    result = [SX(float(tension)) for tension in tensions]
    for _ in range(SWEEPS if has_weight(opened) else 1):
        rest = casadi.mtimes(across, weight - casadi.vertcat(*hung(m, opened, lines, result)))
        result = _shared(unit, rest, result, held, limits.preferred)
    return result


def _spanned(unit: Array) -> Array:
    """A basis of what the cables can push in; the axes themselves where that is everything."""
    basis, size, _ = np.linalg.svd(unit)
    return np.eye(3) if size[-1] > PARALLEL else basis[:, size > PARALLEL]


def _shared(unit: SX, rest: SX, tensions: list[SX], held: NDArray[np.bool_], preferred: float) -> list[SX]:
    """The tensions with those that are not held chosen anew, to hold ``rest``."""
    sharing = np.flatnonzero(~held).tolist()
    for index in np.flatnonzero(held).tolist():
        rest = rest - unit[:, index] * tensions[index]
    own = unit[:, sharing]
    if len(tensions) == 3:
        shares = casadi.solve(own, rest)
    else:
        missing = rest - preferred * casadi.sum2(own)
        shares = preferred + casadi.mtimes(_pseudo_inverse(own), missing)
    result = list(tensions)
    for place, index in enumerate(sharing):
        result[index] = shares[place]
    return result


def _pseudo_inverse(matrix: SX) -> SX:
    """Of a matrix of full rank."""
    if matrix.shape[1] < matrix.shape[0]:
        return casadi.solve(casadi.mtimes(matrix.T, matrix), matrix.T)
    return casadi.solve(casadi.mtimes(matrix, matrix.T), matrix).T
