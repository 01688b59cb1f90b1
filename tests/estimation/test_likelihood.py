"""Innovations against what a Kalman filter must do."""

from collections.abc import Callable
from dataclasses import replace

import casadi
import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire.estimation import likelihood as likelihoods
from tautwire.estimation.compiled_filter import FilterInputs, FilterResults, FilterState
from tautwire.estimation.disturbance_posterior import disturbance_prior
from tautwire.estimation.integration_steps import Substeps
from tautwire.estimation.kalman_filter import slope_function, static_start_function
from tautwire.estimation.likelihood import Likelihood
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.robot.schema import EffectSetting
from tautwire.robot.symbolic_model import FreeParameter, symbolic_model
from tautwire_fmu.laws.effects import BY_NAME
from tests.support.effect_cases import Case, same
from tests.support.recordings import recorded
from tests.support.robots import example

ROBOT = example("three")
RECORDING = recorded("three", 1)
NOISE = estimate_noise(ROBOT, RECORDING)
ALL = np.ones(len(RECORDING.time), dtype=bool)
MASS = FreeParameter(0, "mass")


@pytest.mark.parametrize("name", ["three", "caroca", "eight"])
def test_innovations_of_a_true_model_are_white_with_unit_variance(name: str) -> None:
    robot, recording = example(name), recorded(name, 1)
    interval = recording.time[1] - recording.time[0]
    innovations = Likelihood(robot, (), estimate_noise(robot, recording), interval).innovations(recording, [])
    square = innovations.mean_square(np.ones(len(recording.time), dtype=bool))
    assert np.all(np.abs(square - 1.0) < 5.0 * np.sqrt(2.0 / len(recording.time)))
    values = innovations.values
    for lag in (1, 2, 5):
        alike = np.mean(values[lag:] * values[:-lag], axis=0)
        assert np.all(np.abs(alike) < 5.0 / np.sqrt(len(values)))


def test_given_constants_at_zero_the_filter_is_that_of_the_declared_robot() -> None:
    uncertain = replace(ROBOT, cables=tuple(replace(c, modulus_uncertainty=0.05 * c.modulus) for c in ROBOT.cables))
    noise = replace(NOISE, disturbance=disturbance_prior(ROBOT, NOISE).median)
    conditional = Likelihood(uncertain, (), noise, 0.02).given_constants(np.zeros(3))
    innovations = conditional.innovations(RECORDING, ())
    expected = Likelihood(ROBOT, (), noise, 0.02).innovations(RECORDING, ())
    np.testing.assert_allclose(innovations.log_variances, expected.log_variances, atol=1e-9)
    np.testing.assert_allclose(innovations.values, expected.values, atol=1e-9)


def test_a_filter_without_sensitivities_takes_derivatives_by_disturbances_alone() -> None:
    noise = replace(NOISE, disturbance=disturbance_prior(ROBOT, NOISE).median)
    model = symbolic_model(ROBOT.with_effect(EffectSetting("payload", {"mass": 1.0})), [FreeParameter(0, "mass")])
    slopes = slope_function(model, 3, noise, Substeps(5, 1), has_sensitivities=False)
    static_start = static_start_function(model, has_sensitivities=False)
    forces = 3
    assert slopes.size_out(1) == (model.states.numel(), forces)
    assert static_start.size_out(1) == (static_start.size_out(0)[0], 0)


def test_slopes_are_the_derivatives_of_the_innovations() -> None:
    robot = ROBOT.with_effect(EffectSetting("damping", {"damping": 6e8}, (1, 2, 3)))
    robot = robot.with_effect(EffectSetting("payload", {"mass": 1.0}))
    free = [FreeParameter(0, "damping"), FreeParameter(1, "mass")]
    likelihood = Likelihood(robot, free, NOISE, 0.02)
    short = replace(
        RECORDING,
        time=RECORDING.time[:60],
        winch_speed=RECORDING.winch_speed[:60],
        tension=RECORDING.tension[:60],
        position=RECORDING.position[:60],
    )
    at = np.array([6e8, 1.0])
    slopes = likelihood.innovations(short, at).sensitivities
    for index, width in enumerate((1e5, 1e-4)):
        step = np.zeros(2)
        step[index] = width
        more, less = (likelihood.innovations(short, at + sign * step).values for sign in (1, -1))
        difference = (more - less) / (2.0 * width)
        assert np.max(np.abs(difference - slopes[:, :, index])) < 0.02 * np.max(np.abs(difference))


def test_slopes_beside_uncertain_anchors_are_the_derivatives_of_the_innovations() -> None:
    """The filter moves the anchors on the way, and with them the static start, which the load has a part in too."""
    surveyed = replace(ROBOT, cables=tuple(replace(cable, anchor_uncertainty=3e-3) for cable in ROBOT.cables))
    likelihood = Likelihood(surveyed.with_effect(EffectSetting("payload", {"mass": 0.0})), (MASS,), NOISE, 0.02)
    short = RECORDING.first(400)
    slopes = likelihood.innovations(short, [0.0]).sensitivities[:, :, 0]
    more, less = (likelihood.innovations(short, [mass]).values for mass in (1e-4, -1e-4))
    error = (more - less) / 2e-4 - slopes
    assert np.linalg.norm(error) < 0.03 * np.linalg.norm(slopes)


def test_jacobians_of_the_rates_are_those_of_the_whole_model_beside_uncertain_anchors() -> None:
    """The start's tensions depend on the anchors, and the rates on these."""
    surveyed = replace(ROBOT, cables=tuple(replace(cable, anchor_uncertainty=3e-3) for cable in ROBOT.cables))
    relaxing = EffectSetting("relaxation", {"modulus": 3e10, "time": 0.3}, (1, 2, 3))
    likelihood = Likelihood(surveyed.with_effect(relaxing), (), NOISE, 0.02)
    model, count = likelihood.model, len(likelihood.uncertain)
    whole = casadi.Function("whole", [model.states, model.inputs], [casadi.jacobian(model.rates, model.states)])
    start, _ = likelihood.start([])
    state = start + np.append(np.zeros(len(start) - count), np.linspace(-1.0, 1.0, count))
    expected = np.array(whole(state, np.append([0.1, -0.2, 0.05], np.zeros(3))))
    jacobians = likelihood.rate_jacobians([], state[:, None], np.array([[0.1], [-0.2], [0.05]]))[0]
    assert jacobians == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.max(np.abs(expected)))
    assert np.any(expected[:, len(start) - count :])
    functions, at_rest = likelihood._filter_functions, np.array(whole(start, np.zeros(6)))
    assert len(functions.settling) == 3
    settling = np.array(functions.settling_slopes([]))
    assert settling == pytest.approx(at_rest[functions.settling], rel=1e-9, abs=1e-9 * np.max(np.abs(settling)))
    assert np.any(settling[:, len(start) - count :])


def test_noise_of_winch_speeds_reaches_tensions_alike_by_damping_and_by_relaxation_in_no_time() -> None:
    more_damping, time = 5e8, 1e-3
    declared = ROBOT.cables[0].damping
    relaxation = EffectSetting(
        "relaxation", BY_NAME["relaxation"].completed_values({"modulus": more_damping / time, "time": time}), (1, 2, 3)
    )
    damping = EffectSetting("damping", {"damping": declared + more_damping}, (1, 2, 3))
    relaxing, damped = (
        Likelihood(ROBOT.with_effect(effect), (), replace(NOISE, tension=0.05), 0.02)
        .innovations(RECORDING.first(200), ())
        .log_variances
        for effect in (relaxation, damping)
    )
    # Before that the start is not known.
    assert relaxing[10:] == pytest.approx(damped[10:], abs=0.05)


def test_missing_cells_are_passed_over() -> None:
    tension = RECORDING.tension.copy()
    tension[100:300, 1] = np.nan
    blind = replace(RECORDING, tension=tension, position=np.full_like(RECORDING.position, np.nan))
    innovations = Likelihood(ROBOT, (), NOISE, 0.02).innovations(blind, [])
    assert np.array_equal(innovations.observed, np.isfinite(blind.measured()))
    square = innovations.mean_square(ALL)
    assert np.all(np.isnan(square[:3]))
    assert np.all(np.abs(square[3:] - 1.0) < 0.3)


def test_a_wrong_model_is_less_probable() -> None:
    right = Likelihood(ROBOT, (), NOISE, 0.02).innovations(RECORDING, [])
    heavier = ROBOT.with_effect(EffectSetting("payload", {"mass": 1.0}))
    wrong = Likelihood(heavier, [FreeParameter(0, "mass")], NOISE, 0.02).innovations(RECORDING, [1.0])
    assert right.log_likelihood(ALL) - wrong.log_likelihood(ALL) > 100.0


def test_parts_of_a_recording_add_up() -> None:
    innovations = Likelihood(ROBOT, (), NOISE, 0.02).innovations(RECORDING, [])
    first = np.arange(len(ALL)) < 300
    parts = innovations.log_likelihood(first) + innovations.log_likelihood(~first)
    assert parts == pytest.approx(innovations.log_likelihood(ALL), rel=1e-12)


def test_the_open_loop_variance_starts_at_the_sensors_and_grows_with_the_winches() -> None:
    variance = Likelihood(ROBOT, (), NOISE, 0.02).open_loop_variances(RECORDING, [])
    assert variance[0] == pytest.approx([NOISE.position**2] * 3 + [NOISE.tension**2] * 3)
    assert np.all(variance[-1] > variance[0])


@pytest.mark.validate(but=["relaxation-modulus-time-0.0001"])
@pytest.mark.parametrize(
    ("effect", "within"),
    [
        (same("damping", damping=1.7e9), 1e-4),
        (same("relaxation", modulus=3e10, time=0.5), 1e-4),
        (same("relaxation", modulus=3e10, time=0.001), 0.02),
        # It yields within the sample.
        (same("hysteresis", force=60.0, yield_strain=1e-4), 0.02),
    ],
    ids=str,
)
def test_the_transition_of_a_sample_is_the_derivative_of_the_next_state(effect: Case, within: float) -> None:
    """Of eight cables, whose vibrations turn by half a radian and more in a sample."""
    robot, recording = example("eight"), recorded("eight", 1)
    robot = robot.with_effect(effect.setting(robot))
    likelihood = Likelihood(robot, (), estimate_noise(robot, recording), 0.01)
    state, speeds = likelihood.start([])[0][:, None], np.full((8, 1), 0.02)
    unseen, moment = np.zeros((11, 1)), (speeds, 1.1 * speeds, np.zeros((16, 1)), np.full((1, 1), 0.01))

    def run(begun: np.ndarray) -> FilterResults:
        size = len(begun)
        columns = (unseen, unseen, unseen, *moment, np.zeros((1, 1)), np.zeros((0, 1)))
        inputs = FilterInputs(columns, np.zeros((0, 1)), np.zeros((0, 1)), np.ones(11), 0.0)
        before = FilterState(begun.ravel(), np.zeros(size), np.eye(size), np.zeros((size, 0)))
        return likelihood._filter_functions.run(before, inputs, keeps_covariances=True)

    transition = run(state).transitions[0]
    for place, width in ((0, 1e-7), (4, 1e-5), (6, 1e-7), (len(state) - 1, 1e-7)):
        step = np.zeros_like(state)
        step[place] = width
        difference = (run(state + step).end.state - run(state - step).end.state) / (2.0 * width)
        assert np.max(np.abs(difference - transition[:, place])) < within * np.max(np.abs(difference))


def test_segments_follow_one_another_as_one_run(monkeypatch: pytest.MonkeyPatch) -> None:
    noise = replace(NOISE, disturbance=disturbance_prior(ROBOT, NOISE).median)
    filtered = Likelihood(ROBOT.with_effect(EffectSetting("payload", {"mass": 1.0})), (MASS,), noise, 0.02)
    in_one = filtered.innovations(RECORDING, [1.0])
    monkeypatch.setattr(likelihoods, "SEGMENT_SAMPLES", 350)
    in_parts = filtered.innovations(RECORDING, [1.0])
    kept = filtered.innovations(RECORDING, [1.0], keeps_segments=True)
    assert in_one.segments == in_parts.segments == ()
    assert [len(segment.results.covariances) for segment in kept.segments] == [500, 301]
    for innovations in (in_parts, kept):
        np.testing.assert_array_equal(innovations.values, in_one.values)
        np.testing.assert_array_equal(innovations.log_variances, in_one.log_variances)
        np.testing.assert_array_equal(innovations.sensitivities, in_one.sensitivities)


def test_a_run_can_be_ended_at_each_of_its_segments() -> None:
    polls = iter([None, KeyboardInterrupt])

    def poll() -> None:
        if next(polls):
            raise KeyboardInterrupt

    segments = Likelihood(ROBOT, (), NOISE, 0.02, poll).segments(RECORDING, [])
    assert len(next(segments).results.values) == 500
    with pytest.raises(KeyboardInterrupt):
        next(segments)


@pytest.mark.validate(only=["half rate-position"])
@pytest.mark.parametrize(("outputs", "quantity"), [("position", "position"), ("all", "tension")])
@pytest.mark.parametrize("is_kept", [lambda rows: rows % 2 == 0, lambda rows: rows % 7 != 3], ids=["half rate", "gaps"])
def test_a_late_sensor_that_misses_samples_is_most_probable_at_its_delay(
    outputs: str, quantity: str, is_kept: Callable[[NDArray[np.int_]], NDArray[np.bool_]]
) -> None:
    robot, whole = example("three"), recorded("three", 3, {"sensor_delay": {"seconds": 0.06, "outputs": outputs}})
    samples = getattr(whole, quantity).copy()
    samples[~is_kept(np.arange(len(samples)))] = np.nan
    recording = replace(whole, **{quantity: samples})
    setting = EffectSetting("sensor_delay", {"tension_delay": 0.0, "position_delay": 0.0}, (1, 2, 3))
    free = [FreeParameter(0, "tension_delay"), FreeParameter(0, "position_delay")]
    likelihood = Likelihood(robot.with_effect(setting), free, estimate_noise(robot, whole), 0.02)
    rows = np.ones(len(samples), dtype=bool)
    tension_delay = 0.06 if outputs == "all" else 0.0
    late, punctual = (likelihood.innovations(recording, values) for values in ([tension_delay, 0.06], [0.0, 0.0]))
    count = np.isfinite(np.hstack([recording.position, recording.tension])).sum(axis=0)
    assert late.observed.sum(axis=0).tolist() == punctual.observed.sum(axis=0).tolist() == count.tolist()
    assert late.log_likelihood(rows) > punctual.log_likelihood(rows) + 100.0
    assert late.overall_mean_square(rows) == pytest.approx(1.0, abs=0.1)
