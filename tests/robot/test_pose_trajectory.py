"""Paths that turn, against SciPy's rotations and numerical derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tautwire.errors import ArgumentError
from tautwire.robot.pose_trajectory import (
    OrientationTrajectory,
    PoseTrajectory,
    TurningTrajectory,
    rotation_vectors_between,
    slerp,
    turns,
)
from tautwire.robot.schema import Quaternion
from tautwire.robot.trajectory import Helix, Line

START: Quaternion = (1.0, 0.0, 0.0, 0.0)
TIMES = np.linspace(0.0, 2.0, 41)


def quaternion(vector: tuple[float, float, float]) -> Quaternion:
    x, y, z, w = Rotation.from_rotvec(vector).as_quat().tolist()
    return (w, x, y, z)


def rotations(orientations: NDArray[np.float64]) -> Rotation:
    return Rotation.from_quat(orientations[:, [1, 2, 3, 0]])


def differences(path: OrientationTrajectory, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angular velocity in the axes of the world, by central differences."""
    fine = 1e-5
    later, earlier = (rotations(path.orientation(times + sign * fine)) for sign in (1.0, -1.0))
    return np.asarray((later * earlier.inv()).as_rotvec() / (2.0 * fine))


def test_a_slerp_goes_from_one_orientation_to_the_other_about_one_axis() -> None:
    first, last = quaternion((0.3, -0.2, 0.5)), quaternion((-0.4, 0.6, 1.2))
    path = slerp(first, last, 2.0)
    turned = rotations(path.orientation(TIMES)) * rotations(np.array([first])).inv()
    vectors = turned.as_rotvec()
    whole = (rotations(np.array([last])) * rotations(np.array([first])).inv()).as_rotvec()[0]
    assert vectors[0] == pytest.approx(np.zeros(3), abs=1e-15) and vectors[-1] == pytest.approx(whole, abs=1e-14)
    assert np.cross(vectors, whole) == pytest.approx(np.zeros((41, 3)), abs=1e-14)
    assert np.linalg.norm(path.orientation(TIMES), axis=1) == pytest.approx(np.ones(41), abs=1e-14)


def test_a_slerp_takes_the_short_way_whatever_the_sign_of_its_quaternions() -> None:
    last = quaternion((0.0, 0.0, 2.5))
    w, x, y, z = last
    for end in (last, (-w, -x, -y, -z)):
        middle = rotations(slerp(START, end, 2.0).orientation(np.array([1.0]))).as_rotvec()
        assert middle[0] == pytest.approx([0.0, 0.0, 1.25])


def test_a_slerp_rests_before_and_after_and_is_smooth_in_acceleration() -> None:
    path = slerp(START, quaternion((0.0, 1.0, 0.5)), 2.0)
    ends = np.array([-1.0, 0.0, 2.0, 3.0])
    assert not np.any(path.angular_velocity(ends)) and not np.any(path.angular_acceleration(ends))
    fine = np.linspace(-0.1, 2.1, 2201)
    assert np.max(np.abs(np.diff(path.angular_acceleration(fine), axis=0))) < 0.03


@pytest.mark.parametrize("radius", (1e-3, 0.09, 0.11, 2.0))
def test_angular_velocity_and_acceleration_are_those_of_the_orientations(radius: float) -> None:
    """Along a helix of rotation vectors the axis changes, also near no rotation, where series replace quotients."""
    curve = Helix((0.02, -0.01, 0.0), radius, 0.4, 3.0, 2.0)
    path, inside = OrientationTrajectory(quaternion((0.1, 0.2, 0.3)), curve), TIMES[1:-1]
    velocities = differences(path, inside)
    assert path.angular_velocity(inside) == pytest.approx(velocities, abs=1e-8)
    fine = 1e-4
    rates = (path.angular_velocity(inside + fine) - path.angular_velocity(inside - fine)) / (2.0 * fine)
    assert path.angular_acceleration(inside) == pytest.approx(rates, abs=2e-6)


def test_a_pose_trajectory_has_both_motions_and_the_longer_duration() -> None:
    line, turn = Line((0.0, 0.0, 1.0), (1.0, 0.0, 1.0), 2.0), slerp(START, quaternion((0.0, 0.0, 1.0)), 3.0)
    path = PoseTrajectory(line, turn)
    assert turns(path) and not turns(line)
    assert isinstance(path, TurningTrajectory)
    assert path.duration == 3.0
    assert np.array_equal(path.position(TIMES), line.position(TIMES))
    assert np.array_equal(path.angular_acceleration(TIMES), turn.angular_acceleration(TIMES))


def test_rotation_vectors_are_in_the_axes_of_the_world() -> None:
    reference, turn = quaternion((0.4, 0.1, -0.8)), (0.01, -0.02, 0.03)
    x, y, z, w = (Rotation.from_rotvec(turn) * rotations(np.array([reference]))[0]).as_quat().tolist()
    assert rotation_vectors_between(np.array([[w, x, y, z]]), np.array([reference]))[0] == pytest.approx(turn)


@pytest.mark.parametrize(
    ("end", "words"),
    [
        ((1.0, 0.1, 0.0, 0.0), "has norm 1.00498"),
        ((0.0, 0.0, 0.0, 1.0), "is 180 degrees from the start"),
        ((1.0, 0.0, 0.0), r"has the shape \(3,\)"),
    ],
)
def test_a_slerp_refuses_what_is_no_orientation_or_has_no_short_way(end: Quaternion, words: str) -> None:
    with pytest.raises(ArgumentError, match=f"slerp: end.*{words}"):
        slerp(START, end, 1.0)
