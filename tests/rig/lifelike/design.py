"""Robots of all sizes, by lot: from a desktop of 1 m with 1 kg to 100 m with hundreds of kg, on 2 to 8 cables."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.rig.pose_program import pose_wander
from tests.rig.program import Program
from tests.rig.robot import Noise, Robot, TensionLimits, Vector
from tests.rig.statics import start_tensions
from tests.rig.wander import natural_frequencies, wander

GRAVITY = 9.81
HIGHEST_MODE = 12.0
# rad, by which platforms turn where their cables can turn them.
TILT = 0.15
# Exit points above and below, by the number of cables.
LEVELS = {3: ((3, 0),), 4: ((4, 0),), 5: ((3, 2),), 6: ((3, 3), (4, 2)), 7: ((4, 3),), 8: ((4, 4),)}
PLANAR_LEVELS = {2: (2, 0), 3: (2, 1), 4: (2, 2)}


@dataclass(frozen=True)
class Design:
    """A robot as declared, how wide it is (m), whether its cables lie in the plane y = 0, and its start tensions."""

    robot: Robot
    width: float
    planar: bool
    tension: Vector

    @property
    def usual_tension(self) -> float:
        """Mean of the start tensions, N."""
        return float(self.tension.mean())

    @property
    def weight(self) -> float:
        """N."""
        return self.robot.mass * self.robot.gravity

    @property
    def length(self) -> float:
        """Mean length of the ropes at the start, m."""
        return float(np.linalg.norm(self.robot.anchors - self.robot.start, axis=1).mean())

    @property
    def slow(self) -> tuple[float, float]:
        """Bounds of the slow periods of its motions, s."""
        lowest = 4.0 * self.width**0.25
        return lowest, 3.0 * lowest

    @property
    def size(self) -> float:
        """Of a platform that turns: by how much an angle moves its attachments, m; else zero."""
        body = self.robot.body
        return 0.0 if body is None else float(np.linalg.norm(body.attachments, axis=1).mean())

    def program(self, seed: int) -> Program:
        """A rich way for its winches."""
        if self.robot.body is not None:
            tilt = TILT if self.robot.count >= 6 else 0.0
            return pose_wander(self.robot, seed, 0.06 * self.width, tilt, slow=self.slow, shake=0.15)
        return wander(self.robot, seed, 0.08 * self.width, slow=self.slow, shake=0.15)


def design(random: np.random.Generator, cables: int | None = None, planar: bool | None = None) -> Design:
    """A robot that its ropes hold tight around its start."""
    if planar is None:
        planar = bool(random.random() < 0.15)
    if cables is None:
        cables = 4 if planar else int(random.choice(list(LEVELS), p=[0.4, 0.2, 0.08, 0.12, 0.05, 0.15]))
    for _ in range(200):
        try:
            made = _drawn(random, cables, planar)
            made.program(1)
        except ValueError:
            continue
        return made
    raise ValueError(f"no robot on {cables} cables came out")


def _drawn(random: np.random.Generator, count: int, planar: bool) -> Design:
    width = float(np.exp(random.uniform(0.0, np.log(100.0 if not planar else 10.0))))
    height = width * random.uniform(0.5, 0.8)
    mass = float(width**1.25 * np.exp(random.normal(scale=0.3)))
    if planar:
        above, below = PLANAR_LEVELS[count]
        anchors = np.vstack([_line(random, above, width, height), _line(random, below, width, 0.0)])
        middle = np.array([0.0, 0.0, height * random.uniform(0.35, 0.5)])
        aside = np.array([random.uniform(-0.08, 0.08) * width, 0.0, 0.0])
    else:
        above, below = LEVELS[count][random.integers(len(LEVELS[count]))]
        turn = random.uniform(0.0, 2.0 * np.pi)
        anchors = np.vstack([_ring(random, above, width, height, turn), _ring(random, below, width, 0.0, turn)])
        middle = np.array([0.0, 0.0, height * random.uniform(0.2, 0.45)])
        aside = np.append(random.uniform(-0.08, 0.08, 2) * width, 0.0)
    shift = np.round(np.array([random.uniform(0, width), 0.0 if planar else random.uniform(0, width), 0.0]), 1)
    places, start = np.round(anchors + shift, 3), np.round(middle + aside + shift, 3)
    weight = mass * GRAVITY
    preferred = weight * (random.uniform(0.4, 1.0) if below else 0.45)
    limits = TensionLimits(minimum=0.05 * preferred, maximum=10.0 * weight, preferred=float(f"{preferred:.3g}"))
    robot = Robot(
        name="planar" if planar else "spatial",
        gravity=GRAVITY,
        mass=float(f"{mass:.3g}"),
        start=start,
        anchors=places,
        modulus=np.full(count, float(random.choice([2e9, 6e10, 1.0e11, 1.3e11]))),
        area=np.ones(count),
        damping=np.zeros(count),
        linear=np.zeros(count, bool),
        tension=limits,
        noise=Noise(),
    )
    return _roped(random, robot, width, planar)


def _roped(random: np.random.Generator, robot: Robot, width: float, planar: bool) -> Design:
    """With ropes whose stretch and damping suit the load, and sensors that suit the size."""
    from dataclasses import replace

    span = robot.anchors - robot.start
    direction = span / np.linalg.norm(span, axis=1, keepdims=True)
    tension = start_tensions(direction, np.array([0.0, 0.0, -robot.mass * GRAVITY]), robot.tension)
    usual = float(tension.mean())
    strain = float(np.exp(random.uniform(np.log(5e-4), np.log(4e-3))))
    for _ in range(20):
        area = float(f"{usual / strain / robot.modulus[0]:.4g}")
        made = replace(robot, area=np.full(robot.count, area))
        modes = natural_frequencies(made)
        if modes.max() < HIGHEST_MODE:
            break
        strain *= 1.3
    damping_ratio = np.exp(random.uniform(np.log(0.008), np.log(0.04)))
    damping = float(f"{2.0 * damping_ratio * robot.modulus[0] / (2 * np.pi * modes.max()):.2g}")
    size, lots = width**0.5, np.exp(random.normal(scale=0.3, size=3))
    noise = Noise(
        position=float(f"{3e-5 * size * lots[0]:.2g}"),
        tension=float(f"{1.5e-3 * usual * lots[1]:.2g}"),
        winch_speed=float(f"{2e-5 * size * lots[2]:.2g}"),
    )
    made = replace(made, damping=np.full(robot.count, damping), noise=noise)
    return Design(made, width, planar, tension)


def _ring(random: np.random.Generator, count: int, width: float, height: float, turn: float) -> Vector:
    angles = turn + 2.0 * np.pi * (np.arange(count) + random.uniform(-0.08, 0.08, count)) / max(count, 1)
    radii = 0.5 * width * random.uniform(0.85, 1.15, count)
    heights = height + 0.04 * width * random.uniform(0.0, 1.0, count)
    return np.column_stack([radii * np.cos(angles), radii * np.sin(angles), heights])


def _line(random: np.random.Generator, count: int, width: float, height: float) -> Vector:
    places = np.linspace(-0.5, 0.5, count) if count > 1 else np.zeros(count)
    across = width * (places + random.uniform(-0.04, 0.04, count))
    return np.column_stack([across, np.zeros(count), height + 0.04 * width * random.uniform(0.0, 1.0, count)])
