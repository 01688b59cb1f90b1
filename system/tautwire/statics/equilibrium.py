"""Static tensions at a position: solved for three cables, distributed for more."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws import point_mass, stages
from tautwire_fmu.laws.effects import BY_NAME, ActiveEffect
from tautwire_fmu.laws.formula import formula_effect
from tautwire_fmu.laws.mathematics import REAL, Mathematics
from tautwire_fmu.laws.stages import Route
from tautwire_fmu.laws.vectors import Vector, add, scale, subtract

from ..errors import UnreachableError
from ..robots.robot import EffectSetting, Formula, Robot, TensionLimits
from .distribution import excess_tensions, nearest_tensions

Array = NDArray[np.float64]

DEFAULT_LIMITS = TensionLimits(minimum=0.0, maximum=float("inf"), preferred=0.0)
PARALLEL = 1e-9
AT_ANCHOR = 1e-6
SWEEPS = 50
SETTLED = 1e-14


def active(setting: EffectSetting) -> ActiveEffect:
    """An effect of the robot file with its numbers, as the laws take it."""
    effect = BY_NAME[setting.name]
    return ActiveEffect(effect, effect.values(**effect.completed(setting.values)))


def cable_effects(robot: Robot, cable: int) -> tuple[ActiveEffect, ...]:
    """The effects of the robot file that act on a cable, its winch or its load cell; ``cable`` counts from 1."""
    return (*map(active, robot.effects_on_cable(cable)), *_active_formulas(robot.formulas_on(cable)))


def formula_texts(formulas: Sequence[Formula]) -> dict[str, list[str]]:
    """The texts of some formulas by their places."""
    return {place: [f.text for f in formulas if f.place == place] for place in dict.fromkeys(f.place for f in formulas)}


def _active_formulas(formulas: Sequence[Formula]) -> tuple[ActiveEffect, ...]:
    """All formulas of a component as one effect, none where there are none."""
    if not formulas:
        return ()
    numbers = {name: value for formula in formulas for name, value in formula.numbers.items()}
    return (ActiveEffect(formula_effect(formula_texts(formulas), tuple(numbers)), numbers),)


def platform_settings(robot: Robot) -> tuple[EffectSetting, ...]:
    """The effects of the robot file that act on the platform or on the sensor of its position."""
    return tuple(s for s in robot.effects if not s.cables or BY_NAME[s.name].component == "sensor")


def has_sensor_effects(robot: Robot) -> bool:
    """Whether sensors show something else than what is."""
    return any(BY_NAME[setting.name].component == "sensor" for setting in robot.effects)


def platform_effects(robot: Robot) -> tuple[ActiveEffect, ...]:
    """Those of :func:`platform_settings` and the formulas on the platform, as the laws take them."""
    return (*map(active, platform_settings(robot)), *_active_formulas(robot.formulas_on()))


def routes(m: Mathematics, robot: Robot, position: Sequence[Any]) -> tuple[Route, ...]:
    """How the ropes run from the platform at a position (m) to their exit points, effects included.

    Raises UnreachableError where a rope has no length there, or the platform is inside a pulley.
    """
    found = []
    for index, anchor in enumerate(robot.anchors, start=1):
        try:
            line = stages.route(m, cable_effects(robot, index), anchor, position)
        except (ArithmeticError, ValueError) as error:
            raise _no_length(robot, position, index) from error
        if isinstance(line.length, float) and not line.length >= AT_ANCHOR:
            raise _no_length(robot, position, index)
        found.append(line)
    return tuple(found)


def directions(robot: Robot, at: Array | None = None) -> Array:
    """Unit vectors of the ropes at the platform, by default at its start, shape (3, n)."""
    position = np.array(robot.platform.start if at is None else at, dtype=float)
    return np.array([line.direction for line in routes(REAL, robot, position.tolist())]).T


def weight(robot: Robot, m: Mathematics = REAL) -> Any:
    """Weight of the platform with all that the robot file puts on it, in N."""
    constants = point_mass.PointMassConstants(robot.platform.mass, robot.gravity)
    return point_mass.total_mass(m, constants, platform_effects(robot)) * robot.gravity


def load(m: Mathematics, robot: Robot, position: Sequence[Any]) -> Vector:
    """What the cables have to hold of the platform at rest, in N: its weight less what effects push it with."""
    effects = platform_effects(robot)
    pushed = point_mass.wrench(m, effects, point_mass.start_states(effects), position, (0.0, 0.0, 0.0))
    return subtract((0.0, 0.0, weight(robot, m)), pushed)


def has_routes(robot: Robot) -> bool:
    """Whether some rope does not run straight to its declared exit point."""
    effects = (BY_NAME[setting.name] for setting in robot.effects)
    return any(effect.exit_point is not None or effect.path is not None for effect in effects)


def has_weight(robot: Robot) -> bool:
    """Whether the ropes' ends carry more than the tension."""
    return any(BY_NAME[setting.name].ends is not None for setting in robot.effects)


def hung(m: Mathematics, robot: Robot, lines: Sequence[Route], tensions: Sequence[Any]) -> Vector:
    """What ropes under tensions (N) put on the platform beside them, in N."""
    total: Vector = (0.0, 0.0, 0.0)
    for index, (line, tension) in enumerate(zip(lines, tensions, strict=True), start=1):
        total = add(total, stages.ends(m, cable_effects(robot, index), robot.gravity, line, tension)[0])
    return total


def held_by(robot: Robot, position: Sequence[float], tensions: Array) -> Array:
    """What tensions (n,) in N along the ropes have to hold of the platform at rest at a position (m), (3,) in N."""
    lines = routes(REAL, robot, position)
    hanging = hung(REAL, robot, lines, tensions.tolist())
    return np.array(subtract(load(REAL, robot, position), hanging), dtype=float)


def static_tensions(robot: Robot, at: Array | None = None) -> Array:
    """Tensions that hold the platform at rest, shape (n,), in N.

    Solves ``sum T_i u_i = m g e_z``, with what effects add to the load and hang on the platform. With more than three
    cables, the tensions nearest to the preferred one (least squares) within the limits of the robot file; without
    limits there, nearest to zero and not negative. ``at`` is a position in m, by default the start.

    Raises UnreachableError where a cable would have to push or to break a limit.
    """
    position = np.array(robot.platform.start if at is None else at, dtype=float)
    lines = routes(REAL, robot, position.tolist())
    unit = np.array([line.direction for line in lines]).T
    held = np.array(load(REAL, robot, position.tolist()), dtype=float)
    solve = _solve_three if len(robot.cables) == 3 else _distribute
    if not has_weight(robot):
        return solve(robot, position, unit, held)

    def sweep(tensions: Array) -> Array:
        return solve(robot, position, unit, held - np.array(hung(REAL, robot, lines, tensions.tolist())))

    return _settled(sweep, np.full(len(lines), float(np.linalg.norm(held))))


def static_forces(robot: Robot) -> Array:
    """Forces of the cables on the platform at its start, shape (n, 3), in N."""
    lines = routes(REAL, robot, robot.platform.start)
    forces = []
    for index, (line, tension) in enumerate(zip(lines, static_tensions(robot).tolist(), strict=True), start=1):
        beside = stages.ends(REAL, cable_effects(robot, index), robot.gravity, line, tension)[0]
        forces.append(add(scale(tension, line.direction), beside))
    return np.array(forces)


def _settled(sweep: Callable[[Array], Array], guess: Array) -> Array:
    """The fixed point of a map that hardly depends on where it starts: ropes are light against their tensions."""
    tensions = guess
    for _ in range(SWEEPS):
        before, tensions = tensions, sweep(tensions)
        if np.max(np.abs(tensions - before)) <= SETTLED * np.max(tensions):
            break
    return tensions


def _no_length(robot: Robot, position: Sequence[Any], cable: int) -> UnreachableError:
    reason = f"cable {cable} has no length there"
    return UnreachableError(robot.name, tuple(map(float, position)), cable=cable, tension=None, reason=reason)


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
    tensions = nearest_tensions(unit, load, limits)
    if tensions is not None:
        return tensions
    excess = excess_tensions(unit, load, limits)
    if not np.all(np.isfinite(excess)):
        raise UnreachableError(
            robot.name,
            position=tuple(position),
            cable=None,
            tension=None,
            reason=f"the {len(excess)} cables lie in one plane there",
        )
    worst = int(np.argmax(np.abs(excess)))
    bound = limits.minimum if excess[worst] < 0.0 else limits.maximum
    raise UnreachableError(
        robot.name,
        position=tuple(position),
        cable=worst + 1,
        tension=bound + float(excess[worst]),
        reason=f"no tensions between {limits.minimum:g} and {limits.maximum:g} N hold the platform there",
    )
