from dataclasses import replace

import pytest

from tautwire.estimation.measurement_noise import estimate_noise
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
