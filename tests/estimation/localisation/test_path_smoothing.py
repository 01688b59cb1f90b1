"""The path behind noisy positions: right within its covariance, also across gaps and missing axes."""

import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire.estimation.localisation import path_smoothing
from tautwire.estimation.localisation.path_smoothing import (
    SmoothedPath,
    maximum_likelihood_intensity,
    smooth_axis,
    smooth_path,
)
from tautwire.recordings.recording import Recording

Array = NDArray[np.float64]

SIGMA = 2e-4
START = (1.0, 2.0, 3.0)


def truth(time: Array) -> tuple[Array, Array, Array]:
    """Position, velocity and acceleration of a slow turn with a vibration; (N,) each."""
    parts = ((0.8, 0.7, 0.0), (0.003, 9.0, 1.0))
    return (
        sum((a * np.sin(w * time + p) for a, w, p in parts), np.zeros_like(time)),
        sum((a * w * np.cos(w * time + p) for a, w, p in parts), np.zeros_like(time)),
        sum((-a * w**2 * np.sin(w * time + p) for a, w, p in parts), np.zeros_like(time)),
    )


def recording(time: Array, hidden: NDArray[np.bool_] | None = None) -> Recording:
    noise = np.random.default_rng(3).normal(0.0, SIGMA, (len(time), 3))
    position = truth(time)[0][:, None] + noise
    if hidden is not None:
        position[hidden] = np.nan
    return Recording("made", time, np.zeros((len(time), 3)), np.full((len(time), 3), np.nan), position)


def deviations(path: SmoothedPath, axis: int) -> Array:
    """Mean squares of errors over their standard deviations: position, velocity, acceleration."""
    result = np.column_stack([path.position[:, axis], path.velocity[:, axis], path.acceleration[:, axis]])
    spread = np.sqrt(np.diagonal(path.covariance[:, axis], axis1=1, axis2=2))
    ratios: Array = np.mean(((result - np.column_stack(truth(path.time))) / spread) ** 2, axis=0)
    return ratios


def test_errors_are_as_large_as_the_covariance_says() -> None:
    path = smooth_path(recording(np.arange(0.0, 20.0, 0.01)), START, [SIGMA] * 3)
    for axis in range(3):
        assert np.all(deviations(path, axis) < 1.5)
        assert np.sqrt(path.covariance[1000, axis, 0, 0]) < 0.5 * SIGMA


def test_a_gap_uneven_samples_and_another_rate_are_bridged() -> None:
    time = np.arange(0.0, 20.0, 0.01)
    time = (time + np.random.default_rng(4).uniform(-1e-3, 1e-3, len(time)))[(time < 7.0) | (time > 7.4)]
    every = np.arange(len(time)) % 4 != 0
    path = smooth_path(recording(time, every), START, [SIGMA] * 3)
    assert np.all(np.isfinite(path.position))
    assert np.all(deviations(path, 0) < 1.6)
    gap = (time > 6.95) & (time < 7.45)
    assert np.max(path.covariance[gap, 0, 0, 0]) > 3.0 * np.median(path.covariance[:, 0, 0, 0])


def test_an_axis_that_was_not_measured_stays_where_it_starts() -> None:
    made = recording(np.arange(0.0, 3.0, 0.01))
    made.position[:, 1] = np.nan
    path = smooth_path(made, START, [SIGMA] * 3)
    assert path.measured.tolist() == [True, False, True]
    assert np.all(path.position[:, 1] == START[1])
    assert not np.any(path.velocity[:, 1]) and not np.any(path.covariance[:, 1])


def test_the_intensity_of_a_random_jerk_is_found() -> None:
    step, count, intensity = 0.01, 6000, 0.7
    jerk = np.random.default_rng(5).normal(0.0, np.sqrt(intensity / step), count)
    acceleration = np.cumsum(jerk) * step
    position = np.cumsum(np.cumsum(acceleration)) * step**2
    values = position + np.random.default_rng(6).normal(0.0, 1e-3, count)
    time = step * np.arange(count)
    result = maximum_likelihood_intensity(time, values, 1e-3)
    assert result == pytest.approx(intensity, rel=0.5)
    smoothed = smooth_axis(time, values, 1e-3, result)
    error = (smoothed.state[:, 2] - acceleration)[50:-50]
    assert np.mean(error**2 / smoothed.covariance[50:-50, 2, 2]) == pytest.approx(1.0, abs=0.25)


def test_a_sensor_that_begins_late_has_a_path(monkeypatch: pytest.MonkeyPatch) -> None:
    """After all the samples of which the intensity is fitted otherwise."""
    monkeypatch.setattr(path_smoothing, "MAX_LIKELIHOOD_SAMPLES", 500)
    time = np.arange(0.0, 12.0, 0.01)
    path = smooth_path(recording(time, time < 6.0), START, [SIGMA] * 3)
    assert np.all(np.isfinite(path.position))
    error = path.position[time > 6.5, 0] - truth(time)[0][time > 6.5]
    assert np.max(np.abs(error)) < 5.0 * SIGMA
