"""Load cells and trackers that are off zero, by more and by less than their robot file states."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tautwire.estimation import Trace, trace
from tautwire.estimation.declared_start import with_declared_start
from tautwire.estimation.estimation_data import split_data
from tautwire.estimation.hypotheses import Hypothesis
from tautwire.estimation.identification_context import IdentificationContext
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.estimation.parameter_fit import Fitter
from tautwire.estimation.selection_result import SelectionResult, nothing_selected
from tautwire.robot.schema import EffectSetting
from tautwire_fmu.laws.effects import BY_NAME
from tests.support.recordings import recorded
from tests.support.robots import example

ROBOT = example("three")
CELL = {"sensor_offset": {"force": 20.0, "cables": [2]}}
TRACKER = {"sensor_offset": {"place": [0.0, 0.0, 0.01]}}
PULLEY = Hypothesis(BY_NAME["pulley"], ROBOT.cable_numbers)


def context_of(hidden: dict[str, Any]) -> IdentificationContext:
    fit, check = (recorded("three", seed, hidden) for seed in (3, 53))
    noise = estimate_noise(ROBOT, fit)
    return IdentificationContext(ROBOT, Fitter(noise), split_data(ROBOT, noise, fit, check))


def pulley_selected(context: IdentificationContext) -> SelectionResult:
    start = ROBOT.with_effect(PULLEY.setting(ROBOT))
    fit = context.fitter.fit_from([start], [PULLEY], context.split.estimation)
    return SelectionResult((PULLEY,), (100.0,), fit, (), ())


def traced(hidden: dict[str, Any], **uncertainties: float) -> Trace:
    robot = replace(ROBOT, sensors=replace(ROBOT.sensors, **uncertainties))
    return trace(robot, recorded("three", 3, hidden), recorded("three", 53, hidden), lambda what, done: None)


@pytest.mark.validate
def test_the_true_model_of_a_tracker_off_zero_leaves_noise_from_a_measured_start() -> None:
    context = context_of(TRACKER)
    assert context.split.estimation.start != ROBOT.platform.start
    true = ROBOT.with_effect(EffectSetting("sensor_offset", {"position_offset_z": 0.01}, (1, 2, 3)))
    data = context.split.estimation
    assert np.all(np.abs(context.fitter.innovations(true, data).mean_square(data.rows) - 1.0) < 0.15)


def test_a_tracker_off_zero_takes_the_place_of_a_pulley_for_a_start_elsewhere() -> None:
    context = context_of(TRACKER)
    declared, found = with_declared_start(context, pulley_selected(context))
    assert [(h.effect.name, h.cables) for h in found.accepted] == [("sensor_offset", (1, 2, 3))]
    assert found.fit.values == pytest.approx([0.0, 0.0, 0.01], abs=5e-4)
    assert found.evidence[0] > 100.0
    assert found.confusable == (("sensor_offset", "pulley"),)
    assert declared.split.validation.start == ROBOT.platform.start


@pytest.mark.validate
def test_a_pulley_keeps_its_name_where_a_run_starts_elsewhere() -> None:
    hidden = {"pulley": {"radius": 0.005}}
    context = context_of(hidden)
    x, y, z = ROBOT.platform.start
    # The file says another start, a hand's breadth away: geometry tells that the tracker is right.
    moved = replace(context, robot=replace(ROBOT, platform=replace(ROBOT.platform, start=(x, y, z - 0.1))))
    selection = pulley_selected(context)
    assert with_declared_start(context, selection) == (context, selection)
    assert with_declared_start(moved, selection) == (moved, selection)


@pytest.mark.validate
def test_where_nothing_is_missing_a_start_elsewhere_is_one() -> None:
    context = context_of({})
    x, y, z = ROBOT.platform.start
    data = (replace(d, start=(x, y, z + 1e-4)) for d in (context.split.estimation, context.split.validation))
    estimation, validation = data
    context = replace(context, split=replace(context.split, estimation=estimation, validation=validation))
    nothing = nothing_selected(ROBOT)
    assert with_declared_start(context, nothing) == (context, nothing)


@pytest.mark.validate
def test_an_offset_within_what_is_stated_is_none() -> None:
    for hidden, uncertainties in (
        (CELL, {"tension_offset_uncertainty": 10.0}),
        (TRACKER, {"position_offset_uncertainty": 5e-3}),
    ):
        assert traced(hidden, **uncertainties).verdict == "none"


@pytest.mark.validate
def test_an_offset_beyond_what_is_stated_is_named_alone() -> None:
    (effect,) = traced(CELL, tension_offset_uncertainty=2.0).effects
    assert (effect.name, effect.cables) == ("sensor_offset", (2,))
    estimate = effect.parameters["tension_offset"]
    assert estimate.value == pytest.approx(20.0, abs=0.3)
    assert estimate.low < 20.0 < estimate.high


@pytest.mark.validate
def test_a_tracker_off_zero_is_named_alone_and_its_fmus_confirm_it() -> None:
    found = traced(TRACKER)
    (effect,) = found.effects
    assert effect.name == "sensor_offset"
    assert effect.parameters["position_offset_z"].value == pytest.approx(0.01, abs=5e-4)
    assert found.comparisons[1].errors_after.position_rms < 1.2 * found.noise_floor.position_rms
    assert found.robot_after.platform.start == ROBOT.platform.start
