"""Sensitivities to an absent effect against runs of the filter itself, moved a little."""

from dataclasses import replace

import numpy as np
import pytest
from casadi import DM, SX, vertcat

from tautwire.estimation.disturbance import OrnsteinUhlenbeck
from tautwire.estimation.effect_sensitivities import EffectSensitivities, _sensitivity_pattern
from tautwire.estimation.filter_linearisation import linearise_filter
from tautwire.estimation.kalman_filter import Noise
from tautwire.estimation.likelihood import Likelihood
from tautwire.estimation.measurement_noise import estimate_noise
from tautwire.robot.schema import PER_CABLE_COMPONENTS, EffectSetting, Robot
from tautwire.robot.symbolic_model import FreeParameter
from tautwire_fmu.laws.effects import BY_NAME
from tests.support.recordings import recorded
from tests.support.robots import example

ROBOT = example("three")
RECORDING = recorded("three", 1).first(600)
NOISE = estimate_noise(ROBOT, RECORDING)
LENGTHS = replace(NOISE, rope_lengths=(OrnsteinUhlenbeck(3e-4, 1.0),) * 3)
INTERVAL = float(RECORDING.time[1] - RECORDING.time[0])
EVERYWHERE = (1, 2, 3)
SURVEYED = replace(
    ROBOT,
    cables=tuple(
        replace(cable, anchor_uncertainty=3e-3, modulus_uncertainty=0.05 * cable.modulus) for cable in ROBOT.cables
    ),
)


def along(
    name: str, form: tuple[str, ...], trial: dict[str, float], noise: Noise = NOISE, declared: Robot = ROBOT
) -> np.ndarray:
    """Slopes of the innovations by an effect's parameters, cable by cable: (N, m, p)."""
    likelihood = Likelihood(declared, (), noise, INTERVAL)
    directions = EffectSensitivities(
        declared, BY_NAME[name], [(cable,) for cable in EVERYWHERE], [form], [trial], likelihood.model.state_names
    )
    slopes, parts = directions.start_sensitivities, []
    for run in linearise_filter(likelihood, [], RECORDING):
        by_rates, by_outputs = directions.of_rates_and_outputs(run)
        slopes, moved = run.propagate_sensitivities(slopes, run.integrated_forcing(by_rates), by_outputs)
        parts.append(moved[run.is_recorded])
    return np.concatenate(parts)


def exact(
    name: str, parameter: str, trial: dict[str, float], noise: Noise = NOISE, declared_robot: Robot = ROBOT
) -> np.ndarray:
    """The same for one parameter on all cables, by the filter's own sensitivities."""
    effect = BY_NAME[name]
    declared = {p.name: 0.0 for p in effect.parameters if p.neutral is None}
    cables = EVERYWHERE if effect.component in PER_CABLE_COMPONENTS else ()
    robot = declared_robot.with_effect(EffectSetting(name, effect.completed_values({**declared, **trial}), cables))
    values = [robot.effects[0].values[parameter]]
    if effect.parameters[0].neutral is None:
        values = [float(getattr(ROBOT.cables[0], parameter))]
    return (
        Likelihood(robot, [FreeParameter(0, parameter)], noise, INTERVAL).innovations(RECORDING, values).sensitivities
    )


@pytest.mark.parametrize(
    ("name", "parameter", "trial"),
    [("payload", "mass", {}), ("drag", "drag_area", {}), ("creep", "compliance", {"time": 0.3})],
)
def test_slopes_are_those_of_the_filter_itself_beside_uncertain_anchors(
    name: str, parameter: str, trial: dict[str, float]
) -> None:
    """The filter moves the anchors on the way, and with them the static start."""
    slopes = np.sum(along(name, (parameter,), trial, declared=SURVEYED), axis=2)
    expected = exact(name, parameter, trial, declared_robot=SURVEYED)[:, :, 0]
    assert np.max(np.abs(slopes - expected)) < 2e-3 * np.max(np.abs(expected))


@pytest.mark.parametrize(
    ("name", "parameter", "trial"),
    [
        ("damping", "damping", {}),
        ("modulus", "modulus", {}),
        ("relaxation", "modulus", {"time": 0.3}),
        ("creep", "compliance", {"time": 10.0}),
        ("thermal", "rise", {"time": 5.0}),
        ("drum", "eccentricity", {"phase": 0.0, "radius": 0.2}),
        ("payload", "mass", {}),
        ("drag", "drag_area", {}),
        ("pulley", "radius", {}),
        ("sensor_gain", "tension_gain", {}),
        ("sensor_offset", "tension_offset", {}),
        ("sensor_delay", "tension_delay", {}),
    ],
)
def test_slopes_of_an_absent_effect_are_those_of_the_filter_itself(
    name: str, parameter: str, trial: dict[str, float]
) -> None:
    expected = exact(name, parameter, trial)[:, :, 0]
    found = np.sum(along(name, (parameter, *trial), trial), axis=2)
    alike = np.sum(found * expected) / np.sqrt(np.sum(found**2) * np.sum(expected**2))
    assert alike > 0.999
    assert np.sum(found**2) == pytest.approx(np.sum(expected**2), rel=0.02)


@pytest.mark.parametrize(("name", "parameter"), [("payload", "mass"), ("sensor_gain", "tension_gain")])
def test_slopes_of_an_absent_effect_are_those_along_the_true_lengths(name: str, parameter: str) -> None:
    expected = exact(name, parameter, {}, LENGTHS)[:, :, 0]
    found = np.sum(along(name, (parameter,), {}, LENGTHS), axis=2)
    assert np.sum((found - expected) ** 2) < 1e-7 * np.sum(expected**2)


def test_states_are_sensitive_only_to_what_reaches_them() -> None:
    states, parameters = SX.sym("z", 3), SX.sym("p", 2)
    rates = vertcat(parameters[0] - states[0], states[0], -states[2])
    pattern = _sensitivity_pattern(rates, states, parameters)
    assert np.array_equal(np.array(DM(pattern, 1.0)), [[1.0, 0.0], [1.0, 0.0], [0.0, 0.0]])
