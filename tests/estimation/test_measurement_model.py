"""What sensors that lag show, against the model's own past."""

from collections.abc import Callable

import casadi
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tautwire.estimation.measurement_model import SensorInstant, delayed_outputs, measurement_model
from tautwire.robot.schema import EffectSetting
from tautwire.robot.symbolic_model import FreeParameter, SymbolicModel, symbolic_model
from tests.support.robots import example

DELAYS = {"tension_delay": 0.004, "position_delay": 0.003}
FREE = [FreeParameter(0, "tension_delay"), FreeParameter(1, "mass"), FreeParameter(2, "damping")]
THETA = np.array([DELAYS["tension_delay"], 2.0, 6e9])
STEP, SPEEDS, LATER = 0.01, np.array([0.02, -0.01, 0.03]), np.array([0.03, -0.02, 0.02])


def model_of(*cables: int) -> SymbolicModel:
    robot = example("three").with_effect(EffectSetting("sensor_delay", DELAYS, cables or (1, 2, 3)))
    robot = robot.with_effect(EffectSetting("payload", {"mass": 2.0}))
    return symbolic_model(robot.with_effect(EffectSetting("damping", {"damping": 6e9}, (1, 2, 3))), FREE)


def moving_state(model: SymbolicModel) -> np.ndarray:
    """Away from rest in every direction, the cables stretched by some newtons."""
    start = np.array(casadi.Function("start", [model.parameters], [model.start])(THETA)).ravel()
    start[3:6] = 0.05, -0.03, 0.04
    start[6:9] *= 1.0 + np.array([2e-6, -3e-6, 1e-6])
    return start


def rates_of(model: SymbolicModel) -> Callable[[float, np.ndarray], np.ndarray]:
    rates = casadi.Function("rates", [model.states, model.inputs, model.parameters], [model.rates])
    slope = (LATER - SPEEDS) / STEP
    return lambda time, state: np.array(rates(state, [*(SPEEDS + time * slope), 0, 0, 0], THETA)).ravel()


def past_of(model: SymbolicModel, state: np.ndarray, ago: float) -> np.ndarray:
    return solve_ivp(rates_of(model), (0.0, -ago), state, rtol=1e-11, atol=1e-13).y[:, -1]


def shown(model: SymbolicModel, state: np.ndarray) -> np.ndarray:
    outputs = casadi.vertcat(model.outputs[:3], model.outputs[6:9])
    slope = (LATER - SPEEDS) / STEP
    function = casadi.Function("outputs", [model.states, model.inputs, model.parameters], [outputs])

    def at(ago: float, past: np.ndarray) -> np.ndarray:
        return np.array(function(past, [*(SPEEDS - ago * slope), 0, 0, 0], THETA)).ravel()

    positions = at(DELAYS["position_delay"], past_of(model, state, DELAYS["position_delay"]))
    tensions = at(DELAYS["tension_delay"], past_of(model, state, DELAYS["tension_delay"]))
    return np.append(positions[:3], tensions[3:])


def sensed(model: SymbolicModel, state: np.ndarray, theta: np.ndarray = THETA, shift: float = 0.0) -> list[np.ndarray]:
    inputs = [*SPEEDS, 0.0, 0.0, 0.0]
    return [
        np.array(found)
        for found in measurement_model(model, 3)(state, inputs, theta, LATER, STEP, np.full(6, shift), [])
    ]


def test_a_sensor_that_lags_shows_the_past() -> None:
    model = model_of()
    state = moving_state(model)
    value, exact = sensed(model, state)[0].ravel(), shown(model, state)
    still = sensed(model, state, THETA * [0.0, 1.0, 1.0])[0].ravel()
    assert np.all(np.abs(value - exact)[3:] < 0.02 * np.abs(still - exact)[3:])
    assert value[:3] == pytest.approx(exact[:3], abs=1e-7)


def test_what_was_shown_later_is_of_a_state_less_far_back() -> None:
    model = model_of()
    state = moving_state(model)
    late = sensed(model, state, shift=0.004)[0].ravel()
    assert late[3:] == pytest.approx(sensed(model, state, THETA * [0.0, 1.0, 1.0])[0].ravel()[3:], rel=1e-12)


def test_sensors_without_lag_show_the_present() -> None:
    """Of three cells one lags."""
    model = model_of(2)
    state = moving_state(model)
    value, by_state, _ = sensed(model, state)
    still, still_by_state, _ = sensed(model, state, THETA * [0.0, 1.0, 1.0])
    assert np.array_equal(value[[3, 5]], still[[3, 5]])
    assert np.array_equal(by_state[[3, 5]], still_by_state[[3, 5]])
    assert abs(value[4, 0] - still[4, 0]) > 1.0


def test_slopes_are_those_of_what_is_shown() -> None:
    model = model_of()
    state = moving_state(model)
    _, by_state, by_parameters = sensed(model, state)
    for place, width in enumerate([1e-7] * 3 + [1e-5] * 3 + [1e-7] * 3):
        moved = np.zeros(9)
        moved[place] = width
        difference = (sensed(model, state + moved)[0] - sensed(model, state - moved)[0]).ravel() / (2.0 * width)
        assert np.max(np.abs(by_state[:, place] - difference)) < 2e-3 * np.max(np.abs(difference))
    for place, width in enumerate((1e-6, 0.1, 1e7)):
        moved = np.zeros(3)
        moved[place] = width
        more, less = (sensed(model, state, THETA + sign * moved)[0] for sign in (1.0, -1.0))
        difference = (more - less).ravel() / (2.0 * width)
        for kind in (slice(0, 3), slice(3, 6)):
            apart = np.max(np.abs(by_parameters[kind, place] - difference[kind]))
            assert apart <= 0.02 * np.max(np.abs(difference[kind]))


def test_the_expression_is_that_of_the_function() -> None:
    model = model_of()
    instant = SensorInstant.of(model)
    expression = delayed_outputs(model, 3, instant)
    function = casadi.Function("late", [model.states, model.inputs, model.parameters, *instant.symbols], [expression])
    state = moving_state(model)
    found = np.array(function(state, [*SPEEDS, 0, 0, 0], THETA, LATER, STEP, np.zeros(6), []))
    assert found == pytest.approx(sensed(model, state)[0], rel=1e-13)
