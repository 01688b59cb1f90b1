"""Rigid platforms that several tests use."""

from __future__ import annotations

from math import cos, pi, sin

from tautwire.robot.schema import Cable, Platform, Robot, Sensors, TensionLimits

MODULUS, AREA, DAMPING = 1e11, 1.2e-5, 1e8


def cable(anchor: tuple[float, float, float], attachment: tuple[float, float, float]) -> Cable:
    """A steel rope."""
    return Cable(anchor, MODULUS, AREA, DAMPING, "logarithmic", attachment=attachment)


def ring(count: int, radius: float, height: float, phase: float = 0.0) -> list[tuple[float, float, float]]:
    """Points evenly on a horizontal circle."""
    angles = [phase + 2.0 * pi * index / count for index in range(count)]
    return [(radius * cos(angle), radius * sin(angle), height) for angle in angles]


def suspended_robot(count: int, mass: float = 60.0, centre_height: float = -0.1) -> Robot:
    """A platform that hangs level in a ring of cables, its centre of mass on the axis: all tensions are equal."""
    platform = Platform(
        mass,
        (0.0, 0.0, 1.5),
        inertia=((4.0, 0.0, 0.0), (0.0, 4.0, 0.0), (0.0, 0.0, 6.0)),
        centre_of_mass=(0.0, 0.0, centre_height),
    )
    ends = zip(ring(count, 4.0, 5.0), ring(count, 0.4, 0.2), strict=True)
    return Robot("suspended", 9.81, platform, None, Sensors(), tuple(cable(*pair) for pair in ends))


def crane_robot() -> Robot:
    """Eight cables of a suspended platform, crossed as on CoGiRo: four upper corners, two cables each."""
    platform = Platform(
        91.058,
        (0.3, -0.2, 1.5),
        inertia=((36.6, 0.4, -0.3), (0.4, 33.2, 0.2), (-0.3, 0.2, 20.1)),
        centre_of_mass=(0.01, -0.02, 0.26),
        start_orientation=(1.0, 0.0, 0.0, 0.0),
    )
    anchors = [(x * 7.2, y * 5.4, z) for x, y in ((-1, -1), (-1, 1), (1, 1), (1, -1)) for z in (5.39, 5.40)]
    attachments = [
        (0.5, -0.49, 0.0),
        (-0.5, 0.35, 1.0),
        (-0.5, -0.27, 0.0),
        (0.5, 0.27, 1.0),
        (-0.5, 0.49, 0.0),
        (0.5, -0.35, 1.0),
        (0.5, 0.27, 0.0),
        (-0.5, -0.27, 1.0),
    ]
    limits = TensionLimits(minimum=20.0, maximum=4000.0, preferred=600.0)
    cables = tuple(cable(*pair) for pair in zip(anchors, attachments, strict=True))
    return Robot("crane", 9.81, platform, limits, Sensors(), cables)


def octahedral_robot() -> Robot:
    """Six cables between two triangles: statically determinate, and by symmetry all tensions are equal."""
    platform = Platform(60.0, (0.0, 0.0, 1.5), inertia=((4.0, 0.0, 0.0), (0.0, 4.0, 0.0), (0.0, 0.0, 6.0)))
    anchors, attachments = ring(3, 4.0, 5.0), ring(3, 0.8, 0.0, pi / 3.0)
    pairs = [(anchors[index], attachments[(index - side) % 3]) for index in range(3) for side in (0, 1)]
    return Robot("octahedral", 9.81, platform, None, Sensors(), tuple(cable(*pair) for pair in pairs))
