"""A disturbance beside white noise: in the filter's states, and fitted to a recording."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire.estimation.disturbance import Disturbance, OrnsteinUhlenbeck, sensor_noise_only
from tautwire.estimation.disturbance_fit import disturbance_prior, with_fitted_disturbance
from tautwire.estimation.estimation_data import DataSet
from tautwire.estimation.innovation_sensitivities import linearise_filter
from tautwire.estimation.kalman_filter import Noise
from tautwire.estimation.likelihood import Likelihood
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fitter
from tautwire.estimation.residual_analysis import residuals_are_white
from tautwire.recordings.recording import Recording
from tests.support.recordings import recorded
from tests.support.robots import example

ROBOT = example("three")
PAIR = tuple(recorded("three", seed) for seed in (1, 2))
NOISE = estimate_noise(ROBOT, PAIR[0])


def process(rms: float, bandwidth: float, recording: Recording, seed: int) -> NDArray[np.float64]:
    """Three independent Ornstein-Uhlenbeck processes at the samples of a recording (N, 3), stationary."""
    generator = np.random.default_rng(seed)
    values = [rms * generator.normal(size=3)]
    for step in np.diff(recording.time):
        decay = np.exp(-2.0 * np.pi * bandwidth * step)
        values.append(decay * values[-1] + rms * np.sqrt(1.0 - decay**2) * generator.normal(size=3))
    return np.array(values)


def data_of(recording: Recording) -> DataSet:
    return DataSet(recording, ROBOT.platform.start, np.ones(len(recording.time), dtype=bool))


def disturbed(noise: Noise = NOISE, force: float = 0.0, position: float = 0.0, tension: float = 0.0) -> Noise:
    parts = (OrnsteinUhlenbeck(rms, 1.0) for rms in (force, position, tension))
    return replace(noise, disturbance=Disturbance(*parts, noise.position, noise.tension))


def likelihood_of(noise: Noise) -> Likelihood:
    return Likelihood(ROBOT, (), noise, float(np.median(np.diff(PAIR[0].time))))


def test_a_disturbance_of_no_size_changes_nothing() -> None:
    plain, other = (likelihood_of(noise).innovations(PAIR[0], ()) for noise in (NOISE, disturbed()))
    assert np.allclose(other.values, plain.values, atol=1e-8)
    assert np.allclose(other.log_variances, plain.log_variances, atol=1e-10)


def test_errors_with_a_memory_add_their_variance_to_the_first_innovations() -> None:
    plain, other = (
        likelihood_of(noise).innovations(PAIR[0], ()) for noise in (NOISE, disturbed(position=1e-3, tension=5.0))
    )
    added = np.exp(other.log_variances[0]) - np.exp(plain.log_variances[0])
    # Outputs are processed one by one, so that only the first is free of what the others tell.
    assert added[0] == pytest.approx(1e-6)
    assert np.all(added > 0.0)


def test_an_undeclared_weight_is_followed_as_a_force_downwards() -> None:
    recording = recorded("three", 1, {"payload": {"mass": 30.0 / 9.81}})
    slow = Disturbance(OrnsteinUhlenbeck(30.0, 1e-3), *[OrnsteinUhlenbeck(0.0, 1.0)] * 2, NOISE.position, NOISE.tension)
    likelihood = likelihood_of(replace(NOISE, disturbance=slow))
    *_, last = likelihood.segments(recording, ())
    size = likelihood.model.states.numel()
    force, deviations = last.states[size : size + 3, -1], np.sqrt(np.diag(last.covariances[-1]))[size : size + 3]
    # Its inertia is no constant force, and the reference tensions carry it: a part of it does not look like one.
    assert -35.0 < force[2] < -20.0
    assert np.all(np.abs(force[:2]) < -0.3 * force[2])
    assert np.all(deviations < 3.0)


def test_the_linearised_filter_has_the_same_innovation_covariances() -> None:
    likelihood = likelihood_of(disturbed(force=5.0, position=2e-4, tension=3.0))
    recording = PAIR[0].first(60)
    (segment,) = linearise_filter(likelihood, [], recording)
    log_determinants = -2.0 * np.log(np.abs(np.linalg.det(segment.whitening)))
    innovations = likelihood.innovations(recording, ())
    assert log_determinants == pytest.approx(np.sum(innovations.log_variances, axis=1), abs=1e-6)


def test_the_linearised_filter_moves_disturbance_states_as_the_filter_does() -> None:
    likelihood = likelihood_of(disturbed(force=5.0, position=2e-4, tension=3.0))
    recording = PAIR[0].first(60)
    (segment,) = likelihood.segments(recording, ())
    (linearised,) = linearise_filter(likelihood, [], recording)
    size = likelihood.model.states.numel()
    for k, (now, later) in enumerate(pairwise(segment.covariances)):
        gain, output = linearised.gain[k], linearised.output_matrix[k]
        updated = now - gain @ output @ now
        predicted = linearised.transition[k] @ updated @ linearised.transition[k].T
        grown = np.diag(later)[size:] - np.diag(predicted)[size:]
        assert np.all(grown > 0.0)
        predicted[np.diag_indices(len(predicted))] = np.diag(later)
        scale = np.sqrt(np.outer(np.diag(later), np.diag(later)))
        assert np.max(np.abs(later - predicted) / scale) < 1e-6


@pytest.mark.parametrize(("rms", "bandwidth"), [(6.0, 1.0), (12.0, 4.0)])
def test_size_and_bandwidth_of_load_cell_noise_with_a_memory_are_found(rms: float, bandwidth: float) -> None:
    recording = replace(PAIR[0], tension=PAIR[0].tension + process(rms, bandwidth, PAIR[0], 3))
    fitter = Fitter(replace(NOISE, disturbance=disturbance_prior(ROBOT, NOISE).median))
    data = data_of(recording)
    fitted = with_fitted_disturbance(fitter, ROBOT, (), data)
    assert fitted.noise.disturbance is not None
    assert fitted.noise.disturbance.tension.rms == pytest.approx(rms, rel=0.3)
    assert fitted.noise.disturbance.tension.bandwidth == pytest.approx(bandwidth, rel=0.5)
    assert fitted.noise.disturbance.tension_noise < 1.3 * NOISE.tension
    assert residuals_are_white(fitted.innovations(ROBOT, data), data.rows)
    assert not residuals_are_white(Fitter(NOISE).innovations(ROBOT, data), data.rows)


def test_noise_of_the_sensors_has_no_force_and_no_errors_beyond_the_declared_ones() -> None:
    noise = disturbed(force=5.0, position=2e-4, tension=30.0)
    assert noise.disturbance is not None
    sensors = sensor_noise_only(noise.disturbance, 3e-4, 2.0)
    assert (sensors.force.rms, sensors.position.rms, sensors.tension.rms) == (0.0, 2e-4, 2.0)
    assert sensors.tension.bandwidth == noise.disturbance.tension.bandwidth
