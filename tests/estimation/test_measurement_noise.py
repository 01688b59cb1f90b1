from dataclasses import replace

import pytest

from tautwire.estimation.measurement_noise import check_noise, estimate_noise
from tautwire.robot.schema import Sensors
from tests.support.recordings import recorded
from tests.support.robots import example


def test_declared_noise_is_taken() -> None:
    noise = estimate_noise(example("three"), recorded("three", 1))
    assert (noise.position, noise.tension, noise.winch_speed) == (3e-4, 2.0, 2e-4)


def test_noise_that_is_not_declared_is_measured() -> None:
    silent = replace(example("caroca"), sensors=Sensors())
    declared = estimate_noise(example("caroca"), recorded("caroca", 1))
    measured = estimate_noise(silent, recorded("caroca", 1))
    assert measured.position == pytest.approx(declared.position, rel=0.1)
    assert measured.tension == pytest.approx(declared.tension, rel=0.1)


def test_noise_is_at_least_that_of_rounding() -> None:
    robot, recording = example("eight"), recorded("eight", 1)
    rounded = replace(recording, position=recording.position.round(2))
    noise = estimate_noise(robot, recording)
    checked = check_noise(robot, noise, (rounded,))
    assert checked.noise.of_outputs(8)[:3] == pytest.approx([0.01 / 12.0**0.5] * 3, rel=1e-6)
    assert checked.is_coloured
    (note,) = (note for note in checked.notes if note.startswith("x"))
    assert "x, y, z: values are in steps of 0.01 m" in note
    assert not any("steps" in note for note in check_noise(robot, noise, (recording,)).notes)


def test_noise_that_is_not_declared_is_at_least_that_of_rounding() -> None:
    robot, recording = replace(example("eight"), sensors=Sensors()), recorded("eight", 1)
    rounded = replace(recording, position=recording.position.round(2), tension=recording.tension.round(-1))
    noise = estimate_noise(robot, rounded)
    assert (noise.position, noise.tension) == pytest.approx((0.01 / 12.0**0.5, 10.0 / 12.0**0.5), rel=1e-6)
