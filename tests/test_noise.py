from dataclasses import replace

import numpy as np
import pytest

from tautwire.robot import Sensors
from tautwire.tracer.noise import noise_of, roughness
from tests.recordings import recorded
from tests.robots import example


def test_declared_noise_is_taken() -> None:
    noise = noise_of(example("three"), recorded("three", 1))
    assert (noise.position, noise.tension, noise.winch_speed) == (3e-4, 2.0, 2e-4)


def test_noise_that_is_not_declared_is_measured() -> None:
    silent = replace(example("caroca"), sensors=Sensors())
    declared = noise_of(example("caroca"), recorded("caroca", 1))
    measured = noise_of(silent, recorded("caroca", 1))
    assert measured.position == pytest.approx(declared.position, rel=0.1)
    assert measured.tension == pytest.approx(declared.tension, rel=0.1)


def test_roughness_passes_over_what_is_smooth_what_is_missing_and_outliers() -> None:
    random = np.random.default_rng(3)
    time = np.linspace(0.0, 20.0, 4001)
    signal = 100.0 * np.sin(8.0 * time) + random.normal(scale=0.5, size=len(time))
    signal[100:140] = np.nan
    signal[::500] += 300.0
    assert roughness(signal[:, None]) == pytest.approx(0.5, rel=0.1)


def test_a_sensor_that_saw_nothing_has_some_noise() -> None:
    assert roughness(np.full((50, 3), np.nan)) == 1.0
