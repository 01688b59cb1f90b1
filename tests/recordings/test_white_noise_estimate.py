import numpy as np
import pytest

from tautwire.recordings.white_noise_estimate import quantization_step, white_noise_deviation


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


def test_too_few_digits_show_as_a_step_and_one_event_does_not() -> None:
    slow = np.sin(0.02 * np.arange(2000))
    event = slow * 1e-4
    event[700] += 0.3
    assert quantization_step(slow.round(3)) == pytest.approx(1e-3)
    assert quantization_step(event) == 0.0 and quantization_step(np.zeros(4)) == 0.0
    noisy = slow + np.random.default_rng(1).normal(scale=0.1, size=2000)
    assert quantization_step(noisy) == 0.0
