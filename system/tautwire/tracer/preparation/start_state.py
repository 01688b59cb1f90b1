"""Prior covariance of the filter's initial state, self-stress included."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...recordings.recording import Recording
from ...robots.robot import Robot
from ...statics.equilibrium import static_tensions, unit_directions
from ..filter_step import Noise

Array = NDArray[np.float64]

# Standard deviation of self-stress where no tension is measured, as a share of the mean static tension.
DEFAULT_SELF_STRESS_RATIO = 0.25
RANK_TOLERANCE = 1e-9


def initial_covariance(robot: Robot, noise: Noise, state_count: int, constant_count: int = 0) -> Array:
    """Prior covariance (state_count, state_count) of the initial state.

    Beside positions, velocities and lengths only the last ``constant_count`` states are uncertain.

    Self-stress, the tensions in the null space of redundant robots' structure matrix, has the standard deviation
    ``noise.self_stress``: with ``U`` the ropes' directions and ``F = l / (E S)``, unstrained lengths by
    ``s^2 F (I - U^+ U) F``.
    """
    count = robot.cable_count
    lengths = slice(6, 6 + count)
    covariance = np.zeros((state_count, state_count))
    position_variance = np.full(3, noise.start_position**2 + noise.start_stretch**2)
    covariance[:3, :3] = np.diag(position_variance)
    covariance[3:6, 3:6] = np.diag(np.full(3, noise.start_velocity**2))
    covariance[lengths, lengths] = np.diag(np.full(count, noise.start_position**2 + noise.start_stretch**2))
    covariance[state_count - constant_count :, state_count - constant_count :] = np.eye(constant_count)
    if noise.self_stress > 0.0:
        length_modes = _cable_compliances(robot)[:, None] * self_stress_projection(robot)
        covariance[lengths, lengths] += noise.self_stress**2 * length_modes @ length_modes.T
    return covariance


def self_stress_projection(robot: Robot) -> Array:
    """Projection (n, n) of tensions on self-stress, the null space of the structure matrix; zero where it is empty."""
    direction_matrix = unit_directions(robot)
    projection: Array = (
        np.eye(robot.cable_count) - np.linalg.pinv(direction_matrix, rcond=RANK_TOLERANCE) @ direction_matrix
    )
    return projection


def self_stress_deviation(robot: Robot, recordings: tuple[Recording, ...]) -> tuple[float, tuple[str, ...]]:
    """Standard deviation of self-stress in N, and a note where it matters.

    The robot file's value; without one, zero with tensions measured, else a quarter of the mean static one.
    """
    if float(np.trace(self_stress_projection(robot))) < 0.5:
        return 0.0, ()
    declared = robot.tension.preferred_uncertainty if robot.tension else None
    is_tension_unmeasured = not any(recording.has_tension for recording in recordings)
    if declared is None and not is_tension_unmeasured:
        return 0.0, ()
    deviation = DEFAULT_SELF_STRESS_RATIO * float(np.mean(static_tensions(robot))) if declared is None else declared
    if deviation == 0.0:
        return 0.0, ()
    reason = "tension.preferred_uncertainty" if declared is not None else "no tensions are measured, so"
    return deviation, (
        f"{reason}: start tensions may differ from the tension rule's by {deviation:.3g} N; they were fitted beside "
        "every effect, so a wrong pretension is none",
    )


def _cable_compliances(robot: Robot) -> Array:
    """Axial compliances of the cables (n,) in m/N: length over axial stiffness."""
    lengths = [float(np.linalg.norm(np.subtract(anchor, robot.platform.start))) for anchor in robot.anchors]
    return np.array([length / (c.modulus * c.area) for length, c in zip(lengths, robot.cables, strict=True)])
