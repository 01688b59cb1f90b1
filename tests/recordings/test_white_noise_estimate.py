import numpy as np
import pytest

from tautwire.recordings.white_noise_estimate import white_noise_deviation


def test_roughness_passes_over_what_is_smooth_what_is_missing_and_outliers() -> None:
    random = np.random.default_rng(3)
    time = np.linspace(0.0, 20.0, 4001)
    signal = 100.0 * np.sin(8.0 * time) + random.normal(scale=0.5, size=len(time))
    signal[100:140] = np.nan
    signal[::500] += 300.0
    assert white_noise_deviation(signal[:, None]) == pytest.approx(0.5, rel=0.1)


def test_a_sensor_that_saw_nothing_has_some_noise() -> None:
    assert white_noise_deviation(np.full((50, 3), np.nan)) == 1.0


def test_a_sensor_that_shows_less_often_is_as_noisy_as_it_is() -> None:
    signal = np.random.default_rng(4).normal(scale=0.5, size=20000)
    signal[np.arange(20000) % 10 > 0] = np.nan
    assert white_noise_deviation(signal[:, None]) == pytest.approx(0.5, rel=0.2)
