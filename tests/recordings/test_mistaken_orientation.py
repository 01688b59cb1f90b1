"""Quaternions that begin far from the declared orientation, and recordings without any."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tautwire.recordings.consistency import recording_mistakes
from tautwire.recordings.mistaken_orientation import angle_between, orientation_notes, start_orientation_error
from tautwire.recordings.recording import Recording
from tautwire.robot.schema import Robot
from tests.support.pose_recordings import quaternions_of, rotation_of, wandering_recording
from tests.support.rigid_robots import suspended_robot
from tests.support.robots import example

START = (0.96, 0.0, 0.28, 0.0)
ROBOT = suspended_robot(4)
ROBOT = replace(ROBOT, platform=replace(ROBOT.platform, start_orientation=START))


def standing(robot: Robot, quaternion: np.ndarray) -> Recording:
    """A platform that stands still, turned so."""
    still = wandering_recording(robot, travel=0.0, angle=0.0, duration=4.0)
    return replace(still, orientation=np.tile(quaternion, (still.sample_count, 1)))


def test_quaternions_in_another_order_are_told_by_their_beginning() -> None:
    (error,) = recording_mistakes(ROBOT, standing(ROBOT, np.array([0.0, 0.28, 0.0, 0.96])))
    assert error.problem == (
        "orientation begins 180 degrees from start_orientation in the robot file, 0 degrees if the quaternion is "
        "written as x, y, z, w"
    )
    assert error.hint.startswith(
        'write into [recording.columns] qw = { name = "qz" } and qx = { name = "qw" } and qy = { name = "qx" } '
        'and qz = { name = "qy" }, which is to read qz, qw, qx, qy as qw, qx, qy, qz, or correct start_orientation'
    )


def test_quaternions_from_the_world_to_the_platform_are_told_by_their_beginning() -> None:
    (error,) = recording_mistakes(ROBOT, standing(ROBOT, np.array([0.96, 0.0, -0.28, 0.0])))
    assert "0 degrees if the quaternion turns from the world's frame to the platform's" in error.problem
    assert "qx = { sign = -1 } and qy = { sign = -1 }" in error.hint


def test_a_platform_that_begins_turned_otherwise_is_no_mistake() -> None:
    turned = rotation_of(np.array(START)) * Rotation.from_rotvec([0.0, 0.0, 1.2])
    assert start_orientation_error(ROBOT, standing(ROBOT, quaternions_of(turned))) is None


def test_a_beginning_near_the_declared_one_is_no_mistake_and_neither_is_any_of_a_point_mass() -> None:
    turned = rotation_of(np.array(START)) * Rotation.from_rotvec([0.2, 0.0, 0.2])
    assert start_orientation_error(ROBOT, standing(ROBOT, quaternions_of(turned))) is None
    point = example("three")
    recording = standing(suspended_robot(3), np.array([0.0, 0.0, 0.0, 1.0]))
    assert start_orientation_error(point, recording) is None


def test_travel_that_contradicts_another_reading_leaves_the_quaternions_as_they_are() -> None:
    """They begin at half a turn about z, which in another order were the declared identity."""
    robot = suspended_robot(4)
    half_turn = Rotation.from_rotvec([0.0, 0.0, np.pi])
    turned_attachments = [tuple(half_turn.apply(cable.attachment).tolist()) for cable in robot.cables]
    cables = zip(robot.cables, turned_attachments, strict=True)
    truth = replace(robot, cables=tuple(replace(cable, attachment=at) for cable, at in cables))
    recording = wandering_recording(truth, travel=0.4, angle=0.15)
    orientation = quaternions_of(rotation_of(recording.orientation) * half_turn)
    assert start_orientation_error(robot, replace(recording, orientation=orientation)) is None
    standing_still = replace(
        recording, winch_speed=0.0 * recording.winch_speed, position=recording.position[[0] * recording.sample_count]
    )
    still = replace(standing_still, orientation=np.tile([0.0, 0.0, 0.0, 1.0], (recording.sample_count, 1)))
    assert start_orientation_error(robot, still) is not None


@pytest.mark.parametrize("angle", [0.0, 1e-3, 0.7, np.pi])
def test_the_angle_between_quaternions_does_not_depend_on_their_signs(angle: float) -> None:
    second = quaternions_of(rotation_of(np.array(START)) * Rotation.from_rotvec([0.0, angle, 0.0]))
    assert angle_between(START, second) == pytest.approx(angle, abs=1e-7)
    assert angle_between(START, -second) == pytest.approx(angle, abs=1e-7)


def test_a_recording_without_orientation_says_what_is_not_checked() -> None:
    recording = wandering_recording(ROBOT, duration=2.0)
    assert orientation_notes(ROBOT, recording) == ()
    unturned = replace(recording, orientation=np.full((recording.sample_count, 4), np.nan))
    (note,) = orientation_notes(ROBOT, unturned)
    assert note == "log.csv: no orientation (qw, qx, qy, qz): neither rope lengths nor moments are checked by it"
    assert orientation_notes(example("three"), unturned) == ()


def test_euler_angles_are_told_with_the_line_that_makes_quaternions_of_them() -> None:
    recording = wandering_recording(ROBOT, duration=2.0)
    unturned = np.full((recording.sample_count, 4), np.nan)
    named = replace(recording, orientation=unturned, unknown_columns=("Roll", "body.pitch", "yaw_deg", "motor_temp"))
    note = orientation_notes(ROBOT, named)[1]
    assert "Roll, body.pitch, yaw_deg may be Euler angles, which are not read" in note and "motor_temp" not in note
    line = "Rotation.from_euler('ZYX', angles, degrees=True).as_quat(scalar_first=True)"
    assert line in note
    quaternion = eval(line, {"Rotation": Rotation, "angles": [[90.0, 0.0, 0.0]]})
    assert quaternion == pytest.approx(np.array([[np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]]))
