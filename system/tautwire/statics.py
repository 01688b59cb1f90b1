"""Static tensions at a position: solved for three cables, distributed for more."""

from __future__ import annotations

from typing import Any

import casadi
import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws import point_mass
from tautwire_fmu.laws.effects import BY_NAME, ActiveEffect
from tautwire_fmu.laws.mathematics import REAL

from .errors import UnreachableError
from .robot import EffectSetting, Robot, TensionLimits

Array = NDArray[np.float64]

DEFAULT_LIMITS = TensionLimits(minimum=0.0, maximum=float("inf"), preferred=0.0)
PARALLEL = 1e-9
AT_ANCHOR = 1e-6


def active(setting: EffectSetting) -> ActiveEffect:
    """An effect of the robot file with its numbers, as the laws take it."""
    effect = BY_NAME[setting.name]
    return ActiveEffect(effect, effect.values(**setting.values))


def platform_effects(robot: Robot) -> tuple[ActiveEffect, ...]:
    """The effects of the robot file that act on the platform."""
    return tuple(active(s) for s in robot.effects_elsewhere())


def directions(robot: Robot, at: Array | None = None) -> Array:
    """Unit vectors from the platform, by default at its start, to the exit points, shape (3, n)."""
    spans = np.array([cable.anchor for cable in robot.cables]) - (robot.platform.start if at is None else at)
    unit: Array = (spans / np.linalg.norm(spans, axis=1, keepdims=True)).T
    return unit


def weight(robot: Robot) -> float:
    """Weight of the platform with all that the robot file puts on it, in N."""
    constants = point_mass.PointMassConstants(robot.platform.mass, robot.gravity)
    return float(point_mass.total_mass(REAL, constants, platform_effects(robot)) * robot.gravity)


def static_tensions(robot: Robot, at: Array | None = None) -> Array:
    """Tensions that hold the platform at rest, shape (n,), in N.

    Solves ``sum T_i u_i = m g e_z``. With more than three cables, the tensions nearest to the preferred one (least
    squares) within the limits of the robot file; without limits there, nearest to zero and not negative. ``at`` is
    a position in m, by default the start.

    Raises UnreachableError where a cable would have to push or to break a limit.
    """
    position = np.array(robot.platform.start if at is None else at, dtype=float)
    _refuse_anchors(robot, position)
    unit = directions(robot, position)
    load = np.array([0.0, 0.0, weight(robot)])
    if len(robot.cables) == 3:
        return _solve_three(robot, position, unit, load)
    return _distribute(robot, position, unit, load)


def _refuse_anchors(robot: Robot, position: Array) -> None:
    for index, anchor in enumerate(robot.anchors, start=1):
        if float(np.linalg.norm(np.array(anchor) - position)) < AT_ANCHOR:
            raise UnreachableError(
                robot.name,
                position=tuple(position),
                cable=index,
                tension=None,
                reason=f"cable {index} has no length there",
            )


def _solve_three(robot: Robot, position: Array, unit: Array, load: Array) -> Array:
    if abs(np.linalg.det(unit)) < PARALLEL:
        raise UnreachableError(
            robot.name,
            position=tuple(position),
            cable=None,
            tension=None,
            reason="the three cables lie in one plane there",
        )
    tensions = np.asarray(np.linalg.solve(unit, load), dtype=np.float64)
    worst = int(np.argmin(tensions))
    if tensions[worst] < 0.0:
        raise UnreachableError(
            robot.name,
            position=tuple(position),
            cable=worst + 1,
            tension=float(tensions[worst]),
            reason="a cable cannot push",
        )
    return tensions


def _distribute(robot: Robot, position: Array, unit: Array, load: Array) -> Array:
    limits = robot.tension or DEFAULT_LIMITS
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
    if solver.stats()["success"]:
        tensions: Array = np.asarray(solution["x"], dtype=float).ravel() * scale
        return tensions
    free: Array = limits.preferred + np.linalg.pinv(unit) @ (load - unit @ np.full(count, limits.preferred))
    excess = np.maximum(limits.minimum - free, free - limits.maximum)
    worst = int(np.argmax(excess))
    raise UnreachableError(
        robot.name,
        position=tuple(position),
        cable=worst + 1,
        tension=float(free[worst]),
        reason=f"no tensions between {limits.minimum:g} and {limits.maximum:g} N hold the platform there",
    )
