"""Attachments and anchors in another order, and bodies of markers elsewhere on a platform, are told with a remedy."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tautwire.recordings.consistency import recording_mistakes
from tautwire.recordings.mistaken_points import point_mistake
from tautwire.recordings.recording import Recording
from tautwire.robot.schema import Robot
from tests.support.pose_recordings import noisy, wandering_recording
from tests.support.recordings import recorded
from tests.support.rigid_robots import crane_robot, suspended_robot
from tests.support.robots import example

CRANE = crane_robot()


@pytest.fixture(scope="module")
def recording() -> Recording:
    return noisy(wandering_recording(CRANE))


def reordered(key: str, order: list[int]) -> Robot:
    points = [getattr(CRANE.cables[cable - 1], key) for cable in order]
    cables = tuple(replace(cable, **{key: point}) for cable, point in zip(CRANE.cables, points, strict=True))
    return replace(CRANE, cables=cables)


def with_attachments(robot: Robot, matrix: np.ndarray, shift: np.ndarray) -> Robot:
    points = [matrix @ np.array(cable.attachment) + shift for cable in robot.cables]
    cables = tuple(replace(cable, attachment=tuple(p)) for cable, p in zip(robot.cables, points, strict=True))
    centre = tuple(matrix @ np.array(robot.platform.centre_of_mass) + shift)
    return replace(robot, cables=cables, platform=replace(robot.platform, centre_of_mass=centre))


def of_body(recording: Recording, turn: Rotation, place: list[float]) -> Recording:
    """What a tracker shows of a body of markers that is turned and at a place on the platform, in m."""
    platform = Rotation.from_quat(recording.orientation[:, [1, 2, 3, 0]])
    orientation = (platform * turn).as_quat()[:, [3, 0, 1, 2]]
    return replace(recording, orientation=orientation, position=recording.position + platform.apply(place))


@pytest.mark.validate(but=["order1"])
@pytest.mark.parametrize("key", ["attachment", "anchor"])
@pytest.mark.parametrize(
    ("order", "told"),
    [([1, 3, 2, 4, 5, 6, 7, 8], "cables 2, 3"), ([5, 6, 7, 8, 1, 2, 3, 4], "cables 1, 2, 3, 4, 5, 6, 7, 8")],
)
def test_points_in_another_order_are_told_by_cable(recording: Recording, key: str, order: list[int], told: str) -> None:
    mistake = point_mistake(reordered(key, order), recording)
    assert mistake is not None and mistake.misfit < 0.01
    assert mistake.cause.startswith(f"the {key}s of {told} in the robot file are those of cables ")
    assert mistake.remedy.startswith(f"give {told} the {key}s of cables ")


@pytest.mark.validate
def test_what_leaves_more_than_good_recordings_miss_is_no_mistake_in_points(recording: Recording) -> None:
    upper_lower = reordered("anchor", [5, 6, 7, 8, 1, 2, 3, 4])
    assert point_mistake(upper_lower, recording.with_winch_speed(1.03 * recording.winch_speed)) is not None
    assert point_mistake(upper_lower, recording.with_winch_speed(1.15 * recording.winch_speed)) is None


@pytest.mark.validate
def test_attachments_in_the_worlds_frame_are_told_before_units_that_explain_far_less() -> None:
    robot = suspended_robot(6)
    in_the_world = with_attachments(robot, np.eye(3), np.array(robot.platform.start))
    error, *_ = recording_mistakes(in_the_world, noisy(wandering_recording(robot)))
    assert "in another frame than the recorded pose: shifted by about" in error.problem


@pytest.mark.validate
@pytest.mark.parametrize(
    ("axis", "degrees", "told"), [("z", 90.0, "y, -x, z are x, y, z"), ("x", 180.0, "x, -y, -z are x, y, z")]
)
def test_a_body_that_is_turned_is_told_by_its_axes(recording: Recording, axis: str, degrees: float, told: str) -> None:
    shown = of_body(recording, Rotation.from_euler(axis, degrees, degrees=True), [0.0, 0.0, 0.0])
    (error,) = recording_mistakes(CRANE, shown)
    assert f"in another frame than the recorded pose: their {told} of the recorded pose" in error.problem
    assert recording_mistakes(with_attachments(CRANE, *told_frame(error.hint)), shown) == ()


@pytest.mark.validate
def test_a_body_that_is_turned_by_an_odd_angle_and_shifted_is_told_with_its_frame(recording: Recording) -> None:
    turn = Rotation.from_euler("xyz", [20.0, -35.0, 50.0], degrees=True)
    shown = of_body(recording, turn, [0.3, -0.2, 0.4])
    (error,) = recording_mistakes(CRANE, shown)
    matrix, shift = told_frame(error.hint)
    assert matrix == pytest.approx(turn.inv().as_matrix(), abs=0.02)
    assert shift == pytest.approx(-turn.inv().apply([0.3, -0.2, 0.4]), abs=0.03)


def test_mirrored_attachments_are_told_as_such(recording: Recording) -> None:
    mistake = point_mistake(with_attachments(CRANE, np.diag([1.0, -1.0, 1.0]), np.zeros(3)), recording)
    assert mistake is not None
    assert "their x, -y, z are x, y, z of the recorded pose, mirrored" in mistake.cause


def test_a_quaternion_with_exchanged_columns_is_told(recording: Recording) -> None:
    mistake = point_mistake(CRANE, replace(recording, orientation=recording.orientation[:, [0, 3, 2, 1]]))
    assert mistake is not None and mistake.remedy == "write the columns qz, qy, qx as qx, qy, qz"


@pytest.mark.validate
def test_nothing_is_told_of_right_points_of_other_mistakes_and_of_point_masses(recording: Recording) -> None:
    assert point_mistake(CRANE, recording) is None
    noise = np.random.default_rng(1).standard_normal(recording.winch_speed.shape)
    assert point_mistake(CRANE, replace(recording, winch_speed=noise)) is None
    assert point_mistake(example("three").as_modelled(), recorded("three", 1)) is None


def told_frame(hint: str) -> tuple[np.ndarray, np.ndarray]:
    """R and d of a hint."""
    match = re.search(r"R = (\[\[.*?\]\]) and d = (\[.*?\]) m", hint)
    assert match is not None, hint
    numbers = [np.array([float(n) for n in re.findall(r"[-+0-9.e]+", text)]) for text in match.groups()]
    return numbers[0].reshape(3, 3), numbers[1]
