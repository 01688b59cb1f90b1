"""The static start of rigid platforms as a function of parameters, against the statics of numbers."""

from __future__ import annotations

from dataclasses import replace

import casadi
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tautwire.robot.rigid_equilibrium import static_equilibrium
from tautwire.robot.schema import EffectSetting, Robot
from tautwire.robot.symbolic_model import FreeParameter, SymbolicModel, symbolic_model
from tautwire.robot.uncertain_parameters import uncertain_parameters
from tautwire_fmu.laws.effects import BY_NAME
from tests.support.rigid_robots import crane_robot, hung_beam, octahedral_robot, suspended_robot, underactuated_robot


def with_value(robot: Robot, effect: str, parameter: str, value: float) -> Robot:
    return robot.with_effect(EffectSetting(effect, BY_NAME[effect].completed_values({parameter: value})))


def model_of(robot: Robot, effect: str, parameter: str) -> SymbolicModel:
    """The model with the parameter free, compiled where it is neutral."""
    neutral = with_value(robot, effect, parameter, 0.0)
    return symbolic_model(
        neutral, [FreeParameter(len(neutral.effects) - 1, parameter)], (), robot.platform.start_orientation
    )


def start_of(model: SymbolicModel, value: float) -> tuple[np.ndarray, np.ndarray]:
    """Rotation vector of the start, and tensions there with the winches at rest."""
    rest = [model.start, np.zeros(model.inputs.numel())]
    spans = casadi.Function("spans", [model.states, model.inputs, model.parameters], [model.span_tensions])
    start = casadi.Function("start", [model.parameters], [model.start, spans(*rest, model.parameters)])
    state, tensions = start(value)
    return np.array(state).ravel()[3:6], np.array(tensions).ravel()


@pytest.mark.parametrize("value", [0.5, 20.0])
@pytest.mark.parametrize("robot", [crane_robot(), octahedral_robot()], ids=["eight cables", "six cables"])
def test_tensions_of_six_cables_and_more_follow_a_load_as_statics_has_it(robot: Robot, value: float) -> None:
    rotation, tensions = start_of(model_of(robot, "payload", "mass"), value)
    assert tensions == pytest.approx(static_equilibrium(with_value(robot, "payload", "mass", value)).tensions, rel=1e-9)
    assert rotation == pytest.approx(np.zeros(3), abs=1e-12)


@pytest.mark.parametrize(("value", "error"), [(0.0, 1e-10), (0.005, 1e-10), (0.02, 1e-6)])
@pytest.mark.parametrize("robot", [underactuated_robot(), suspended_robot(3)], ids=["four cables", "three cables"])
def test_orientation_and_tensions_of_few_cables_follow_a_shifted_mass(robot: Robot, value: float, error: float) -> None:
    equilibrium = static_equilibrium(with_value(robot, "centre_of_mass", "x", value))
    rotation, tensions = start_of(model_of(robot, "centre_of_mass", "x"), value)
    declared, turned = (
        Rotation.from_quat(np.roll(each, -1)) for each in (robot.platform.start_orientation, equilibrium.orientation)
    )
    assert rotation == pytest.approx((turned * declared.inv()).as_rotvec(), abs=error)
    assert tensions == pytest.approx(equilibrium.tensions, rel=10.0 * error)


def test_the_first_derivative_of_an_orientation_is_that_of_statics() -> None:
    robot, width = underactuated_robot(), 1e-4
    model = model_of(robot, "centre_of_mass", "x")
    slopes = casadi.Function("slopes", [model.parameters], [casadi.jacobian(model.start[3:6], model.parameters)])
    more, less = (
        Rotation.from_quat(np.roll(static_equilibrium(with_value(robot, "centre_of_mass", "x", at)).orientation, -1))
        for at in (width, -width)
    )
    expected = (more * less.inv()).as_rotvec() / (2.0 * width)
    assert np.array(slopes(0.0)).ravel() == pytest.approx(expected, rel=1e-3, abs=1e-3 * np.max(np.abs(expected)))


def surveyed(robot: Robot) -> Robot:
    """A robot whose geometry is known to a centimetre."""
    return replace(
        robot,
        cables=tuple(replace(cable, anchor_uncertainty=1e-2, attachment_uncertainty=1e-2) for cable in robot.cables),
    )


def balanced_beam() -> Robot:
    """Two cables that hold a platform level with its centre of mass: it turns freely about the line through both."""
    beam = hung_beam()
    return replace(beam, platform=replace(beam.platform, centre_of_mass=(0.0, 0.0, 0.1)))


@pytest.mark.parametrize(
    ("robot", "distance"),
    [
        (balanced_beam(), 0.0),
        (hung_beam(), 3.0),
        (suspended_robot(3), 3.0),
        (underactuated_robot(), 2.0),
        (surveyed(crane_robot()), 3.0),
    ],
    ids=["neutral axis", "two cables", "three cables", "four cables", "eight cables"],
)
def test_derivatives_of_the_static_start_are_differences_of_its_values_far_from_the_declared_numbers_too(
    robot: Robot, distance: float
) -> None:
    shifted = with_value(with_value(robot, "payload", "mass", 1.0), "centre_of_mass", "x", 0.0)
    free = [FreeParameter(len(shifted.effects) - 2, "mass")]
    free += [FreeParameter(len(shifted.effects) - 1, axis) for axis in "xyz"]
    uncertain = uncertain_parameters(shifted)
    model = symbolic_model(shifted, free, uncertain, robot.platform.start_orientation)
    others = casadi.vertcat(model.parameters, model.states[model.states.numel() - len(uncertain) :])
    results = [model.static_start.values, model.static_start.jacobian(others)]
    static_start, width = casadi.Function("static_start", [others], results), 1e-5
    shift, moved = 0.003 * distance * np.array([1.0, -1.0, 0.5]), np.random.default_rng(1).normal(size=len(uncertain))
    point = np.concatenate([[1.0 + 0.3 * distance], shift, distance * moved])
    slopes = np.array(static_start(point)[1])
    for number, step in enumerate(width * np.eye(len(point))):
        more, less = (np.array(static_start(point + sign * step)[0]).ravel() for sign in (1.0, -1.0))
        assert slopes[:, number] == pytest.approx((more - less) / (2.0 * width), rel=1e-5, abs=1e-5)
    assert np.linalg.matrix_rank(slopes) > 1


@pytest.mark.parametrize("robot", [surveyed(crane_robot()), surveyed(underactuated_robot())], ids=["eight", "four"])
def test_the_static_start_follows_uncertain_numbers_where_the_cables_hold_any_orientation(robot: Robot) -> None:
    model = symbolic_model(robot, [], uncertain_parameters(robot), robot.platform.start_orientation)
    constants = model.states[model.states.numel() - len(uncertain_parameters(robot)) :]
    follows = model.static_start.symbols.numel() > 0 and casadi.depends_on(model.static_start.values, constants)
    assert follows == (robot.cable_count == 8)
    assert not casadi.depends_on(model.start, constants)
