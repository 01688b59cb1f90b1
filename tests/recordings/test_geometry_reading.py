"""Rope lengths and directions by recorded poses, as declared and as a mistake would have them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tautwire.recordings.geometry_reading import GeometryReading, QuaternionReading, recorded_poses, turned, unturned
from tautwire.robot.kinematics import inverse_kinematics
from tautwire.robot.schema import EffectSetting
from tests.support.pose_recordings import rope_lengths, rotation_of, wandering_recording
from tests.support.rigid_robots import crane_robot, suspended_robot, underactuated_robot

ROBOT = crane_robot()
RECORDING = wandering_recording(ROBOT, duration=4.0)
POSES = recorded_poses(RECORDING)


def test_lengths_and_directions_are_those_from_attachments_to_anchors() -> None:
    lengths, directions = GeometryReading().directions(ROBOT, POSES)
    rotations = rotation_of(RECORDING.orientation)
    assert lengths == pytest.approx(rope_lengths(ROBOT, RECORDING.position, rotations), rel=1e-14)
    points = np.stack([RECORDING.position + rotations.apply(each) for each in ROBOT.attachments], axis=1)
    assert points + lengths[..., None] * directions == pytest.approx(np.tile(ROBOT.anchors, (len(points), 1, 1)))


def test_ropes_on_pulleys_with_their_own_axes_have_the_lengths_of_inverse_kinematics() -> None:
    robot = underactuated_robot()
    recording = wandering_recording(robot, travel=0.1, duration=1.0)
    lengths, _ = GeometryReading().directions(robot, recorded_poses(recording))
    for row in (0, 20, 50):
        one_by_one = inverse_kinematics(robot, recording.position[row], recording.orientation[row])
        assert lengths[row] == pytest.approx(one_by_one, rel=1e-13)
    straight = rope_lengths(robot, recording.position, rotation_of(recording.orientation))
    assert np.abs(lengths - straight).max() > 0.01


def test_a_shifted_exit_point_counts() -> None:
    shift = EffectSetting("anchor", {"x": 0.1, "y": -0.2, "z": 0.3}, (3,))
    lengths, _ = GeometryReading().directions(ROBOT.with_effect(shift), POSES)
    x, y, z = ROBOT.anchors[2]
    cables = list(ROBOT.cables)
    cables[2] = replace(cables[2], anchor=(x + 0.1, y - 0.2, z + 0.3))
    moved = replace(ROBOT, cables=tuple(cables))
    assert lengths == pytest.approx(rope_lengths(moved, RECORDING.position, rotation_of(RECORDING.orientation)))


@pytest.mark.parametrize(
    ("axes", "signs"),
    [((1, 2, 0), (1, 1, 1)), ((0, 2, 1), (1, -1, 1)), ((0, 1, 2), (-1, 1, 1)), ((2, 1, 0), (1, -1, -1))],
)
def test_poses_in_other_axes_are_read_back(axes: tuple[int, ...], signs: tuple[int, ...]) -> None:
    """Also in mirrored ones: seen in axes P, a rotation matrix R is P R P^T."""
    permutation = np.array(signs)[:, None] * np.eye(3)[list(axes)]
    matrices = permutation.T @ rotation_of(RECORDING.orientation).as_matrix() @ permutation
    seen = type(rotation_of(RECORDING.orientation)).from_matrix(matrices).as_quat()[:, [3, 0, 1, 2]]
    shown = replace(RECORDING, position=RECORDING.position @ permutation, orientation=seen)
    lengths, _ = GeometryReading(axes=axes, signs=signs).directions(ROBOT, recorded_poses(shown))
    assert lengths == pytest.approx(GeometryReading().directions(ROBOT, POSES)[0], rel=1e-12)


@pytest.mark.parametrize("is_inverse", [False, True])
@pytest.mark.parametrize("is_scalar_last", [False, True])
def test_quaternions_written_otherwise_are_read_back(is_scalar_last: bool, is_inverse: bool) -> None:
    rotations = rotation_of(RECORDING.orientation)
    written = (rotations.inv() if is_inverse else rotations).as_quat(scalar_first=not is_scalar_last)
    read = rotation_of(QuaternionReading(is_scalar_last, is_inverse).read(written))
    assert (read.inv() * rotations).magnitude().max() < 1e-12


def test_positions_of_the_centre_of_mass_are_read_as_those_of_the_origin() -> None:
    centre = RECORDING.position + rotation_of(RECORDING.orientation).apply(ROBOT.platform.centre_of_mass)
    shown = recorded_poses(replace(RECORDING, position=centre))
    assert GeometryReading(is_centre_of_mass=True).positions(ROBOT, shown) == pytest.approx(RECORDING.position)


def test_without_an_orientation_the_platform_is_turned_as_declared() -> None:
    robot = suspended_robot(4)
    quaternion = (0.8, 0.0, 0.0, 0.6)
    robot = replace(robot, platform=replace(robot.platform, start_orientation=quaternion))
    lengths, _ = GeometryReading().directions(robot, unturned(RECORDING.position))
    turns = rotation_of(np.tile(quaternion, (RECORDING.sample_count, 1)))
    assert lengths == pytest.approx(rope_lengths(robot, RECORDING.position, turns))


def test_a_vector_is_turned_into_the_axes_of_the_world() -> None:
    expected = rotation_of(RECORDING.orientation).apply([0.3, -0.2, 1.0])
    assert turned(RECORDING.orientation, (0.3, -0.2, 1.0)) == pytest.approx(expected, abs=1e-14)
