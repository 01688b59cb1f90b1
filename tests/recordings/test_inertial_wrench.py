"""The wrench that a recorded motion needs, against Newton's and Euler's equations in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tautwire.recordings.geometry_reading import GeometryReading, RecordedPoses, recorded_poses, unturned
from tautwire.recordings.inertial_wrench import balance_matrices, inertial_wrenches
from tautwire.robot.kinematics import structure_matrix
from tautwire.robot.rigid_equilibrium import platform_size
from tests.support.pose_recordings import quaternions_of, wandering_recording
from tests.support.rigid_robots import crane_robot

ROBOT = crane_robot()
STEP = 0.01
TIME = STEP * np.arange(200)
SPIN = 0.7  # rad/s


def spinning() -> RecordedPoses:
    """The origin moves on a parabola while the platform spins evenly about its vertical axis."""
    positions = np.column_stack([0.5 * 0.3 * TIME**2, 0.2 * TIME, np.full(len(TIME), 1.5)])
    turns = Rotation.from_rotvec(np.outer(SPIN * TIME, [0.0, 0.0, 1.0]))
    return RecordedPoses(positions, quaternions_of(turns))


def test_an_even_spin_needs_the_centripetal_force_and_the_moment_of_the_products_of_inertia() -> None:
    wrenches = inertial_wrenches(ROBOT, GeometryReading(), spinning(), STEP)
    platform, turns = ROBOT.platform, Rotation.from_rotvec(np.outer(SPIN * TIME[1:-1], [0.0, 0.0, 1.0]))
    centre = turns.apply(platform.centre_of_mass)
    acceleration = np.array([0.3, 0.0, ROBOT.gravity]) - SPIN**2 * centre * [1.0, 1.0, 0.0]
    assert wrenches[:, :3] == pytest.approx(platform.mass * acceleration, abs=1e-3)
    omega = np.array([0.0, 0.0, SPIN])
    momentum = turns.apply(np.array(platform.inertia) @ omega)
    moment = np.cross(omega, momentum) / platform_size(ROBOT)
    assert np.abs(moment).max() > 0.1
    assert wrenches[:, 3:] == pytest.approx(moment, abs=1e-5)


def test_tensions_exert_the_wrench_of_the_structure_matrix_about_the_centre_of_mass() -> None:
    recording = wandering_recording(ROBOT, duration=1.0)
    matrices = balance_matrices(ROBOT, GeometryReading(), recorded_poses(recording))
    for row in (0, 30):
        about_origin = structure_matrix(ROBOT, recording.position[row], recording.orientation[row])
        quaternion = recording.orientation[row]
        arm = Rotation.from_quat(quaternion, scalar_first=True).apply(ROBOT.platform.centre_of_mass)
        moments = about_origin[3:] - np.cross(arm, about_origin[:3].T).T
        assert matrices[row, :3] == pytest.approx(about_origin[:3])
        assert matrices[row, 3:] * platform_size(ROBOT) == pytest.approx(moments)


def test_without_orientation_forces_alone_are_known() -> None:
    poses = unturned(spinning().position)
    assert inertial_wrenches(ROBOT, GeometryReading(), poses, STEP).shape == (198, 3)
    assert balance_matrices(ROBOT, GeometryReading(), poses).shape == (200, 3, 8)


def test_a_lost_orientation_leaves_no_wrench_beside_it() -> None:
    poses = spinning()
    orientation = poses.orientation.copy()
    orientation[50] = np.nan
    wrenches = inertial_wrenches(ROBOT, GeometryReading(), replace(poses, orientation=orientation), STEP)
    assert np.flatnonzero(np.isnan(wrenches).any(axis=1)).tolist() == [48, 49, 50]
