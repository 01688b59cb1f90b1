"""Winch speeds that are noise, and slow ones that are not."""

from dataclasses import replace

import numpy as np
import pytest

from tautwire.recordings.recording import Recording
from tautwire.recordings.standing_winches import without_noise_of_standing_winches
from tests.support.recordings import recorded
from tests.support.robots import example

ROBOT = example("three")
MOVING = recorded("three", 1)
NOISE = ROBOT.sensors.winch_speed_noise or 0.0


def standing(*winches: int) -> Recording:
    """The recording with noise alone of these winches."""
    random, speed = np.random.default_rng(4), MOVING.winch_speed.copy()
    for winch in winches:
        speed[:, winch - 1] = random.normal(0.0, NOISE, len(speed))
    return replace(MOVING, winch_speed=speed)


def test_a_standing_winch_has_no_speed_and_a_note() -> None:
    recording = standing(1, 3)
    found, notes = without_noise_of_standing_winches(ROBOT, recording)
    assert not np.any(found.winch_speed[:, [0, 2]])
    assert np.array_equal(found.winch_speed[:, 1], recording.winch_speed[:, 1])
    assert len(notes) == 1 and notes[0].endswith(": 1, 3")


def test_noise_that_the_robot_file_does_not_state_is_estimated() -> None:
    silent = replace(ROBOT, sensors=replace(ROBOT.sensors, winch_speed_noise=None))
    found, _ = without_noise_of_standing_winches(silent, standing(1, 2, 3))
    assert not np.any(found.winch_speed)


@pytest.mark.parametrize("share", [0.5, 3.0])
def test_a_winch_that_creeps_in_its_noise_moves(share: float) -> None:
    recording = standing(1, 2, 3)
    creeping = replace(recording, winch_speed=recording.winch_speed + share * NOISE)
    assert without_noise_of_standing_winches(ROBOT, creeping) == (creeping, ())


def test_moving_winches_and_silent_ones_stay_as_they_are() -> None:
    silent = replace(MOVING, winch_speed=np.zeros_like(MOVING.winch_speed))
    for recording in (MOVING, silent):
        assert without_noise_of_standing_winches(ROBOT, recording) == (recording, ())
