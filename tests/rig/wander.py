"""Plans rich winch programs that keep every rope tight."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tests.rig.program import PathProgram
from tests.rig.robot import Robot, Vector
from tests.rig.statics import span_of, start_tensions


def natural_frequencies(robot: Robot) -> Vector:
    """Undamped modes at the start, Hz: K = sum (E S/l) u u' + (T0/l)(1 - u u')."""
    span = robot.anchors - robot.start
    length = np.linalg.norm(span, axis=1)
    direction = span / length[:, None]
    weight = np.array([0.0, 0.0, -robot.mass * robot.gravity])
    tension = start_tensions(direction, weight, robot.tension)
    along = (robot.modulus * robot.area - tension) / length
    stiffness = (direction * along[:, None]).T @ direction + np.sum(tension / length) * np.eye(3)
    return np.sqrt(np.linalg.eigvalsh(stiffness) / robot.mass) / (2 * np.pi)


def wander(
    robot: Robot,
    seed: int,
    reach: float,
    centre: Sequence[float] | None = None,
    slow: tuple[float, float] = (8.0, 25.0),
    shake: float = 0.2,
) -> PathProgram:
    """A rich program: slow tones within `reach` (m) of `centre`, and fast ones that shake the ropes.

    `slow` bounds the slow periods, s; each fast tone has an acceleration near `shake`, m/s^2.
    The reach shrinks until stiff ropes would stay tight along the whole way.
    """
    random = np.random.default_rng(seed)
    basis = span_of(robot.anchors - robot.start)
    plane = basis.T @ basis
    modes = natural_frequencies(robot)[3 - len(basis) :]
    slow_angular = 2 * np.pi / random.uniform(*slow, size=4)
    slow_amplitudes = _spread(random, 4) @ plane * reach * 0.5
    ratios = np.array([0.3, 0.5, 0.75, 1.35, 1.9]) * random.uniform(0.95, 1.05, 5)
    fast_angular = 2 * np.pi * ratios * np.exp(np.log(modes).mean())
    fast_amplitudes = _spread(random, 5) @ plane * (shake / fast_angular**2)[:, None]
    phases = random.uniform(0, 2 * np.pi, (9, 3))
    middle = robot.start if centre is None else np.asarray(centre, float)
    for _ in range(30):
        program = PathProgram(
            anchors=robot.anchors,
            start=robot.start,
            shift=middle - robot.start,
            amplitudes=np.vstack([slow_amplitudes, fast_amplitudes]),
            angular=np.concatenate([slow_angular, fast_angular]),
            phases=phases,
            rise=0.75 * slow[0],
        )
        if _stays_tight(robot, program):
            return program
        slow_amplitudes = slow_amplitudes * 0.85
    raise ValueError("no reach keeps every rope tight here")


def _spread(random: np.random.Generator, count: int) -> Vector:
    """Random directions with lengths between 0.6 and 1."""
    directions = random.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return directions * random.uniform(0.6, 1.0, (count, 1))


def _stays_tight(robot: Robot, program: PathProgram, share: float = 0.4) -> bool:
    """Whether static tensions stay above a share of the smallest start tension over a minute."""
    weight = np.array([0.0, 0.0, -robot.mass * robot.gravity])
    floor: float | None = None
    for time in np.arange(0.0, 60.0, 0.5):
        span = robot.anchors - program.path(float(time))[0]
        direction = span / np.linalg.norm(span, axis=1, keepdims=True)
        try:
            lowest = float(start_tensions(direction, weight, robot.tension).min())
        except ValueError:
            return False
        floor = share * lowest if floor is None else floor
        if lowest < floor:
            return False
    return True
