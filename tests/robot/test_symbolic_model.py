"""The symbolic robot: the same equations, and a static start that follows its free parameters."""

import casadi
import numpy as np
import pytest

from tautwire.robot.schema import EffectSetting
from tautwire.robot.static_equilibrium import static_tensions
from tautwire.robot.symbolic_model import FreeParameter, symbolic_model
from tests.support.robots import NAMES, example


@pytest.mark.parametrize("name", NAMES)
def test_the_start_is_an_equilibrium(name: str) -> None:
    model = symbolic_model(example(name))
    rates = casadi.Function("rates", [model.states, model.inputs], [model.rates])
    start = casadi.Function("start", [], [model.start])()["o0"]
    assert np.max(np.abs(np.array(rates(start, 0.0)))) < 1e-10
    assert model.states.numel() == len(model.state_names)
    assert model.inputs.numel() == len(model.input_names)
    assert model.outputs.numel() == len(model.output_names)


@pytest.mark.parametrize("name", NAMES)
def test_start_tensions_follow_a_free_payload(name: str) -> None:
    robot = example(name).with_effect(EffectSetting("payload", {"mass": 1.0}))
    model = symbolic_model(robot, [FreeParameter(0, "mass")])
    shown = casadi.Function("shown", [model.states, model.inputs, model.parameters], [model.outputs])
    start = casadi.Function("start", [model.parameters], [model.start])
    tensions = np.array(shown(start(3.0), 0.0, 3.0)).ravel()[6 : 6 + robot.cable_count]
    heavier = example(name).with_effect(EffectSetting("payload", {"mass": 3.0}))
    assert tensions == pytest.approx(static_tensions(heavier), rel=1e-9)


def test_a_free_parameter_gives_the_numbers_of_a_fixed_one() -> None:
    robot = example("three").with_effect(EffectSetting("damping", {"damping": 1e9}, (1, 3)))
    free = symbolic_model(robot, [FreeParameter(0, "damping")])
    fixed = symbolic_model(robot)
    point = np.array(casadi.Function("start", [], [fixed.start])()["o0"]).ravel() + 0.01
    inputs = np.full(6, 0.1)
    symbols = [free.states, free.inputs, free.parameters]
    first = casadi.Function("first", symbols, [free.rates])(point, inputs, 1e9)
    second = casadi.Function("second", [fixed.states, fixed.inputs], [fixed.rates])(point, inputs)
    assert np.array_equal(np.array(first), np.array(second))
