"""What is not known of a run's start, as the filter takes it: a covariance of its first state."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...recordings.recording import Recording
from ...robots.robot import Robot
from ...statics.equilibrium import directions, static_tensions
from ..filter_step import Noise

Array = NDArray[np.float64]

# Where no tension is measured nobody knows the pretension better than this share of the static tensions.
UNSEEN_SHARE = 0.25
SINGULAR = 1e-9


def start_covariance(robot: Robot, noise: Noise, states: int, uncertain: int = 0) -> Array:
    """Covariance (states, states) of the first state; of others than positions, velocities and lengths only the last
    ``uncertain`` ones are not known.

    Tensions that hold nothing, of which robots with more cables than directions have some, are uncertain by
    ``noise.self_stress``: with ``U`` the ropes' directions and ``F = l / (E S)``, unstrained lengths by
    ``s^2 F (I - U^+ U) F``.
    """
    count = robot.cable_count
    lengths = slice(6, 6 + count)
    covariance = np.zeros((states, states))
    place = np.full(3, noise.start**2 + noise.start_stretch**2)
    covariance[:3, :3] = np.diag(place)
    covariance[3:6, 3:6] = np.diag(np.full(3, noise.start_velocity**2))
    covariance[lengths, lengths] = np.diag(np.full(count, noise.start**2 + noise.start_stretch**2))
    covariance[states - uncertain :, states - uncertain :] = np.eye(uncertain)
    if noise.self_stress > 0.0:
        give = _compliances(robot)[:, None] * self_stresses(robot)
        covariance[lengths, lengths] += noise.self_stress**2 * give @ give.T
    return covariance


def self_stresses(robot: Robot) -> Array:
    """Projection (n, n) of tensions on those that hold nothing; zero where there are none."""
    unit = directions(robot)
    projection: Array = np.eye(robot.cable_count) - np.linalg.pinv(unit, rcond=SINGULAR) @ unit
    return projection


def self_stress_of(robot: Robot, recordings: tuple[Recording, ...]) -> tuple[float, tuple[str, ...]]:
    """Standard deviation of a tension that holds nothing, N, and a note where it counts.

    As the robot file says; where it says nothing, zero with tensions measured, else a quarter of the mean static one.
    """
    if float(np.trace(self_stresses(robot))) < 0.5:
        return 0.0, ()
    declared = robot.tension.preferred_uncertainty if robot.tension else None
    blind = not any(recording.has_tension for recording in recordings)
    if declared is None and not blind:
        return 0.0, ()
    deviation = UNSEEN_SHARE * float(np.mean(static_tensions(robot))) if declared is None else declared
    if deviation == 0.0:
        return 0.0, ()
    why = "tension.preferred_uncertainty" if declared is not None else "no tensions are measured, so"
    return deviation, (
        f"{why}: start tensions may differ from the tension rule's by {deviation:.3g} N; they were fitted beside "
        "every effect, so a wrong pretension is none",
    )


def _compliances(robot: Robot) -> Array:
    """Lengths over axial stiffnesses, (n,), in m/N."""
    lengths = [float(np.linalg.norm(np.subtract(anchor, robot.platform.start))) for anchor in robot.anchors]
    return np.array([length / (c.modulus * c.area) for length, c in zip(lengths, robot.cables, strict=True)])
