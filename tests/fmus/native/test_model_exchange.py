"""Native FMUs in model exchange: a robot of them beside the rig, each effect beside Python, slack rope as an event."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tautwire.fmus.component_resources import cable_resources, platform_resource, winch_resource
from tautwire.fmus.native.native_archive import python_slave
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.schema import Robot
from tautwire_fmu.cable_slave import AppliedMotion, Cable
from tautwire_fmu.laws.mathematics import REAL
from tautwire_fmu.laws.winch_drive import DriveState
from tests.rig import simulate
from tests.support.effect_cases import CASES, UNLISTED_CASES, Case
from tests.support.effects import with_effects
from tests.support.model_exchange import AXES, Model, coupled_models, in_model_exchange
from tests.support.rig_robots import rig_of
from tests.support.rigid_robots import crane_robot
from tests.support.robots import LIMITED, example, paper_robot, with_winch
from tests.support.winches import SwayingWinches

Array = NDArray[np.float64]
Rates = Callable[[float, Array], Any]

# Beside Python, and beside an independent simulator: m, both integrated by DOP853.
SAME, RIG_ERROR = 1e-10, 1e-11
TIMES = np.linspace(0.0, 0.5, 6)


def position_beside_rig(robot: Robot, sizes: Sequence[float], times: Array, folder: Path) -> tuple[Array, Array]:
    """Positions by coupled FMUs and by the rig."""
    winches = SwayingWinches(sizes)
    with coupled_models(build_fmus(robot, folder, native=True), winches.speed) as models:
        shown = models.run(times)
    return shown, simulate(rig_of(robot), None, winches, times, rtol=1e-12, atol=1e-13).position


def test_a_point_mass_on_cables_moves_as_on_the_rig(tmp_path: Path) -> None:
    shown, expected = position_beside_rig(paper_robot(1e9), [0.03, 0.02, -0.02], TIMES, tmp_path)
    assert np.max(np.abs(shown - expected)) < RIG_ERROR
    assert np.max(np.abs(shown - shown[0])) > 0.01


def test_a_rigid_platform_on_cables_moves_as_on_the_rig(tmp_path: Path) -> None:
    sizes = 6e-3 * np.array([1.0, 0.5, -1.0, -0.5, 0.5, 1.0, -0.5, -1.0])
    shown, expected = position_beside_rig(crane_robot(), sizes.tolist(), np.linspace(0.0, 0.2, 3), tmp_path)
    assert np.max(np.abs(shown - expected)) < RIG_ERROR
    assert np.max(np.abs(shown - shown[0])) > 5e-5


def swaying_end(start: Sequence[float], time: float) -> AppliedMotion:
    """Motion of a cable's end about its start, and of its winch."""
    sizes, frequencies = np.array([0.004, -0.003, 0.005]), np.array([3.0, 5.0, 4.0])
    sine, cosine = np.sin(frequencies * time), np.cos(frequencies * time)
    return AppliedMotion(
        tuple(np.array(start) + sizes * sine),
        tuple(sizes * frequencies * cosine),
        tuple(-sizes * frequencies**2 * sine),
        0.02 * np.sin(2.5 * time),
        0.05 * np.cos(2.5 * time),
    )


def cable_inputs(motion: AppliedMotion) -> dict[str, float]:
    vectors = dict(zip(("position", "velocity", "acceleration"), motion[:3], strict=True))
    named = {
        f"{name}.{axis}": float(v) for name, vector in vectors.items() for axis, v in zip(AXES, vector, strict=True)
    }
    return {**named, "winch_speed": motion.winch_speed, "winch_acceleration": motion.winch_acceleration}


def platform_inputs(robot: Robot, time: float) -> dict[str, float]:
    """The weight, shared by the cables, and a swaying force."""
    share = robot.platform.mass * robot.gravity / robot.cable_count
    up = {f"force_{number}.z": share for number in robot.cable_numbers}
    return {**up, "external_force.x": 200.0 * np.sin(4.0 * time), "external_force_rate.x": 800.0 * np.cos(4.0 * time)}


def twin(kind: str, base: str, data: dict[str, Any]) -> Any:
    """The Python slave of a component."""
    slave: Any = python_slave(kind, base, {**data, "model_name": "twin", "guid": "", "version": ""})
    slave.started = True
    return slave


def set_twin(slave: Any, states: Array, inputs: dict[str, float]) -> None:
    references = {variable.name: index for index, variable in enumerate(slave.variables)}
    slave.set_real([references[name] for name in inputs], list(inputs.values()))
    slave.real[slave.states] = list(map(float, states))


def outputs_of(slave: Any) -> list[str]:
    """Names of the outputs of now."""
    names = [variable.name for variable in slave.variables if variable.causality == "output"]
    return [name for name in names if not name.startswith("middle_")]


def integrated(rates: Rates, start: Array, scales: Array, times: Array = TIMES, **options: Any) -> Array:
    """States by DOP853, (n, N); those of filters are a hundred-thousandth of their nominal value."""
    span = (times[0], times[-1])
    solution = solve_ivp(rates, span, start, "DOP853", times, rtol=1e-12, atol=1e-15 * scales, **options)
    return np.asarray(solution.y)


def differences(
    model: Model, slave: Any, rates: Rates, inputs: Callable[[float], dict[str, float]], left_out: Sequence[str] = ()
) -> tuple[float, float]:
    """Largest differences of states and outputs to those of Python, each by its largest value or one."""

    def model_rates(time: float, states: Array) -> Array:
        model.go_to(time, states)
        model.set(inputs(time))
        return model.rates()

    model.set(inputs(0.0))
    model.run()
    start, scales = model.states(), model.nominals()
    assert start == pytest.approx(slave.real[slave.states], rel=1e-13)
    states, expected_states = (integrated(each, start, scales) for each in (model_rates, rates))
    names = [name for name in outputs_of(slave) if name not in left_out]
    shown, expected = [], []
    for time, one, other in zip(TIMES, states.T, expected_states.T, strict=True):
        model_rates(float(time), one)
        set_twin(slave, other, inputs(float(time)))
        shown.append(model.get(*names))
        expected.append(slave.get_real([model.references[name] for name in names]))
    return largest(states.T, expected_states.T), largest(np.array(shown), np.array(expected))


def largest(shown: Array, expected: Array) -> float:
    return float(np.max(np.abs(shown - expected) / np.maximum(np.max(np.abs(expected), axis=0), 1.0)))


def cable_differences(robot: Robot, fmus: RobotFmus, number: int, left_out: Sequence[str] = ()) -> tuple[float, float]:
    data = cable_resources(robot)[number - 1]
    slave: Cable = twin("cable", "Cable", data)

    def motion(time: float) -> AppliedMotion:
        return swaying_end(data["start"], time)

    def rates(time: float, states: Array) -> list[float]:
        return slave._rates(list(states), slave._span(motion(time)), motion(time).winch_speed)

    with in_model_exchange(fmus.cables[number - 1]) as model:
        assert model.indicators()[0] == model.get("pull")[0]
        return differences(model, slave, rates, lambda time: cable_inputs(motion(time)), left_out)


def platform_differences(robot: Robot, fmus: RobotFmus, left_out: Sequence[str] = ()) -> tuple[float, float]:
    slave = twin("point_mass", "PointMass", platform_resource(robot))

    def rates(time: float, states: Array) -> list[float]:
        set_twin(slave, states, platform_inputs(robot, time))
        force, _ = slave._total_force(slave.real)
        place, velocity = tuple(states[:3]), tuple(states[3:])
        return [*velocity, *slave._acceleration(REAL, place, velocity, force, time)]

    with in_model_exchange(fmus.platform) as model:
        return differences(model, slave, rates, lambda time: platform_inputs(robot, time), left_out)


# What a delayed sensor shows follows from the past, which the twin has not.
LATE = ("tension", "tension_rate", *(f"measured_position.{axis}" for axis in AXES))


@pytest.mark.validate
def test_all_effects_together_are_those_of_python(tmp_path: Path) -> None:
    robot = with_effects(example("three"), *CASES)
    fmus = build_fmus(robot, tmp_path, native=True)
    assert max(cable_differences(robot, fmus, 3, LATE)) < SAME
    assert max(platform_differences(robot, fmus, LATE)) < SAME


@pytest.mark.validate
@pytest.mark.parametrize("case", (*CASES, *UNLISTED_CASES), ids=str)
def test_each_effect_is_that_of_python(case: Case, tmp_path: Path) -> None:
    robot = with_effects(example("three"), case)
    fmus = build_fmus(robot, tmp_path, native=True)
    left_out = LATE if any("delay" in name for name in case.law) else ()
    assert max(cable_differences(robot, fmus, (case.cables or (1,))[0], left_out)) < SAME
    assert max(platform_differences(robot, fmus, left_out)) < SAME


@pytest.mark.validate
def test_a_quaternion_that_drifts_from_length_one_turns_the_same(tmp_path: Path) -> None:
    with in_model_exchange(build_fmus(crane_robot(), tmp_path, native=True).platform) as model:
        model.run()
        turned = model.states() + np.array([0.0, 0.1, -0.2, 0.05, *[0.0] * 9])
        turned[:4] /= np.linalg.norm(turned[:4])
        drifted = turned * np.array([*[1.01] * 4, *[1.0] * 9])
        names = [f"{name}_3.{axis}" for name in ("position", "velocity", "acceleration") for axis in AXES]
        shown, rates = [], []
        for states in (turned, drifted):
            model.go_to(0.1, states)
            shown.append(model.get(*names))
            rates.append(model.rates())
        assert shown[0] == pytest.approx(shown[1], abs=1e-12)
        assert rates[0][4:] == pytest.approx(rates[1][4:], abs=1e-9)
        assert 1.01 * rates[0][:4] == pytest.approx(rates[1][:4], abs=1e-12)


def test_a_winch_is_that_of_python(tmp_path: Path) -> None:
    robot = with_winch(paper_robot(), LIMITED)
    path = build_fmus(robot, tmp_path, native=True).winches[0]
    slave = twin("winch", "Winch", winch_resource(robot, 1))

    def inputs(time: float) -> dict[str, float]:
        return {"speed_command": 0.1 * np.sin(9.0 * time), "speed_command_rate": 0.9 * np.cos(9.0 * time)}

    def rates(time: float, states: Array) -> list[float]:
        return list(slave._rates(DriveState(*states), inputs(time)["speed_command"]))

    assert path is not None
    with in_model_exchange(path) as model:
        assert max(differences(model, slave, rates, inputs)) < SAME
