"""A platform that moves while all winches stand is told; one that swings on its ropes is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tautwire.recordings.consistency import recording_mistakes
from tautwire.recordings.recording import Recording, read_recording
from tautwire.recordings.recording_notes import recording_notes
from tautwire.recordings.unwound_motion import unwound_motion_error, unwound_motion_text
from tests.support.pose_recordings import swinging_recording
from tests.support.rigid_robots import underactuated_robot
from tests.support.robots import EXAMPLES, example


def standing(name: str, noise: float = 0.0) -> Recording:
    """The example's recording with winches that stand, or show noise alone."""
    recording = read_recording(EXAMPLES / name / "check.csv", example(name).cable_count)
    generator = np.random.default_rng(2)
    return recording.with_winch_speed(noise * generator.standard_normal(recording.winch_speed.shape))


def without_tensions(recording: Recording) -> Recording:
    return replace(recording, tension=np.full_like(recording.tension, np.nan))


@pytest.mark.parametrize("name", ["three", "caroca", "eight", "cogiro", "ipanema"])
def test_ropes_that_change_by_more_than_tension_stretches_them_are_told(name: str) -> None:
    text = unwound_motion_text(example(name), standing(name))
    assert text is not None and text.startswith("all winches stand, and by the positions")


@pytest.mark.parametrize("name", ["three", "caroca", "cogiro"])
def test_they_are_no_mistake_of_the_columns(name: str) -> None:
    robot, recording = example(name), without_tensions(standing(name))
    assert recording_mistakes(robot, recording) == ()
    assert any("all winches stand" in note for note in recording_notes(robot, recording))


def test_winches_that_show_noise_alone_stand() -> None:
    assert unwound_motion_text(example("three"), standing("three", 2e-4)) is not None


def test_positions_alone_tell_it() -> None:
    assert unwound_motion_text(example("three"), without_tensions(standing("three"))) is not None


def test_a_platform_that_swings_on_its_ropes_is_no_mistake() -> None:
    robot = underactuated_robot()
    assert unwound_motion_text(robot, swinging_recording(robot)) is None


def test_a_load_that_stretches_its_ropes_is_no_mistake() -> None:
    """Of ropes that give by a twentieth of their length under twice the load."""
    robot, recording = example("three"), standing("three")
    soft = replace(robot, cables=tuple(replace(cable, modulus=2e9) for cable in robot.cables))
    lengths = np.linalg.norm(np.array(robot.anchors) - recording.position[:, None], axis=2)
    stiffness = np.array([cable.modulus * cable.area for cable in soft.cables]) / lengths[0]
    stretched = replace(recording, tension=2000.0 + stiffness * (lengths - lengths.mean(axis=0)))
    assert unwound_motion_text(soft, replace(stretched, tension=np.maximum(stretched.tension, 500.0))) is None


def test_a_rope_that_was_slack_may_be_any_length() -> None:
    recording = standing("three")
    tension = recording.tension.copy()
    tension[::3, 1] = 0.0
    assert unwound_motion_text(example("three"), replace(recording, tension=tension)) is None


def test_winches_that_wind_are_not_judged() -> None:
    recording = read_recording(EXAMPLES / "three" / "check.csv", 3)
    assert unwound_motion_text(example("three"), recording) is None


@pytest.mark.parametrize("name", ["three", "caroca", "eight", "cogiro", "ipanema"])
def test_taut_ropes_that_grow_and_shrink_on_winches_that_stand_are_a_mistake_of_the_columns(name: str) -> None:
    robot, recording = example(name), standing(name)
    (error,) = recording_mistakes(robot, recording)
    assert "no winch turns" in str(error) and "columns of the winches" in str(error)


@pytest.mark.parametrize("outlier", [0.0, 3.0])
def test_taut_ropes_that_only_grow_may_creep(outlier: float) -> None:
    robot, recording = example("three"), standing("three")
    position = np.array(robot.platform.start) - np.outer(np.linspace(0.0, 1.0, len(recording.time)), [0.0, 0.0, 2.0])
    position[len(position) // 2] += outlier
    assert unwound_motion_text(robot, replace(recording, position=position)) is not None
    assert unwound_motion_error(robot, replace(recording, position=position)) is None


def test_taut_ropes_whose_length_follows_their_tension_are_softer_than_declared() -> None:
    robot, recording = example("three"), standing("three")
    lengths = np.linalg.norm(np.array(robot.anchors) - recording.position[:, None], axis=2)
    tension = 1000.0 + 500.0 * (lengths - lengths.mean(axis=0)) / np.ptp(lengths, axis=0)
    assert unwound_motion_text(robot, replace(recording, tension=tension)) is not None
    assert unwound_motion_error(robot, replace(recording, tension=tension)) is None


def test_a_platform_that_hands_lift_lets_ropes_hang() -> None:
    recording = standing("three")
    tension = np.where(recording.time[:, None] > 20.0, 0.0, recording.tension)
    assert unwound_motion_error(example("three"), replace(recording, tension=tension)) is None


def test_speeds_within_their_noise_are_no_mistake() -> None:
    robot, recording = example("three"), standing("three", 2e-4)
    assert unwound_motion_text(robot, recording) is not None
    assert unwound_motion_error(robot, recording) is None
