"""The filter's first update where a start is known badly: platforms whose orientation follows from equilibrium."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tautwire.estimation.compiled_filter import FilterInputs
from tautwire.estimation.filter_linearisation import linearise_filter
from tautwire.estimation.likelihood import Likelihood
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.recordings.recording import Recording
from tautwire.robot.schema import Robot
from tautwire.robot.uncertain_parameters import perturbed_robot, uncertain_parameters
from tests.support.rigid_recordings import rigid_recording, with_noise
from tests.support.rigid_robots import hall_robot


def surveyed(robot: Robot) -> Robot:
    """A robot of a laboratory, its geometry known to a millimetre and its centre of mass to a centimetre."""
    platform = replace(robot.platform, mass_uncertainty=0.1, centre_of_mass_uncertainty=0.01)
    cables = (replace(each, anchor_uncertainty=1e-3, attachment_uncertainty=1e-3) for each in robot.cables)
    return with_noise(replace(robot, platform=platform, cables=tuple(cables)))


DECLARED = surveyed(hall_robot())


def draw(seed: int) -> Recording:
    """A recording of a robot whose numbers differ from the declared ones as its file says that they may."""
    parameters = uncertain_parameters(DECLARED)
    numbers = np.random.default_rng(seed).normal(size=len(parameters))
    true = perturbed_robot(DECLARED, parameters, numbers.tolist())
    return rigid_recording(true, 120, seed=seed)


def likelihood_of(recording: Recording) -> Likelihood:
    return Likelihood(DECLARED, (), estimate_noise(DECLARED, recording), 0.01)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_innovations_have_unit_variance_from_the_first_sample_where_numbers_are_as_uncertain_as_declared(
    seed: int,
) -> None:
    recording = draw(seed)
    innovations = likelihood_of(recording).innovations(recording, ())
    for rows in (slice(0, 5), slice(5, 30), slice(30, 120)):
        values = innovations.values[rows]
        assert np.mean(values**2) == pytest.approx(1.0, abs=5.0 * np.sqrt(2.0 / values.size))
    assert np.max(np.abs(innovations.constants)) < 4.0


def test_of_sensors_without_noise_that_see_what_is_known_exactly_the_prior_stays() -> None:
    recording = draw(5)
    exact = replace(estimate_noise(DECLARED, recording), position=0.0, start_position=0.0)
    first = next(Likelihood(DECLARED, (), exact, 0.01).segments(recording, ()))
    assert not np.any(first.results.prior_offset)


def test_a_run_is_linearised_about_the_state_after_its_first_update_too() -> None:
    recording = draw(6)
    likelihood = likelihood_of(recording)
    first = next(linearise_filter(likelihood, [], recording))
    (rate_jacobian,) = likelihood.rate_jacobians([], first.states[:, :1], first.speeds[:, :1])
    transition = first.transition[0]
    ahead = first.step[0] / 8.0 * (np.eye(len(transition)) - transition) @ rate_jacobian
    assert first.half_transition[0] == pytest.approx(0.5 * (transition + np.eye(len(transition))) + ahead, abs=1e-9)


def test_the_first_sample_is_linearised_at_the_maximum_of_its_posterior_density() -> None:
    """No small step along any state from there, within what the prior knows, makes it denser."""
    recording = draw(4)
    likelihood = likelihood_of(recording)
    prior, covariance = likelihood.start(())
    first = next(likelihood.segments(recording, ()))
    white_variances = likelihood.noise.white_variances(4)
    inputs = FilterInputs(first.columns, np.zeros((0, 1)), likelihood.disturbance_arguments, white_variances, 0.0)
    measured = first.columns[0][:, 0]
    factor = np.linalg.cholesky(covariance + 1e-24 * np.eye(len(prior)))

    def cost(state: np.ndarray) -> float:
        expected, _ = likelihood._filter_functions.first_outputs(state, inputs)
        deviations = np.linalg.solve(factor, state - prior)
        return 0.5 * float(np.sum((measured - expected) ** 2 / white_variances) + deviations @ deviations)

    maximum = first.results.states[:, 0]
    assert cost(maximum) < 1e-3 * cost(prior)
    for direction in factor.T:
        if np.any(direction > 1e-9):
            more, less = (cost(maximum + sign * 1e-3 * direction) for sign in (1.0, -1.0))
            assert abs(more - less) < 1e-2 * abs(more + less - 2.0 * cost(maximum))
