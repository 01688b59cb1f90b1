"""Rigid platforms that several tests use."""

from __future__ import annotations

from math import cos, pi, sin

from tautwire.robot.schema import Cable, EffectSetting, Platform, Robot, Sensors, TensionLimits

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


def underactuated_robot() -> Robot:
    """The GRAB prototype of IRMA L@B, Bologna, on four cables over pulleys, as in run 3 of its ring-downs of May 2020.

    Geometry as published in IRMA-LAB/cdpr_matlab. Mass is normalised and the ropes are stiff: free modes depend on
    neither.
    """
    inertia = (
        (0.0167263464, 0.000734458303, 0.000258209314),
        (0.000734458303, 0.0226804556, -0.000685602376),
        (0.000258209314, -0.000685602376, 0.0325218668),
    )
    anchors = (
        (0.214846621, -1.31313273, 0.536696133),
        (2.29024775, -1.15475982, 0.547874312),
        (2.14790888, 0.976553877, 0.572550721),
        (0.0485461734, 0.798900682, 0.52777841),
    )
    attachments = (
        (-0.143573626, -0.219372012, 0.264011861),
        (0.114745727, -0.233375978, 0.263645428),
        (0.141832872, 0.220039829, 0.265532892),
        (-0.120384639, 0.235736768, 0.265552408),
    )
    swivel_axes = (
        (-0.999610383, -0.0177139515, -0.0215707569),
        (-0.00575458704, -0.99942396, 0.0334459624),
        (0.999973099, 0.00539592858, -0.00496847038),
        (0.0195024963, 0.999679688, -0.0161298965),
    )
    platform = Platform(
        1.0,
        (1.639566652933393, -0.6209775548989755, -0.9684570782287503),
        inertia=inertia,
        centre_of_mass=(0.00175976789, -0.00234153575, 0.199741193),
        start_orientation=(0.9726970831325978, -0.16425909015157467, -0.0998438402991798, 0.1300405449166708),
    )
    cables = tuple(
        Cable(anchor, 1e9, 3e-4, 0.0, "logarithmic", attachment=attachment, swivel_axis=axis)
        for anchor, attachment, axis in zip(anchors, attachments, swivel_axes, strict=True)
    )
    pulleys = EffectSetting("pulley", {"radius": 0.0224815216}, (1, 2, 3, 4))
    return Robot("grab", 9.80665, platform, None, Sensors(), cables, (pulleys,))


def hung_beam() -> Robot:
    """A platform that turns, on two cables in its plane."""
    inertia = ((1.0, 0.0, 0.0), (0.0, 0.8, 0.0), (0.0, 0.0, 1.2))
    platform = Platform(20.0, (1.8, 0.0, 1.0), inertia=inertia, centre_of_mass=(0.0, 0.0, -0.1))
    ends = (((0.0, 0.0, 3.0), (-0.2, 0.0, 0.1)), ((4.0, 0.0, 3.0), (0.2, 0.0, 0.1)))
    return Robot("beam", 9.81, platform, None, Sensors(), tuple(cable(*pair) for pair in ends))


def hall_robot() -> Robot:
    """Four cables without symmetry, so that the winches reach every free mode of the platform."""
    inertia = ((3.0, 0.1, -0.05), (0.1, 4.2, 0.08), (-0.05, 0.08, 5.5))
    platform = Platform(60.0, (0.2, -0.1, 1.6), inertia=inertia, centre_of_mass=(0.03, -0.02, -0.25))
    anchors = ((-3.8, -2.9, 4.9), (-3.5, 3.1, 5.2), (4.1, 2.6, 5.0), (3.7, -3.2, 4.6))
    attachments = ((-0.5, -0.3, 0.15), (-0.35, 0.45, 0.2), (0.55, 0.3, 0.1), (0.4, -0.4, 0.2))
    cables = tuple(cable(*pair) for pair in zip(anchors, attachments, strict=True))
    # Of the orientations in equilibrium the nearest one with this tension at least: the very nearest has a slack cable.
    return Robot("hall", 9.81, platform, TensionLimits(80.0, 3000.0, 200.0), Sensors(), cables)
