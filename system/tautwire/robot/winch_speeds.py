"""Inverse kinematics along a path: structure matrices, and the winch speeds that inelastic cables need."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..array_validation import validate_array
from ..errors import ArgumentError
from .active_effects import attachments, has_routing_effects
from .kinematics import structure_matrix_at
from .pose_path import PoseSamples, pose_path, sample_poses
from .pose_trajectory import rotation_matrices
from .schema import Robot, validate_robot
from .trajectory import Trajectory, require_trajectory

Array = NDArray[np.float64]


def structure_matrices(robot: Robot, poses: PoseSamples) -> Array:
    """Structure matrices at N poses, shape (N, d, n): of a point mass the unit vectors of the cables at it.

    See :func:`tautwire.robot.kinematics.structure_matrix`.

    Raises UnreachableError where a cable over a pulley has no length.
    """
    if has_routing_effects(robot):
        quaternions = [(w, x, y, z) for w, x, y, z in poses.orientation.tolist()]
        pairs = zip(poses.position, quaternions, strict=True)
        return np.array([structure_matrix_at(robot, position, quaternion) for position, quaternion in pairs])
    arms = rotation_matrices(poses.orientation) @ np.array(attachments(robot)).T
    spans = np.array(robot.anchors).T - poses.position[:, :, None] - arms
    directions: Array = spans / np.linalg.norm(spans, axis=1, keepdims=True)
    if not robot.platform.is_rigid_body:
        return directions
    return np.concatenate([directions, np.cross(arms, directions, axis=1)], axis=1)


def ideal_winch_speeds(robot: Robot, trajectory: Trajectory, times: ArrayLike) -> Array:
    """Winch speeds of inelastic cables along a trajectory, at ``times`` (N,) in s; positive reels in.

    ``V_i = -dl_i/dt = u_i . v_i``, shape (N, n), in m/s; ``u_i`` from the platform along the cable, ``v_i`` the
    velocity of its attachment. A rigid platform keeps its start orientation where the trajectory has none, and with
    fewer than six cables hangs in equilibrium.

    Raises ArgumentError for an invalid argument, a user's trajectory whose values are not finite (N, 3), or a
    trajectory through an exit point; UnreachableError where fewer than six cables cannot hold a rigid platform on it.
    """
    caller = "ideal_winch_speeds"
    validate_robot(f"{caller}: robot", robot)
    require_trajectory(f"{caller}: trajectory", trajectory)
    instants = validate_array(f"{caller}: times", times, (None,), "finite times (N,) in s")
    poses = sample_poses(caller, robot, pose_path(robot, trajectory), instants)
    with np.errstate(invalid="ignore", divide="ignore"):
        speeds = winch_speeds_at(robot, poses)
    undefined = np.argwhere(~np.isfinite(speeds))
    if len(undefined):
        row, cable = undefined[0]
        problem = f"has no winch speed of cable {cable + 1} at {instants[row]:g} s: it leads through the exit point"
        raise ArgumentError(f"{caller}: trajectory", trajectory, problem, "lead the path past all exit points")
    return speeds


def winch_speeds_at(robot: Robot, poses: PoseSamples) -> Array:
    """Winch speeds of inelastic cables at poses, ``A' t`` by structure matrix and twist, shape (N, n), in m/s."""
    speeds: Array = np.einsum("kai,ka->ki", structure_matrices(robot, poses), poses.twist)
    return speeds
