"""Poses of a rigid platform in a tracker's world that is turned against the robot's are told with that rotation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tautwire.recordings.consistency import recording_mistakes
from tautwire.recordings.recording import Recording, read_recording
from tautwire.robot.robot_file_reader import read_robot
from tests.support.folders import SHARED_RECORDINGS
from tests.support.pose_recordings import noisy, quaternions_of, rotation_of, wandering_recording
from tests.support.rigid_robots import crane_robot

ROBOT = crane_robot()
WORLDS = {
    "y upwards": Rotation.from_euler("x", 90.0, degrees=True),
    "z downwards": Rotation.from_euler("x", 180.0, degrees=True),
    "turned about z": Rotation.from_euler("z", 90.0, degrees=True),
    "turned by an odd angle": Rotation.from_euler("zx", [30.0, 4.0], degrees=True),
}


def in_world(world: Rotation, size: float = 1.0) -> Recording:
    """A correct recording as a tracker in another world shows it, the platform's frame unchanged."""
    recording = noisy(wandering_recording(ROBOT))
    return replace(
        recording,
        position=size * world.apply(recording.position),
        orientation=quaternions_of(world * rotation_of(recording.orientation)),
    )


@pytest.mark.validate
@pytest.mark.parametrize("world", WORLDS)
def test_a_world_that_is_turned_is_told_with_what_turns_it_back(world: str) -> None:
    (error,) = recording_mistakes(ROBOT, in_world(WORLDS[world]))
    angle = np.degrees(WORLDS[world].magnitude())
    told = float(error.problem.split("turned by about ")[1].split(" degrees")[0])
    assert told == pytest.approx(angle, abs=0.5)
    written = error.hint.split("R = [")[1].split("]]")[0].replace("[", "").replace("]", "")
    matrix = np.array([float(entry) for entry in written.split(",")]).reshape(3, 3)
    assert matrix == pytest.approx(WORLDS[world].inv().as_matrix(), abs=0.01)
    parts = error.hint.split("product of quaternions (")[1].split(")")[0].split(",")
    turn = rotation_of(np.array([float(part) for part in parts]))
    assert (turn * WORLDS[world]).magnitude() < 0.01


@pytest.mark.validate
def test_its_unit_is_told_too() -> None:
    (error,) = recording_mistakes(ROBOT, in_world(WORLDS["y upwards"], 1e3))
    assert "x, y, z are in mm and poses are in a frame that is turned by about 90 degrees" in error.problem


@pytest.mark.skipif(not SHARED_RECORDINGS.is_dir(), reason="recordings that do not ship with the project")
@pytest.mark.parametrize(("degrees", "cause"), [(0.0, "x, y, z have another origin"), (30.0, "turned by about 30 deg")])
def test_the_frame_of_a_measured_robot_is_told_beside_its_drums(degrees: float, cause: str) -> None:
    folder = SHARED_RECORDINGS / "real-planar"
    robot = read_robot(folder / "robot.toml")
    recording = read_recording(folder / "fit.csv", robot.cable_count)
    world = Rotation.from_euler("y", degrees, degrees=True)
    shown = world.apply(np.nan_to_num(recording.position) - ([0.084, 0.0, 1.2] if degrees == 0.0 else np.zeros(3)))
    shown[:, 1] = np.nan
    (error,) = recording_mistakes(robot, replace(recording, position=shown))
    assert cause in error.problem and " or if " not in error.problem


def test_the_robots_own_world_is_not_refused() -> None:
    assert recording_mistakes(ROBOT, in_world(Rotation.identity())) == ()
