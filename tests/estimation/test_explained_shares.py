"""Shares of what is missed: simulations as the FMUs run, and what each effect takes away."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import t as students_t

from tautwire.estimation.cosimulation_validation import cosimulate_data_set, noise_floor
from tautwire.estimation.disturbance_posterior import disturbance_prior
from tautwire.estimation.estimation_data import DataSplit, split_data
from tautwire.estimation.explained_shares import (
    amplitude_spread,
    as_declared,
    explained_shares,
    missed_with_effects,
    missed_without_effects,
    remaining_error,
    sensor_noise_floor,
    simulated_outputs,
    time_deviations,
)
from tautwire.estimation.hypotheses import Hypothesis, free_parameters
from tautwire.estimation.identification_context import IdentificationContext
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fit, Fitter
from tautwire.estimation.smoothed_states import with_initial_state
from tautwire.estimation.trace_result import Comparison, Errors
from tautwire.robot.schema import EffectSetting, Robot
from tautwire_fmu.laws.effects import BY_NAME
from tests.support.recordings import recorded
from tests.support.robots import example

ROBOT = example("three")
RECORDING = recorded("three", 1, {"payload": {"mass": 12.0}}).first(301)
NOISE = estimate_noise(ROBOT, RECORDING)
SPLIT: DataSplit = split_data(ROBOT, NOISE, RECORDING, recorded("three", 51, {"payload": {"mass": 12.0}}).first(301))
FITTER = Fitter(replace(NOISE, disturbance=disturbance_prior(ROBOT, NOISE).median))
LOADED = ROBOT.with_effect(EffectSetting("payload", {"mass": 12.0}))


@pytest.mark.validate
@pytest.mark.parametrize(
    ("effect", "values", "max_position_error"),
    [
        ("payload", {"mass": 12.0}, 1e-5),
        ("friction", {"coefficient": 0.05}, 1e-5),
        ("sensor_gain", {"tension_gain": 1.1, "position_gain": 1.0}, 1e-5),
        # Between samples 20 ms apart a line stands for the motion.
        ("sensor_delay", {"tension_delay": 0.035, "position_delay": 0.05}, 5e-4),
    ],
)
def test_simulated_outputs_are_those_of_the_fmus(
    effect: str, values: dict[str, float], max_position_error: float
) -> None:
    cables = () if effect == "payload" else ROBOT.cable_numbers
    robot = with_initial_state(FITTER, ROBOT.with_effect(EffectSetting(effect, values, cables)), SPLIT.validation)
    simulated = simulated_outputs(FITTER, robot, SPLIT.validation)
    by_fmus = cosimulate_data_set(robot, SPLIT.validation)
    assert np.max(np.abs(simulated.position - by_fmus.position)) < max_position_error
    assert np.max(np.abs(simulated.tension - by_fmus.tension)) < 2e4 * max_position_error


def test_the_best_determined_time_constant_counts_but_for_delays_and_drifts() -> None:
    relaxation = Hypothesis(BY_NAME["relaxation"], (1, 2, 3), ("modulus", "time", "modulus_2", "time_2"))
    delay = Hypothesis(BY_NAME["sensor_delay"], (1, 2, 3), ("tension_delay",))
    creep = Hypothesis(BY_NAME["creep"], (1, 2, 3))
    values = {"modulus": 1e10, "time": 0.5, "modulus_2": 1e9, "time_2": 10.0}
    robot = ROBOT.with_effect(relaxation.setting(ROBOT, values))
    for each in (delay, creep):
        robot = robot.with_effect(each.setting(ROBOT))
    free = free_parameters(robot, (relaxation, delay, creep))
    deviations = {"modulus": 1e9, "time": 0.1, "modulus_2": 1e9, "time_2": 30.0}
    fitted = np.array([values.get(each.name, 0.01) for each in free])
    fit = Fit(robot, tuple(free), fitted, np.diag([deviations.get(each.name, 1.0) ** 2 for each in free]))
    assert time_deviations(fit, (relaxation, delay, creep)) == pytest.approx((0.2, 0.0, 0.0))


def test_the_time_constants_of_cables_count_with_their_median() -> None:
    by_cable = [Hypothesis(BY_NAME["relaxation"], (cable,)) for cable in ROBOT.cable_numbers]
    robot = ROBOT
    for each in by_cable:
        robot = robot.with_effect(each.setting(ROBOT, {"modulus": 1e10, "time": 1.0}))
    free = free_parameters(robot, by_cable)
    fit = Fit(robot, tuple(free), np.ones(len(free)), np.diag(np.repeat([0.4, 0.7, 9.0], 2) ** 2))
    assert time_deviations(fit, by_cable) == pytest.approx((0.7, 0.7, 0.7))


def test_an_effect_that_grows_has_another_amplitude_on_each_stretch() -> None:
    """A load from zero to twice that of the effect: by stretches of an eighth its factors are 1/8 to 15/8."""
    signature = np.ones((8000, 2))
    residual = np.linspace(-1.0, 1.0, 8000)[:, None] * signature
    every = np.ones(8000, dtype=bool)
    factors = (2.0 * np.arange(8) + 1.0) / 8.0
    expected = students_t.ppf(0.975, 6) * np.std(factors, ddof=2) / np.sqrt(8.0)
    assert amplitude_spread(residual, signature, every, 8) == pytest.approx(expected, rel=1e-3)
    assert amplitude_spread(0.0 * residual, signature, every, 8) == 0.0
    noise = np.random.default_rng(1).normal(size=(8000, 2))
    assert amplitude_spread(noise, signature, every, 8) < 0.03


def test_drag_by_another_power_of_the_speed_keeps_its_amplitude_and_one_that_wears_off_does_not() -> None:
    """Linear in speed, its factor to a quadratic one is 1 / v; on eight stretches speeds come in no order."""
    every = np.ones(8000, dtype=bool)
    speed = np.repeat([0.6, 1.3, 0.7, 1.2, 1.0, 0.5, 1.1, 0.8], 1000)[:, None] * np.ones(2)
    quadratic, linear = speed**2, speed
    wearing_off = np.linspace(2.0, 0.0, 8000)[:, None] * quadratic
    assert amplitude_spread(linear - quadratic, quadratic, every, 8) < 0.05
    assert amplitude_spread(wearing_off - quadratic, quadratic, every, 8) > 0.3


def test_an_amplitude_that_grows_with_the_motion_is_no_form() -> None:
    """Its factor goes from 0.5 to 1.5 with time: the signature, which grows too, must not pass for the reason."""
    every = np.ones(8000, dtype=bool)
    time = np.linspace(0.0, 1.0, 8000)[:, None]
    signature = (1.0 + time) * np.ones(2)
    assert amplitude_spread((time - 0.5) * signature, signature, every, 8) > 0.2


def test_samples_that_were_not_measured_make_no_signature_smaller() -> None:
    """Where half the samples lack, the factor is 1.4 times that elsewhere: no power of a signature of one size."""
    every, signature = np.ones(8000, dtype=bool), np.ones((8000, 2))
    is_gap = np.repeat([True, False, False, True, True, False, True, False], 1000)
    residual = np.where(is_gap, 0.4, 0.0)[:, None] * signature
    as_measured = residual.copy()
    as_measured[is_gap & (np.arange(8000) % 2 == 0)] = np.nan
    assert amplitude_spread(as_measured, signature, every, 8) > 0.8 * amplitude_spread(residual, signature, every, 8)


def test_an_amplitude_that_depends_on_size_by_more_than_a_power_of_zero_or_two_is_no_form() -> None:
    every = np.ones(8000, dtype=bool)
    signature = np.repeat([1.0, 1.1, 1.04, 1.07, 1.09, 1.01, 1.03, 1.06], 1000)[:, None] * np.ones(2)
    assert amplitude_spread(signature**5 - signature, signature, every, 8) > 0.08
    assert amplitude_spread(signature**2 - signature, signature, every, 8) < 0.01


def test_what_was_not_measured_or_does_not_count_tells_nothing_of_the_amplitude() -> None:
    signature, rows = np.ones((800, 2)), np.arange(800) >= 100
    residual = np.where(rows[:, None], 0.0, 9.0) * signature
    residual[:, 1] = np.nan
    assert amplitude_spread(residual, signature, rows, 8) == 0.0


def test_a_ropes_friction_stiffer_than_the_rope_does_not_raise_the_floor_of_noise() -> None:
    """By its linearisation the sensors' noise would pass for any error."""
    friction = EffectSetting("hysteresis", {"force": 1.0, "yield_strain": 2e-7}, ROBOT.cable_numbers)
    stiff = ROBOT.with_effect(friction)
    floors = [sensor_noise_floor(FITTER, robot, SPLIT.validation).by_output for robot in (ROBOT, stiff)]
    assert np.array_equal(*floors)
    assert noise_floor(FITTER, stiff, SPLIT.validation).by_output.max() > 10.0 * floors[0].max()


def test_the_error_that_remains_is_told_beside_what_noise_leaves() -> None:
    recording = SPLIT.validation.recording
    swinging = 12.0 * np.sqrt(2.0) * np.sin(2.0 * np.pi * 1.5 * recording.time)
    motion = cosimulate_data_set(LOADED, SPLIT.validation)
    recording = replace(
        recording, position=motion.position, tension=motion.tension + swinging[:, None] * [0.0, 1.0, 0.0]
    )
    floor = Errors(1e-4, 3.0, np.full(3, 1e-4), np.full(3, 3.0))
    sentence = remaining_error(recording, motion, floor).sentence
    assert sentence == "12.0 N in tension_2, where noise leaves 3.0 N; it is strongest at 1.5 Hz"


def test_the_effect_that_is_there_leaves_little_of_what_the_robot_without_it_misses() -> None:
    context = IdentificationContext(ROBOT, FITTER, SPLIT)
    floor = noise_floor(FITTER, LOADED, SPLIT.validation)
    missed = missed_without_effects(context, FITTER, SPLIT.validation, floor)
    left = missed_with_effects(FITTER, LOADED, SPLIT.validation, floor)
    assert missed > 50.0
    assert left < 0.02 * missed


@pytest.mark.validate
def test_effects_that_cancel_change_less_together_than_each_alone() -> None:
    loaded = [Hypothesis(BY_NAME["payload"], ())]
    assert sizes_of(LOADED, loaded)[0] == pytest.approx(sizes_of(LOADED, loaded)[1])
    # About what the load adds to the tensions of inclined ropes.
    force = -2.0 * 12.0 * ROBOT.gravity / ROBOT.cable_count
    values = BY_NAME["sensor_offset"].completed_values({"tension_offset": force})
    cancelled = LOADED.with_effect(EffectSetting("sensor_offset", values, ROBOT.cable_numbers))
    offsets = Hypothesis(BY_NAME["sensor_offset"], ROBOT.cable_numbers, ("tension_offset",))
    payload, offset, together = sizes_of(cancelled, [*loaded, offsets])
    assert together < 0.7 * min(payload, offset)


def sizes_of(robot: Robot, accepted: list[Hypothesis]) -> tuple[float, ...]:
    """What each effect of a robot changes, then all together."""
    data, fit = SPLIT.validation, Fit.without_parameters(robot)
    run = simulated_outputs(FITTER, with_initial_state(FITTER, robot, data), data)
    errors = noise_floor(FITTER, robot, data)
    after = Comparison("check", data.recording, run, run, errors, errors)
    shares = explained_shares(IdentificationContext(ROBOT, FITTER, SPLIT), FITTER, fit, accepted, data, after)
    return *shares.sizes, shares.size_together


@pytest.mark.parametrize("cables", [(1, 2, 3), (2,)])
def test_without_an_effect_the_robot_has_what_its_file_declares(cables: tuple[int, ...]) -> None:
    declared = ROBOT.with_effect(EffectSetting("friction", {"coefficient": 0.02}, (1, 2, 3)))
    payload = EffectSetting("payload", {"mass": 12.0})
    fitted = declared.with_effect(payload).with_effect(EffectSetting("friction", {"coefficient": 0.05}, cables))
    accepted = [Hypothesis(BY_NAME["payload"], ()), Hypothesis(BY_NAME["friction"], cables)]
    coefficients = {
        cable: setting.values["coefficient"]
        for setting in as_declared(fitted, "friction", accepted, declared).effects
        if setting.name == "friction"
        for cable in setting.cables
    }
    assert coefficients == {1: 0.02, 2: 0.02, 3: 0.02}
    assert as_declared(fitted, "payload", accepted, declared).effects == tuple(
        setting for setting in fitted.effects if setting.name != "payload"
    )
