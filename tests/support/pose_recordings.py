"""Recordings of rigid platforms by their own kinematics and Newton-Euler equations; never imports the laws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tautwire.recordings.recording import Recording
from tautwire.robot.schema import Robot

Array = NDArray[np.float64]

PREFERRED = 900.0  # N


def rotation_of(quaternions: Array) -> Rotation:
    """Rotations of quaternions w, x, y, z, shape (4,) or (N, 4)."""
    return Rotation.from_quat(quaternions[..., [1, 2, 3, 0]])


def quaternions_of(rotations: Rotation) -> Array:
    """Quaternions w, x, y, z with the signs that scipy gives them."""
    return np.asarray(rotations.as_quat()[..., [3, 0, 1, 2]])


def wandering_poses(robot: Robot, time: Array, travel: float, angle: float) -> tuple[Array, Rotation]:
    """Smooth poses that begin at the declared start, of this amplitude in m and in rad."""
    phases = np.outer(time, [0.9, 0.7, 1.1, 0.8, 1.3, 0.6])
    shapes = np.sin(phases) * np.array([1.0, -0.8, 0.5, 1.0, -0.7, 0.9])
    positions = np.array(robot.platform.start) + travel * shapes[:, :3]
    declared = rotation_of(np.array(robot.platform.start_orientation))
    return positions, Rotation.from_rotvec(angle * shapes[:, 3:]) * declared


def rope_lengths(robot: Robot, positions: Array, rotations: Rotation) -> Array:
    """Lengths (N, n) of straight ropes."""
    points = [positions + rotations.apply(attachment) for attachment in robot.attachments]
    spans = [np.array(anchor) - each for anchor, each in zip(robot.anchors, points, strict=True)]
    return np.column_stack([np.linalg.norm(span, axis=1) for span in spans])


def balanced_tensions(robot: Robot, time: Array, positions: Array, rotations: Rotation) -> Array:
    """Tensions (N, n) near the preferred one that Newton's and Euler's equations of six cables or more need."""
    arm = rotations.apply(robot.platform.centre_of_mass)
    centre = positions + arm
    interval = float(time[1] - time[0])
    acceleration = np.gradient(np.gradient(centre, interval, axis=0), interval, axis=0)
    matrices = rotations.as_matrix()
    spin = np.einsum("nij,nkj->nik", np.gradient(matrices, interval, axis=0), matrices)
    omega = np.column_stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]])
    inertia = matrices @ np.array(robot.platform.inertia) @ matrices.transpose(0, 2, 1)
    moment = np.gradient(np.einsum("nij,nj->ni", inertia, omega), interval, axis=0)
    force = robot.platform.mass * (acceleration + np.array([0.0, 0.0, robot.gravity]))
    columns = []
    for anchor, attachment in zip(robot.anchors, robot.attachments, strict=True):
        offset = rotations.apply(attachment)
        span = np.array(anchor) - positions - offset
        unit = span / np.linalg.norm(span, axis=1)[:, None]
        columns.append(np.hstack([unit, np.cross(offset - arm, unit)]))
    structure = np.stack(columns, axis=2)
    preferred = np.full(robot.cable_count, PREFERRED)
    missing = np.hstack([force, moment]) - structure @ preferred
    return np.asarray(preferred + np.einsum("nij,nj->ni", np.linalg.pinv(structure), missing))


def recording_along(robot: Robot, time: Array, positions: Array, rotations: Rotation) -> Recording:
    """The recording of winches with inextensible ropes along poses, with the tensions of six cables or more."""
    speed = -np.gradient(rope_lengths(robot, positions, rotations), time, axis=0)
    tension = np.full(speed.shape, np.nan)
    if robot.cable_count >= 6:
        tension = balanced_tensions(robot, time, positions, rotations)
    return Recording("log.csv", time, speed, tension, positions, orientation=quaternions_of(rotations))


def wandering_recording(robot: Robot, travel: float = 0.3, angle: float = 0.2, duration: float = 10.0) -> Recording:
    """A recording at 50 Hz along :func:`wandering_poses`."""
    time = np.arange(round(50.0 * duration) + 1) / 50.0
    return recording_along(robot, time, *wandering_poses(robot, time, travel, angle))


def noisy(recording: Recording, position: float = 2e-4, angle: float = 5e-4, tension: float = 2.0) -> Recording:
    """The recording with white noise of these standard deviations, in m, rad and N."""
    generator = np.random.default_rng(4)
    turned = Rotation.from_rotvec(angle * generator.standard_normal((recording.sample_count, 3)))
    return replace(
        recording,
        position=recording.position + position * generator.standard_normal(recording.position.shape),
        orientation=quaternions_of(turned * rotation_of(recording.orientation)),
        tension=recording.tension + tension * generator.standard_normal(recording.tension.shape),
    )


def swinging_recording(robot: Robot, duration: float = 6.0) -> Recording:
    """A platform on four cables that swings while its winches stand; without tensions.

    Its poses are those nearest to a wandering one at which all ropes have the lengths that they have at the start.
    """
    time = np.arange(round(50.0 * duration) + 1) / 50.0
    start, declared = np.array(robot.platform.start), rotation_of(np.array(robot.platform.start_orientation))

    def lengths(poses: Array) -> Array:
        """Of poses (N, 6): displacement, and rotation vector from the declared orientation."""
        return rope_lengths(robot, start + poses[:, :3], Rotation.from_rotvec(poses[:, 3:]) * declared)

    poses = np.sin(np.outer(time, [2.9, 4.1, 2.0, 3.3, 2.4, 4.6])) * [0.05, 0.05, 0.02, 0.1, 0.1, 0.2]
    required = lengths(np.zeros((1, 6)))
    for _ in range(6):
        rates = [(lengths(poses + step) - lengths(poses - step)) / 2e-6 for step in 1e-6 * np.eye(6)]
        jacobians = np.stack(rates, axis=2)
        poses = poses - np.einsum("nij,nj->ni", np.linalg.pinv(jacobians), lengths(poses) - required)
    assert np.abs(lengths(poses) - required).max() < 1e-9
    rotations = Rotation.from_rotvec(poses[:, 3:]) * declared
    still, nothing = np.zeros((len(time), 4)), np.full((len(time), 4), np.nan)
    orientation = quaternions_of(rotations)
    return Recording("swing.csv", time, still, nothing, start + poses[:, :3], orientation=orientation)
