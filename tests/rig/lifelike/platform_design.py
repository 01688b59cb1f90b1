"""Robots whose platform turns, by lot: on eight cables that hold it in all directions, or hanging in four."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.rig.lifelike.design import GRAVITY, HIGHEST_MODE, Design
from tests.rig.mechanics import Rig
from tests.rig.modes import frequencies_of
from tests.rig.program import StillProgram
from tests.rig.robot import Body, Noise, Robot, TensionLimits, Vector

CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
# Of four cables, which leave two swings of a hanging platform free.
LOWEST_MODE = 0.1


def platform_design(random: np.random.Generator, cables: int) -> Design:
    """A robot with a platform that its 4 or 8 ropes hold tight around its start."""
    for _ in range(200):
        try:
            made = _drawn(random, cables)
            made.program(1)
        except ValueError:
            continue
        return made
    raise ValueError(f"no platform on {cables} cables came out")


def _drawn(random: np.random.Generator, count: int) -> Design:
    width = float(np.exp(random.uniform(np.log(2.0), np.log(20.0))))
    height = width * random.uniform(0.5, 0.7)
    mass = float(f"{width**1.25 * np.exp(random.normal(scale=0.3)):.3g}")
    size = 0.1 * width * random.uniform(0.7, 1.2)
    start = np.round([*random.uniform(-0.05, 0.05, 2) * width, height * random.uniform(0.35, 0.5)], 3)
    body = _body(random, count, mass, size)
    weight = mass * GRAVITY
    robot = Robot(
        name="platform",
        gravity=GRAVITY,
        mass=mass,
        start=start,
        anchors=_anchors(random, count, width, height),
        modulus=np.full(count, float(random.choice([6e10, 1.0e11, 1.3e11]))),
        area=np.ones(count),
        damping=np.zeros(count),
        linear=np.zeros(count, bool),
        tension=TensionLimits(0.05 * weight, 20.0 * weight, float(f"{weight * random.uniform(1.0, 2.0):.3g}")),
        body=body,
    )
    return _roped(random, robot, width, size)


def _anchors(random: np.random.Generator, count: int, width: float, height: float) -> Vector:
    corners = 0.5 * width * CORNERS * [1.0, 0.8]
    levels = [height, 0.0][: count // 4]
    anchors = np.vstack([np.column_stack([corners, np.full(4, level)]) for level in levels])
    return np.round(anchors + random.uniform(-0.03, 0.03, anchors.shape) * width, 3)


def _body(random: np.random.Generator, count: int, mass: float, size: float) -> Body:
    """A box; the ropes of eight turn it against each other, above and below, those of four hold it above its centre."""
    corners = size * CORNERS * [1.0, 0.8]
    if count == 8:
        upper, lower = np.roll(corners, 1, axis=0), np.roll(corners, 3, axis=0)
        attachments = np.vstack([np.column_stack([c, np.full(4, z)]) for c, z in ((upper, size), (lower, -size))])
        sunk = 0.0
    else:
        attachments, sunk = np.column_stack([corners, np.full(4, 0.3 * size)]), 0.4
    # The axes of the box lean a little in its frame.
    axes = np.linalg.qr(np.eye(3) + random.normal(scale=0.05, size=(3, 3)))[0]
    moments = mass * size**2 * np.array([0.55, 0.6, 0.8]) * random.uniform(0.85, 1.15, 3)
    inertia = (axes * moments) @ axes.T
    inertia = 0.5 * (inertia + inertia.T)
    digits = 4 - int(np.floor(np.log10(moments.max())))
    return Body(
        inertia=np.round(inertia, digits),
        centre=np.round(size * (random.uniform(-0.06, 0.06, 3) - [0.0, 0.0, sunk]), 4),
        attachments=np.round(attachments * random.uniform(0.9, 1.1, (count, 3)), 4),
    )


def _roped(random: np.random.Generator, robot: Robot, width: float, size: float) -> Design:
    """With the start in equilibrium, ropes whose stretch and damping suit the load, and sensors that suit the size."""
    still = Rig(robot, {}, StillProgram(robot.count))
    assert robot.body is not None and still.turning is not None
    robot = replace(robot, body=replace(robot.body, orientation=still.turning.start))
    tension = still.start_tension
    usual = float(tension.mean())
    strain = float(np.exp(random.uniform(np.log(5e-4), np.log(3e-3))))
    for _ in range(20):
        made = replace(robot, area=np.full(robot.count, float(f"{usual / strain / robot.modulus[0]:.4g}")))
        modes = frequencies_of(made)
        if modes.max() < HIGHEST_MODE:
            break
        strain *= 1.3
    if modes.min() < LOWEST_MODE or tension.min() < 0.15 * usual:
        raise ValueError("a platform that hardly stays where it is")
    damping_ratio = np.exp(random.uniform(np.log(0.008), np.log(0.04)))
    damping = float(f"{2.0 * damping_ratio * robot.modulus[0] / (2 * np.pi * modes.max()):.2g}")
    large, lots = width**0.5, np.exp(random.normal(scale=0.3, size=4))
    noise = Noise(
        position=float(f"{3e-5 * large * lots[0]:.2g}"),
        tension=float(f"{1.5e-3 * usual * lots[1]:.2g}"),
        winch_speed=float(f"{2e-5 * large * lots[2]:.2g}"),
        orientation=float(f"{3e-5 * large / size * lots[3]:.2g}"),
    )
    return Design(replace(made, damping=np.full(robot.count, damping), noise=noise), width, False, tension)
