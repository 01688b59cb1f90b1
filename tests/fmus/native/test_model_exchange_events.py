"""Slack rope as a state event of model exchange, and sensors that show late between completed integrator steps."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import DOP853, solve_ivp
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from tautwire.fmus.packaging import build_fmus
from tautwire.robot.schema import Robot
from tautwire.robot.static_equilibrium import static_tensions
from tests.rig import simulate
from tests.support.effect_cases import same
from tests.support.effects import with_effects
from tests.support.model_exchange import AXES, Model, coupled_models, in_model_exchange
from tests.support.rig_robots import rig_of
from tests.support.robots import example, paper_robot
from tests.support.winches import PayingOut

Array = NDArray[np.float64]

EVENT_ERROR = 1e-9  # s
SPEED = 3.0  # rad/s
RATE = 20.0  # rad/s
DELAY = 0.023  # s


def swinging_in(model: Model) -> Callable[[float, Array], Array]:
    """Rates of a cable whose end swings towards its exit point, to where it hangs slack; the winch reels in and out."""
    start, anchor = (np.array(model.get(*(f"{name}.{axis}" for axis in AXES))) for name in ("position", "anchor"))
    inward = 0.3 * (anchor - start) / np.linalg.norm(anchor - start)

    def rates(time: float, states: Array) -> Array:
        model.go_to(time, states)
        moved, speed = inward * (1.0 - np.cos(SPEED * time)), inward * SPEED * np.sin(SPEED * time)
        for name, vector in (("position", start + moved), ("velocity", speed)):
            model.set({f"{name}.{axis}": part for axis, part in zip(AXES, vector, strict=True)})
        model.set({"winch_speed": 0.05 * np.sin(time)})
        return model.rates()

    return rates


def law_pull(robot: Robot, time: float) -> float:
    """Pull of the first cable on that motion by the logarithmic law, integrated on its own."""
    cable = robot.cables[0]
    rigidity, tension = cable.modulus * cable.area, static_tensions(robot)[0]
    start = float(np.linalg.norm(np.array(cable.anchor) - robot.platform.start))

    def length(time: float) -> float:
        return start - 0.3 * (1.0 - np.cos(SPEED * time))

    def rate(time: float, logarithm: Array) -> list[float]:
        return [-0.05 * np.sin(time) / length(time)]

    (logarithm,) = solve_ivp(rate, (0.0, time), [np.log(start)], "DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    return float(rigidity * (np.log(length(time)) - logarithm) + tension)


@pytest.mark.parametrize("fmi", [2, 3])
def test_a_cable_of_given_motion_falls_slack_when_its_law_says(fmi: int, tmp_path: Path) -> None:
    robot = paper_robot()
    with in_model_exchange(build_fmus(robot, tmp_path, native=True, fmi=fmi).cables[0]) as model:
        rates = swinging_in(model)
        model.run()

        def indicator(time: float, states: Array) -> float:
            rates(time, states)
            return float(model.indicators()[0])

        assert indicator(0.0, model.states()) == pytest.approx(model.get("pull")[0])
        found = solve_ivp(rates, (0.0, 1.0), model.states(), "DOP853", rtol=1e-10, atol=1e-12, events=indicator)
        event = found.t_events[0][0]
        assert abs(event - brentq(lambda time: law_pull(robot, time), 1e-3, 1.0, xtol=1e-12)) < EVENT_ERROR
        rates(event + 1e-3, found.y_events[0][0])
        assert model.get("pull")[0] < 0.0 == model.get("tension")[0]


def test_a_robot_that_pays_out_falls_slack_when_the_rig_says(tmp_path: Path) -> None:
    robot, winches = paper_robot(1e9), PayingOut([0.0, 0.0, -1.5], 0.2)
    with coupled_models(build_fmus(robot, tmp_path, native=True), winches.speed) as models:
        cable = models.cables[2]
        for model in models.models:
            model.run()

        def indicator(time: float, states: Array) -> float:
            models.go_to(time, states)
            return float(cable.indicators()[0])

        found = solve_ivp(models.rates, (0.0, 1.0), models.states(), "DOP853", rtol=1e-11, atol=1e-12, events=indicator)
    event = found.t_events[0][0]

    def is_taut(time: float) -> float:
        taut = simulate(rig_of(robot), None, winches, [0.0, time], rtol=1e-12, atol=1e-13).pull[-1, 2] > 0.0
        return 1.0 if taut else -1.0

    assert abs(event - brentq(is_taut, event - 1e-4, event + 1e-4, xtol=1e-11)) < EVENT_ERROR


def stepped(model: Model, rates: Callable[[float, Array], Array], end: float, step: float) -> list[tuple[float, Array]]:
    """Instants and states at which an integrator of small steps completed them; the model is told of each."""
    solver = DOP853(rates, 0.0, model.states(), end, max_step=step, rtol=1e-10, atol=1e-12)
    passed = [(0.0, model.states())]
    while solver.status == "running":
        solver.step()
        rates(solver.t, solver.y)
        model.fmu.completedIntegratorStep()
        passed.append((solver.t, solver.y.copy()))
    return passed


def test_a_load_cell_that_lags_shows_what_one_without_lag_showed_before(tmp_path: Path) -> None:
    delayed, plain = (
        build_fmus(robot, tmp_path / name, native=True).cables[0]
        for name, robot in (
            ("delayed", with_effects(example("three"), same("sensor_delay", tension_delay=DELAY))),
            ("plain", example("three")),
        )
    )
    with in_model_exchange(delayed) as model, in_model_exchange(plain) as other:
        rates, other_rates = swaying(model), swaying(other)
        model.run()
        other.run()
        passed = stepped(model, rates, 0.2, 2e-3)
        # After a trial of the integrator, which is no completed step.
        rates(0.2003, passed[-1][1])
        for time in (0.2, 0.2017):
            rates(time, passed[-1][1])
            (shown,) = model.get("tension")
            states = CubicSpline([t for t, _ in passed], [s for _, s in passed])(time - DELAY)
            other_rates(time - DELAY, states)
            assert shown == pytest.approx(other.get("tension")[0], rel=1e-8)
            assert abs(shown - model.get("pull")[0]) > 1.0


def swaying(model: Model) -> Callable[[float, Array], Array]:
    """Rates of a taut cable whose end swings, with all rates of its inputs."""
    start = np.array(model.get(*(f"position.{axis}" for axis in AXES)))

    def rates(time: float, states: Array) -> Array:
        model.go_to(time, states)
        size = np.array([0.004, -0.003, 0.005])
        for name, value in (
            ("position", start + size * np.sin(RATE * time)),
            ("velocity", RATE * size * np.cos(RATE * time)),
            ("acceleration", -(RATE**2) * size * np.sin(RATE * time)),
        ):
            model.set({f"{name}.{axis}": part for axis, part in zip(AXES, value, strict=True)})
        return model.rates()

    return rates


@pytest.mark.validate
def test_a_position_that_lags_is_that_of_before_with_its_gain(tmp_path: Path) -> None:
    robot = with_effects(
        example("three"), same("sensor_delay", position_delay=DELAY), same("sensor_gain", position_gain=1.5)
    )
    with in_model_exchange(build_fmus(robot, tmp_path, native=True).platform) as model:
        start = np.array(model.get(*(f"position.{axis}" for axis in AXES)))

        def rates(time: float, states: Array) -> Array:
            model.go_to(time, states)
            model.set({"external_force.x": 5e4 * np.sin(RATE * time)})
            return model.rates()

        model.run()
        measured = [f"measured_position.{axis}" for axis in AXES]
        assert model.get(*measured) == pytest.approx(1.5 * start)
        passed = stepped(model, rates, 0.1, 2e-3)
        times, places = np.array([t for t, _ in passed]), np.array([states[:3] for _, states in passed])
        expected = 1.5 * CubicSpline(times, places)(0.1 - DELAY)
        assert model.get(*measured) == pytest.approx(expected, abs=1e-8)
        assert np.abs(expected - 1.5 * places[-1]).max() > 1e-3
