"""A disturbance beside white noise: in the filter's states, and fitted to a recording."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire.estimation import disturbance_fit, disturbance_posterior
from tautwire.estimation import likelihood as likelihoods
from tautwire.estimation.candidate_fits import fit_and_validate, maximised_validation_likelihood
from tautwire.estimation.candidate_proposals import FitTask
from tautwire.estimation.disturbance import Disturbance, OrnsteinUhlenbeck, sensor_noise_only
from tautwire.estimation.disturbance_fit import (
    Effort,
    fit_disturbance,
    joint_fit,
    marginal_log_likelihood,
    with_fitted_disturbance,
)
from tautwire.estimation.disturbance_posterior import Evaluation, ParameterBox, Posterior, disturbance_prior, logs_of
from tautwire.estimation.estimation_data import DataSet, DataSplit
from tautwire.estimation.filter_linearisation import linearise_filter
from tautwire.estimation.hypotheses import hypotheses
from tautwire.estimation.identification_context import IdentificationContext
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


def test_a_disturbance_of_no_size_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(likelihoods, "MAX_STATE_ANGLE_BESIDE_DISTURBANCE", likelihoods.MAX_STATE_ANGLE)
    plain, other = (likelihood_of(noise).innovations(PAIR[0], ()) for noise in (NOISE, disturbed()))
    assert np.allclose(other.values, plain.values, atol=1e-8)
    assert np.allclose(other.log_variances, plain.log_variances, atol=1e-10)


def test_coarser_steps_beside_a_disturbance_change_far_less_than_noise() -> None:
    plain, other = (likelihood_of(noise).innovations(PAIR[0], ()) for noise in (NOISE, disturbed()))
    rows = np.ones(len(plain.values), dtype=bool)
    assert 0.0 < np.nanmax(np.abs(other.values - plain.values)) < 0.01
    assert other.log_likelihood(rows) == pytest.approx(plain.log_likelihood(rows), abs=0.1)


def test_errors_with_a_memory_add_their_variance_to_the_first_innovations() -> None:
    plain, other = (
        likelihood_of(noise).innovations(PAIR[0], ()) for noise in (NOISE, disturbed(position=1e-3, tension=5.0))
    )
    added = np.exp(other.log_variances[0]) - np.exp(plain.log_variances[0])
    # Outputs are processed one by one, so that only the first is free of what the others tell.
    assert added[0] == pytest.approx(1e-6)
    assert np.all(added > 0.0)


def lengths_of(rms: float, bandwidth: float = 1.0, noise: Noise = NOISE) -> Noise:
    return replace(noise, rope_lengths=(OrnsteinUhlenbeck(rms, bandwidth),) * ROBOT.cable_count)


def test_errors_of_lengths_are_none_of_the_first_sample_from_which_they_count() -> None:
    plain, other = (likelihood_of(noise).innovations(PAIR[0], ()) for noise in (NOISE, lengths_of(1e-4)))
    assert np.allclose(other.log_variances[0], plain.log_variances[0], atol=1e-9)
    assert np.all(other.log_variances[20] > plain.log_variances[20])


def test_recorded_lengths_take_the_place_of_the_noise_of_speeds() -> None:
    no_noise, tiny = replace(NOISE, winch_speed=0.0), lengths_of(1e-12)
    plain, other = (likelihood_of(noise).innovations(PAIR[0], ()) for noise in (no_noise, tiny))
    assert np.allclose(other.log_variances, plain.log_variances, atol=1e-6)


@pytest.mark.parametrize("noise", [NOISE, disturbed(force=1.0)])
def test_errors_of_lengths_with_a_memory_are_innovations_of_the_right_size(noise: Noise) -> None:
    recording, rms, bandwidth = PAIR[0], 3e-4, 1.0
    errors = process(rms, bandwidth, recording, 5)
    wrong = replace(recording, winch_speed=recording.winch_speed - np.gradient(errors, recording.time, axis=0))
    rows = np.ones(recording.sample_count, dtype=bool)
    right, smaller, larger = (
        likelihood_of(lengths_of(factor * rms, bandwidth, noise)).innovations(wrong, ()) for factor in (1.0, 0.5, 2.0)
    )
    # Speeds that are linear between samples smooth such errors a little.
    assert 0.8 < np.mean(right.values**2) < 1.0 < 0.5 * np.mean(likelihood_of(noise).innovations(wrong, ()).values ** 2)
    assert right.log_likelihood(rows) > 20.0 + max(each.log_likelihood(rows) for each in (smaller, larger))


def test_errors_of_lengths_with_a_short_memory_move_the_platform_as_far_as_they_are_said_to() -> None:
    recording, rms, bandwidth = PAIR[0], 3e-4, 8.0
    errors = process(rms, bandwidth, recording, 5)
    wrong = replace(recording, winch_speed=recording.winch_speed - np.gradient(errors, recording.time, axis=0))
    values = likelihood_of(lengths_of(rms, bandwidth)).innovations(wrong, ()).values
    # An error that decays within each step would leave 1.12 to 1.26.
    assert np.mean(values[:, :3] ** 2, axis=0) == pytest.approx(1.0, abs=0.08)


def test_open_loop_errors_of_lengths_count_from_the_first_recorded_one() -> None:
    recording, rms = PAIR[0].first(400), 3e-4
    likelihood = likelihood_of(replace(lengths_of(rms, 0.1), position=0.0))
    expected = np.mean(likelihood.open_loop_variances(recording, ())[100:, :3], axis=0)
    squares = []
    for seed in range(20):
        errors = process(rms, 0.1, recording, seed)
        wrong = replace(recording, winch_speed=recording.winch_speed - np.gradient(errors, recording.time, axis=0))
        begun_wrong, begun_right = (likelihood.simulated_outputs(each, ()).position for each in (wrong, recording))
        difference = begun_wrong - begun_right
        squares.append(np.mean(difference[100:, :3] ** 2, axis=0))
    # Of errors that began at zero, 1.43.
    assert np.sum(np.mean(squares, axis=0)) == pytest.approx(np.sum(expected), rel=0.2)


@pytest.mark.validate
def test_an_undeclared_weight_is_followed_as_a_force_downwards() -> None:
    recording = recorded("three", 1, {"payload": {"mass": 30.0 / 9.81}})
    slow = Disturbance(OrnsteinUhlenbeck(30.0, 1e-3), *[OrnsteinUhlenbeck(0.0, 1.0)] * 2, NOISE.position, NOISE.tension)
    likelihood = likelihood_of(replace(NOISE, disturbance=slow))
    *_, segment = likelihood.segments(recording, ())
    last, size = segment.results, likelihood.model.states.numel()
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
    for k, (now, later) in enumerate(pairwise(segment.results.covariances)):
        gain, output = linearised.gain[k], linearised.output_matrix[k]
        transition, updated = linearised.transition[k], now - gain @ output @ now
        # Noise of the winch speeds acts on unstrained lengths from the start of the step on.
        drift = np.diag(later - transition @ updated @ transition.T)[6:9]
        assert np.all(drift > 0.0)
        updated[range(6, 9), range(6, 9)] += drift
        predicted = transition @ updated @ transition.T
        grown = np.diag(later - predicted)[size:]
        assert np.all(grown > 0.0)
        predicted[range(size, len(later)), range(size, len(later))] += grown
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


def test_the_score_of_a_disturbance_is_the_derivative_of_its_posterior() -> None:
    recording = PAIR[0].first(200)
    data, likelihood = data_of(recording), likelihood_of(disturbed(force=5.0, position=2e-4, tension=3.0))
    posterior = Posterior(likelihood, np.zeros(0), data, disturbance_prior(ROBOT, NOISE))
    logs = logs_of(posterior.prior.median) + np.linspace(-0.3, 0.4, 8)
    gradient, information = posterior.score(posterior.evaluation(logs))
    width = 1e-4
    moves = width * np.eye(8)
    values = [[posterior.evaluation(logs + sign * move).value for sign in (1.0, -1.0)] for move in moves]
    expected = [(later - earlier) / (2.0 * width) for later, earlier in values]
    assert gradient == pytest.approx(expected, rel=1e-3, abs=1e-3)
    assert np.all(np.linalg.eigvalsh(information) > 0.0)


def test_a_score_takes_the_filter_run_of_its_evaluation_unless_that_was_too_large(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    data, likelihood = data_of(PAIR[0].first(200)), likelihood_of(disturbed(force=5.0, position=2e-4, tension=3.0))
    posterior = Posterior(likelihood, np.zeros(0), data, disturbance_prior(ROBOT, NOISE))
    logs = logs_of(posterior.prior.median)
    kept, dropped = (posterior.evaluation(logs, is_scored) for is_scored in (True, False))
    assert len(kept.segments) == 1
    assert dropped.segments == ()
    for with_run, without_run in zip(posterior.score(kept), posterior.score(dropped), strict=True):
        np.testing.assert_array_equal(with_run, without_run)
    monkeypatch.setattr(disturbance_posterior, "MAX_KEPT_COVARIANCES", 200 * len(likelihood.start(())[0]) ** 2 - 1)
    assert replace(posterior).evaluation(logs, is_scored=True).segments == ()


def test_the_score_by_a_free_parameter_is_its_derivative_but_for_the_gains() -> None:
    """Of a mass beside the disturbance; at a bound it stays."""
    recording = PAIR[0].first(200)
    payload = next(h for h in hypotheses(ROBOT) if h.effect.name == "payload")
    robot = ROBOT.with_effect(payload.setting(ROBOT))
    fitter = Fitter(replace(NOISE, disturbance=disturbance_prior(ROBOT, NOISE).median))
    data, (likelihood, values) = data_of(recording), fitter.likelihood(robot, (payload,), data_of(recording))
    box = ParameterBox(np.array([0.5]), np.array([-3.0]), np.array([values[0] + 1.0]))
    posterior = Posterior(likelihood, np.array(values), data, disturbance_prior(ROBOT, NOISE), box)
    at = np.append(logs_of(posterior.prior.median), 1.0)
    gradient, information = posterior.score(posterior.evaluation(at))
    width = 1e-4 * np.eye(9)[8]
    expected = (posterior.evaluation(at + width).value - posterior.evaluation(at - width).value) / 2e-4
    assert abs(expected) > 10.0
    assert gradient[8] == pytest.approx(expected, rel=0.01)
    assert information[8, 8] > 0.0
    assert posterior.values_at(posterior.evaluation(at + 5.0).coordinates) == pytest.approx(box.upper)


def test_parameters_and_disturbance_that_make_up_for_each_other_are_fitted_together() -> None:
    """A weight, and a slow force that the fits in turn leave too large."""
    payload = next(h for h in hypotheses(ROBOT) if h.effect.name == "payload")
    data = data_of(recorded("three", 1, {"payload": {"mass": 3.0}}).first(400))
    slow = replace(disturbance_prior(ROBOT, NOISE).median, force=OrnsteinUhlenbeck(3.0, 0.2))
    fitter = Fitter(replace(NOISE, disturbance=slow))
    fit = fitter.fit_from([ROBOT.with_effect(payload.setting(ROBOT))], (payload,), data)
    joint_fitter, joint = joint_fit(fitter, fit, (payload,), data)
    gain = joint_fitter.log_likelihood(joint.robot, (payload,), data)
    gain -= fitter.log_likelihood(fit.robot, (payload,), data)
    assert gain > 5.0
    assert abs(joint.values[0] - 3.0) < abs(fit.values[0] - 3.0)
    assert joint.robot.effects[0].values["mass"] == joint.values[0]
    _, again = joint_fit(joint_fitter, joint, (payload,), data)
    assert again.values == pytest.approx(joint.values, abs=joint.standard_deviations[0])


@pytest.mark.validate
def test_a_fit_may_begin_where_the_model_is_far_off() -> None:
    """The tracker errs by 3 m, thousands of times its noise, as where a model misses decimetres."""
    recording = PAIR[0].first(400)
    recording = replace(recording, position=recording.position + process(3.0, 3.0, recording, 4))
    fitter = Fitter(replace(NOISE, disturbance=disturbance_prior(ROBOT, NOISE).median))
    fitted = with_fitted_disturbance(fitter, ROBOT, (), data_of(recording), coarse=False)
    policy = replace(fitter.policy, disturbance=replace(fitter.policy.disturbance, start_factors=()))
    without = with_fitted_disturbance(Fitter(fitter.noise, policy=policy), ROBOT, (), data_of(recording), coarse=False)
    log_likelihoods = [each.log_likelihood(ROBOT, (), data_of(recording)) for each in (fitted, without)]
    assert log_likelihoods[0] > log_likelihoods[1] + 5.0


@pytest.mark.parametrize("searches", [True, False])
def test_a_fit_that_searches_begins_at_the_priors_median_as_well(searches: bool) -> None:
    data, prior = data_of(PAIR[0].first(200)), disturbance_prior(ROBOT, NOISE)
    far_off = replace(prior.median, force=OrnsteinUhlenbeck(3000.0, 20.0))
    likelihood = likelihood_of(replace(NOISE, disturbance=far_off))
    effort = Effort(max_iterations=0, is_exact=True, searches=searches)
    reached = fit_disturbance(Posterior(likelihood, np.zeros(0), data, prior), effort=effort)
    assert logs_of(reached) == pytest.approx(logs_of(prior.median if searches else far_off))


def test_a_fit_begins_at_a_start_that_is_a_little_less_probable_as_well(monkeypatch: pytest.MonkeyPatch) -> None:
    data, prior = data_of(PAIR[0].first(200)), disturbance_prior(ROBOT, NOISE)
    sizes = [replace(prior.median, tension=OrnsteinUhlenbeck(rms, 1.0)) for rms in (1.0, 1.1, 300.0)]
    begun: list[float] = []

    def unmoved(_: Posterior, start: Evaluation, *__: object) -> Evaluation:
        begun.append(float(np.exp(start.logs[4])))
        return start

    monkeypatch.setattr(disturbance_fit, "_maximised", unmoved)
    effort = Effort(max_iterations=1, is_exact=False, searches=False)
    for other in sizes[1:]:
        posterior = Posterior(likelihood_of(replace(NOISE, disturbance=sizes[0])), np.zeros(0), data, prior)
        fit_disturbance(posterior, effort=effort, other=other)
    assert begun == pytest.approx([1.0, 1.1, 1.0])


@pytest.mark.validate
def test_a_rival_is_judged_under_the_best_disturbance_of_the_unseen_data() -> None:
    check = replace(PAIR[1], tension=PAIR[1].tension + process(8.0, 2.0, PAIR[1], 5)).first(400)
    fitter = Fitter(replace(NOISE, disturbance=disturbance_prior(ROBOT, NOISE).median))
    estimation, validation = data_of(PAIR[0].first(400)), data_of(check)
    fitter = with_fitted_disturbance(fitter, ROBOT, (), estimation)
    context = IdentificationContext(ROBOT, fitter, DataSplit(estimation, validation, ()))
    of_fit = fitter.log_likelihood(ROBOT, (), validation)
    assert maximised_validation_likelihood(context, ROBOT, (), -np.inf) > of_fit + 100.0


@pytest.mark.validate
def test_a_hypothesis_may_have_another_disturbance_on_unseen_data_at_the_price_of_its_numbers() -> None:
    check = replace(PAIR[1], tension=PAIR[1].tension + process(8.0, 2.0, PAIR[1], 5)).first(400)
    fitter = Fitter(replace(NOISE, disturbance=disturbance_prior(ROBOT, NOISE).median))
    fitter = with_fitted_disturbance(fitter, ROBOT, (), data_of(PAIR[0].first(400)))
    validation = data_of(check)
    best = with_fitted_disturbance(fitter, ROBOT, (), validation).log_likelihood(ROBOT, (), validation)
    marginal = marginal_log_likelihood(fitter, ROBOT, (), validation)
    assert marginal > fitter.log_likelihood(ROBOT, (), validation) + 100.0
    assert best - 4.0 * np.log(400 * 6) - 30.0 < marginal < best - 4.0 * np.log(400 * 6) + 1.0


@pytest.mark.validate
def test_a_candidate_is_fitted_better_beside_a_disturbance_of_its_own() -> None:
    """Under the large one that a model without it needed, nearly anything fits."""
    data, validation = (data_of(recorded("three", seed, {"damping": {"damping": 9e8}}).first(400)) for seed in (3, 53))
    needed = replace(disturbance_prior(ROBOT, NOISE).median, force=OrnsteinUhlenbeck(500.0, 5.0))
    fitter = Fitter(replace(NOISE, disturbance=needed))
    damping = next(h for h in hypotheses(ROBOT) if h.effect.name == "damping" and len(h.cables) == 3)
    task = FitTask((damping,), (ROBOT.with_effect(damping.setting(ROBOT)),), -np.inf, 1e-7)
    once, refitted = (
        fit_and_validate(fitter, replace(task, disturbance_refits=count), data, validation) for count in (0, 2)
    )
    assert once and refitted
    errors = [abs(float(each.fit.values[0]) / 9e8 - 1.0) for each in (once, refitted)]
    assert errors[1] < 0.5 * errors[0]
    assert refitted.log_likelihood > once.log_likelihood + 5.0


def test_what_hardly_changes_while_a_recording_lasts_is_no_disturbance() -> None:
    """A load cell 30 N off zero, which noise with a memory of hours would explain as well as an offset does."""
    recording = PAIR[0].first(400)
    recording = replace(recording, tension=recording.tension + np.array([30.0, 0.0, 0.0]))
    fitter = Fitter(replace(NOISE, disturbance=disturbance_prior(ROBOT, NOISE).median))
    fitted = with_fitted_disturbance(fitter, ROBOT, (), data_of(recording), coarse=False).noise.disturbance
    assert fitted is not None
    duration = recording.time[-1] - recording.time[0]
    bandwidths = [each.bandwidth for each in (fitted.force, fitted.position, fitted.tension)]
    assert min(bandwidths) == pytest.approx(1.0 / duration)


def test_a_robot_without_load_cells_has_no_errors_of_them() -> None:
    disturbance = Disturbance(
        OrnsteinUhlenbeck(2.0, 1.0), OrnsteinUhlenbeck(3e-4, 0.5), OrnsteinUhlenbeck(0.7, 1.0), 1e-4, 1.0
    )
    sentence = disturbance.sentence(has_position=True, has_tension=False)
    assert "a random force of 2 N (below 1 Hz) on the platform, and errors with a memory of 0.0003 m" in sentence
    assert "tensions" not in sentence
    assert "tensions" in disturbance.sentence(has_position=True, has_tension=True)
