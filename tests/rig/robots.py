"""Robots for tests, made in memory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.rig.robot import Robot, TensionLimits


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


def with_law(robot: Robot, law: str) -> Robot:
    """The robot with another tension law, "linear" or "logarithmic", on every cable."""
    return replace(robot, linear=np.full(robot.count, law == "linear"))
