from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from tautwire.estimation.measurement_noise import CheckedNoise, check_noise, estimate_noise
from tautwire.recordings.recording import Recording
from tautwire.robot.schema import Robot, Sensors
from tests.support.recordings import recorded
from tests.support.robots import NAMES, example

ROBOT = example("three")
PAIR = (recorded("three", 1), recorded("three", 2))


def checked(robot: Robot, recordings: tuple[Recording, ...]) -> CheckedNoise:
    return check_noise(robot, estimate_noise(robot, recordings[0]), recordings)


def declared(**sensors: float) -> Robot:
    return replace(ROBOT, sensors=replace(ROBOT.sensors, **sensors))


def with_noise(recording: Recording, alike: float, deviation: float, seed: int) -> Recording:
    """With more noise on the positions, whose neighbours are correlated."""
    white = np.random.default_rng(seed).normal(size=(len(recording.time) + 200, 3))
    coloured = lfilter([1.0], [1.0, -alike], white, axis=0)[200:] * np.sqrt(1.0 - alike**2) * deviation
    return replace(recording, position=recording.position + coloured)


@pytest.mark.validate(but=["empty"])
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("effects", [{}, {"friction": {"coefficient": 0.05}}], ids=["empty", "friction"])
def test_noise_that_is_declared_right_is_kept(name: str, effects: dict[str, dict[str, float]]) -> None:
    recording = recorded(name, 1, effects)
    robot = example(name)
    found = checked(robot, (recording,))
    assert found.notes == ()
    assert found.noise == estimate_noise(robot, recording)
    assert not found.is_coloured


@pytest.mark.parametrize("factor", [0.3, 3.0])
def test_noise_that_is_declared_wrong_is_measured_and_said(factor: float) -> None:
    found = checked(declared(position_noise=3e-4 * factor, tension_noise=2.0 * factor), PAIR)
    assert found.noise.of_outputs(3)[:3] == pytest.approx([3e-4] * 3, rel=0.15)
    assert found.noise.of_outputs(3)[3:] == pytest.approx([2.0] * 3, rel=0.15)
    assert len(found.notes) == 6
    assert "tension_2: declared noise" in found.notes[4] and "the latter is used" in found.notes[4]


def test_one_output_may_be_noisier_than_the_others_of_its_kind() -> None:
    noisy = [replace(r, position=r.position.copy()) for r in PAIR]
    for seed, recording in enumerate(noisy):
        recording.position[:, 2] += np.random.default_rng(seed).normal(scale=1.2e-3, size=len(recording.time))
    found = checked(ROBOT, tuple(noisy))
    assert found.noise.of_outputs(3)[:3] == pytest.approx([3e-4, 3e-4, 1.24e-3], rel=0.15)
    assert len(found.notes) == 1


def test_winch_speeds_noisier_than_declared_are_noticed() -> None:
    found = checked(declared(winch_speed_noise=5e-5), PAIR)
    assert found.noise.winch_speed == pytest.approx(2e-4, rel=0.15)
    assert "winch speeds" in found.notes[0]


def test_a_noise_that_nobody_declared_is_not_checked() -> None:
    robot = replace(ROBOT, sensors=Sensors())
    assert checked(robot, PAIR).notes == ()


@pytest.mark.parametrize("alike", [0.6, 0.9])
def test_coloured_noise_is_noticed_and_left_to_the_disturbance(alike: float) -> None:
    pair = tuple(with_noise(r, alike, 3e-3, seed) for seed, r in enumerate(PAIR))
    found = checked(declared(position_noise=3e-3), pair)
    assert found.is_coloured
    (note,) = found.notes
    assert note.startswith("x, y, z: noise is coloured")
    assert found.noise.of_outputs(3)[:3] == (3e-3, 3e-3, 3e-3)


def test_a_rest_tells_size_and_colour() -> None:
    resting = []
    for seed, recording in enumerate(PAIR):
        speed, position = recording.winch_speed.copy(), recording.position.copy()
        speed[:500] = 0.0
        position[:500] = position[0]
        resting.append(with_noise(replace(recording, winch_speed=speed, position=position), 0.7, 2e-3, seed))
    found = checked(declared(position_noise=5e-3), tuple(resting))
    assert found.noise.of_outputs(3)[:3] == pytest.approx([2e-3] * 3, rel=0.25)
    assert all("at rest neighbouring samples correlate by 0." in note for note in found.notes)
