"""Robots for tests, made in memory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.rig.robot import Body, Robot, TensionLimits
from tests.rig.turning import cayley


def robot_of(anchors: object, start: object, mass: float, modulus: float, area: float = 1.25664e-5) -> Robot:
    """A robot of equal undamped cables; m, kg, Pa, m^2."""
    places = np.array(anchors, float)
    count = len(places)
    return Robot(
        gravity=9.8,
        mass=mass,
        start=np.array(start, float),
        anchors=places,
        modulus=np.full(count, modulus),
        area=np.full(count, area),
        damping=np.zeros(count),
        linear=np.zeros(count, bool),
    )


def paper_robot(modulus: float = 1.348e11) -> Robot:
    """The paper's three-cable robot, with its dynamic modulus at 2 Hz."""
    return robot_of([[0, 50, 50], [0, -50, 50], [86.6, 0, 50]], [28.86, 0, 5], 300.0, modulus)


def symmetric_robot(radius: float = 4.0, height: float = 3.0) -> Robot:
    """Three soft cables at 120 degrees; the platform hangs on the axis at the origin."""
    angles = 2 * np.pi * np.arange(3) / 3
    anchors = np.column_stack([radius * np.cos(angles), radius * np.sin(angles), np.full(3, height)])
    return robot_of(anchors, [0, 0, 0], 50.0, 1e9)


def eight_robot() -> Robot:
    """Eight ropes from the corners of a room."""
    corners = [[x, y, z] for z in (6, 0) for x, y in ((0, 0), (10, 0), (10, 8), (0, 8))]
    limits = TensionLimits(minimum=100.0, maximum=4000.0, preferred=600.0)
    return replace(robot_of(corners, [4, 4.5, 2.5], 60.0, 6e10, 3.2e-6), tension=limits)


def crane() -> Robot:
    """A platform of 80 kg on eight ropes from the corners of a room, the upper ones and the lower ones crossed."""
    anchors = np.array([[x * 4.0, y * 3.0, z] for z in (4.0, 0.0) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    corners = np.array([[-0.5, -0.4], [0.5, -0.4], [0.5, 0.4], [-0.5, 0.4]])
    upper = np.column_stack([np.roll(corners, 1, axis=0), np.full(4, 0.35)])
    lower = np.column_stack([np.roll(corners, 3, axis=0), np.full(4, -0.3)])
    body = Body(
        inertia=np.array([[9.0, 0.4, -0.3], [0.4, 11.0, 0.2], [-0.3, 0.2, 14.0]]),
        centre=np.array([0.02, -0.03, 0.05]),
        attachments=np.vstack([upper, lower]) * np.linspace(0.9, 1.1, 8)[:, None],
        orientation=cayley(np.array([0.02, -0.01, 0.03])),
    )
    robot = robot_of(anchors, [0.2, -0.1, 1.8], 80.0, 6e10, 3.2e-6)
    limits = TensionLimits(minimum=50.0, maximum=5000.0, preferred=1500.0)
    return replace(robot, tension=limits, body=body, damping=np.full(8, 1e8))


def swing() -> Robot:
    """A platform of 60 kg that hangs in four ropes, level by its asymmetries only nearly."""
    anchors = [[-3.0, -2.5, 4.0], [3.2, -2.4, 4.1], [2.9, 2.6, 3.9], [-3.1, 2.5, 4.0]]
    body = Body(
        inertia=np.array([[4.0, 0.1, -0.2], [0.1, 5.0, 0.15], [-0.2, 0.15, 6.0]]),
        centre=np.array([0.01, -0.02, -0.15]),
        attachments=np.array([[-0.4, -0.3, 0.2], [0.42, -0.3, 0.21], [0.4, 0.32, 0.2], [-0.4, 0.3, 0.19]]),
    )
    return replace(robot_of(anchors, [0.1, -0.05, 1.2], 60.0, 6e10, 3.2e-6), body=body, damping=np.full(4, 1e8))


def with_law(robot: Robot, law: str) -> Robot:
    """The robot with another tension law, "linear" or "logarithmic", on every cable."""
    return replace(robot, linear=np.full(robot.count, law == "linear"))
