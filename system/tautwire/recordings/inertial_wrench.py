"""Wrench that a recorded motion requires of the cables, and the matrix by which tensions exert it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..robot.cable_routes import attachment_points
from ..robot.rigid_equilibrium import platform_size
from ..robot.schema import AXES, Robot
from .geometry_reading import GeometryReading, RecordedPoses, turned

Array = NDArray[np.float64]


def has_moments(robot: Robot, poses: RecordedPoses) -> bool:
    """Whether moments about the centre of mass are known: those of a rigid platform whose orientation was recorded."""
    return robot.platform.is_rigid_body and poses.has_orientation


def balance_matrices(robot: Robot, geometry: GeometryReading, poses: RecordedPoses) -> Array:
    """Matrices (N, d, n) of the wrench that tensions exert: unit vectors, and moments about the centre of mass.

    d is 3, or 6 with moments, which are over the size of the platform, in N.
    """
    directions = geometry.directions(robot, poses)[1]
    forces = directions.transpose(0, 2, 1)
    if not has_moments(robot, poses):
        return forces
    positions, orientations = geometry.positions(robot, poses), geometry.orientations(robot, poses)
    points = np.array(attachment_points(geometry.robot(robot), positions.T, orientations.T)).transpose(2, 0, 1)
    arms = points - _mass_centres(robot, geometry, poses)[:, None]
    moments = np.cross(arms, directions) / platform_size(geometry.robot(robot))
    return np.concatenate([forces, moments.transpose(0, 2, 1)], axis=1)


def inertial_wrenches(robot: Robot, geometry: GeometryReading, poses: RecordedPoses, interval: float) -> Array:
    """Wrench (N - 2, d) at all evenly spaced poses but the ends: ``m (a + g)`` in N, and ``dL/dt`` over the size.

    By second differences of the centre of mass, and by differences of the angular momentum L about it between poses.
    """
    centres = _mass_centres(robot, geometry, poses)
    acceleration = (centres[2:] - 2.0 * centres[1:-1] + centres[:-2]) / interval**2
    in_plane = np.isin(np.arange(len(AXES)), robot.axes_in_plane)
    forces = robot.platform.mass * (acceleration + np.array([0.0, 0.0, robot.gravity])) * in_plane
    if not has_moments(robot, poses):
        return np.asarray(forces)
    momentum = _angular_momenta(robot, geometry.orientations(robot, poses), interval)
    return np.hstack([forces, np.diff(momentum, axis=0) / (interval * platform_size(geometry.robot(robot)))])


def _mass_centres(robot: Robot, geometry: GeometryReading, poses: RecordedPoses) -> Array:
    """Centres of mass (N, 3) in m, of a point mass its position."""
    positions = geometry.positions(robot, poses)
    if not robot.platform.is_rigid_body:
        return positions
    return positions + turned(geometry.orientations(robot, poses), geometry.robot(robot).platform.centre_of_mass)


def _angular_momenta(robot: Robot, orientations: Array, interval: float) -> Array:
    """Angular momenta (N - 1, 3) about the centre of mass between orientations (N, 4), in the world's axes, N m s."""
    momenta = np.full((len(orientations) - 1, len(AXES)), np.nan)
    is_known = np.asarray(np.isfinite(orientations).all(axis=1))
    pairs = np.flatnonzero(is_known[1:] & is_known[:-1])
    if not len(pairs):
        return momenta
    before, after = (Rotation.from_quat(orientations[rows][:, [1, 2, 3, 0]]) for rows in (pairs, pairs + 1))
    # In the axes of the platform midway, of which the rotation vector is the same as in those of either end.
    rotation_vectors = (before.inv() * after).as_rotvec()
    midway = before * Rotation.from_rotvec(0.5 * rotation_vectors)
    momenta[pairs] = midway.apply(rotation_vectors / interval @ np.array(robot.platform.inertia))
    return momenta
