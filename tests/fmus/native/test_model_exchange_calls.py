"""Model exchange as importers see it: descriptions, the order of calls, errors, and fmpy's own integrators."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import fmi2ModelExchange
from fmpy.model_description import ModelDescription
from fmpy.validation import validate_fmu

from tautwire.control import Feedforward, build_native_controller_fmu
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.schema import Formula
from tautwire.robot.trajectory import Line
from tests.support.effect_cases import CASES
from tests.support.effects import with_effects
from tests.support.fmus import in_hand
from tests.support.model_exchange import Model, in_model_exchange
from tests.support.rigid_robots import crane_robot
from tests.support.robots import LIMITED, example, paper_robot, with_winch

FMI_DISCARD, FMI_ERROR = 2, 3
ROBOTS = {
    "winches": with_winch(paper_robot(), LIMITED),
    "effects": with_effects(example("three"), *CASES),
    "rigid": crane_robot(),
}
PATH = Line((28.86, 0.0, 5.0), (29.5, 0.7, 6.2), 2.0)
CALLS = {
    2: ("newDiscreteStates", "getDerivatives"),
    3: ("updateDiscreteStates", "getContinuousStateDerivatives"),
}


def one_of_each(fmus: RobotFmus) -> list[Path]:
    return [fmus.cables[1], fmus.platform, *(path for path in fmus.winches[:1] if path is not None)]


@pytest.fixture(scope="module", params=[2, 3])
def fmi(request: pytest.FixtureRequest) -> int:
    return int(request.param)


@pytest.fixture(scope="module")
def plain_fmus(fmi: int, tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    return build_fmus(ROBOTS["winches"], tmp_path_factory.mktemp("plain"), native=True, fmi=fmi)


def described(description: ModelDescription, count: int) -> list[tuple[object, ...]]:
    return [
        (v.name, v.valueReference, v.causality, v.variability, v.initial, v.start, v.unit, v.min, v.max, v.nominal)
        for v in description.modelVariables[:count]
    ]


@pytest.mark.validate(but=["winches"])
@pytest.mark.parametrize("name", ROBOTS)
def test_new_variables_are_behind_those_of_python(name: str, tmp_path: Path) -> None:
    python, native = (
        build_fmus(ROBOTS[name], tmp_path / "python"),
        build_fmus(ROBOTS[name], tmp_path / "me", native=True),
    )
    for one, other in zip(one_of_each(python), one_of_each(native), strict=True):
        former, latter = (fmpy.read_model_description(str(path)) for path in (one, other))
        count = len(former.modelVariables)
        assert described(former, count) == described(latter, count)
        new = latter.modelVariables[count:]
        states = [unknown.variable.derivative for unknown in latter.derivatives]
        indicators = [f"event_indicator_{k + 1}" for k in range(latter.numberOfEventIndicators)]
        assert [v.name for v in new] == [*(f"der({state.name})" for state in states), *indicators]
        assert all(v.causality == "local" and v.variability == "continuous" for v in new)
        positions = [latter.modelVariables.index(state) for state in states]
        assert positions == list(range(positions[0], positions[0] + len(states)))
        assert {s.name for s in states} >= {v.name for v in former.modelVariables if v.description.startswith("state:")}


@pytest.mark.validate
@pytest.mark.parametrize("name", ROBOTS)
def test_nothing_is_wrong_in_either_version(name: str, tmp_path: Path) -> None:
    for version in (2, 3):
        fmus = build_fmus(ROBOTS[name], tmp_path / str(version), native=True, fmi=version)
        assert [validate_fmu(str(path)) for path in one_of_each(fmus)] == [[]] * len(one_of_each(fmus))


@pytest.mark.validate(but=["3"])
def test_outputs_depend_on_states_and_on_the_inputs_of_co_simulation(plain_fmus: RobotFmus, tmp_path: Path) -> None:
    only = build_fmus(ROBOTS["winches"], tmp_path, native=True, co_simulation_only=True)
    for one, other in zip(one_of_each(only), one_of_each(plain_fmus), strict=True):
        former, latter = (fmpy.read_model_description(str(path)) for path in (one, other))
        states = {unknown.variable.derivative.name for unknown in latter.derivatives}
        for before, after in zip(former.outputs, latter.outputs, strict=True):
            known, new = ({each.name for each in unknown.dependencies} for unknown in (before, after))
            assert new - known <= {*states, "time"} and new - states - {"time"} == known
            assert new & states or after.variable.name.startswith("middle_")


def test_by_fmi_3_outputs_that_are_no_states_depend_on_the_time(tmp_path: Path) -> None:
    """A formula with the time, or a sensor that lags, changes them while inputs and states stay."""
    outputs = fmpy.read_model_description(str(build_fmus(paper_robot(), tmp_path, native=True, fmi=3).platform)).outputs
    known = {output.variable.name: {each.name for each in output.dependencies} for output in outputs}
    assert "time" in known["acceleration.x"] and "time" not in known["position.x"]


@pytest.mark.validate
@pytest.mark.parametrize("version", [2, 3])
def test_co_simulation_alone_is_by_choice(version: int, tmp_path: Path) -> None:
    fmus = build_fmus(paper_robot(), tmp_path, native=True, fmi=version, co_simulation_only=True)
    both = build_fmus(paper_robot(), tmp_path / "both", native=True, fmi=version)
    for path, other in zip(fmus.paths, both.paths, strict=True):
        description, double = (fmpy.read_model_description(str(each)) for each in (path, other))
        assert description.modelExchange is None and not description.derivatives
        assert double.modelExchange is not None and double.coSimulation is not None
        assert not [v.name for v in description.modelVariables if v.name.startswith(("der(", "event_indicator"))]
        assert validate_fmu(str(path)) == []


def test_fmus_for_co_simulation_only_refuse_model_exchange(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = build_fmus(paper_robot(), tmp_path, native=True, co_simulation_only=True).platform
    with in_hand(path) as hand:
        guid, callbacks = hand.description.guid.encode(), ctypes.byref(hand.fmu.callbacks)
        assert hand.fmu.fmi2Instantiate(b"platform", fmi2ModelExchange, guid, b"", callbacks, 0, 1) is None
        assert not hasattr(hand.fmu.dll, "fmi2GetDerivatives")
    assert "this FMU is for co-simulation only" in capsys.readouterr().out


def test_controllers_are_for_co_simulation_only(tmp_path: Path) -> None:
    path = build_native_controller_fmu(example("three"), Feedforward(3), PATH, 2.5, tmp_path)
    assert fmpy.read_model_description(str(path)).modelExchange is None


def test_calls_are_allowed_in_their_states_only(plain_fmus: RobotFmus, fmi: int) -> None:
    for path in one_of_each(plain_fmus):
        with in_model_exchange(path) as model:
            update = getattr(model.fmu, CALLS[fmi][0])
            in_continuous_time: list[Callable[[], object]] = [
                model.fmu.enterEventMode,
                model.fmu.completedIntegratorStep,
                lambda model=model: model.fmu.setContinuousStates(None, model.state_count),
            ]
            in_events = [update, model.fmu.enterContinuousTimeMode]
            assert_refused(*in_continuous_time, *in_events, lambda model=model: model.fmu.setTime(0.0))
            model.rates()
            model.fmu.exitInitializationMode()
            assert_refused(*in_continuous_time, model.fmu.exitInitializationMode)
            update()
            model.fmu.enterContinuousTimeMode()
            assert_refused(*in_events)
            assert model.fmu.completedIntegratorStep() == (False, False)
            model.fmu.enterEventMode()
            model.fmu.terminate()
            assert_refused(*in_continuous_time, *in_events, model.fmu.terminate)


def assert_refused(*calls: Callable[[], object]) -> None:
    for call in calls:
        with pytest.raises(FMICallException) as caught:
            call()
        assert caught.value.status == FMI_ERROR


def test_other_numbers_of_states_are_refused(plain_fmus: RobotFmus) -> None:
    with in_model_exchange(plain_fmus.cables[0]) as model:
        model.run()
        for attribute in ("state_count", "indicator_count"):
            setattr(model, attribute, getattr(model, attribute) + 1)
            with pytest.raises(FMICallException):
                (model.rates if attribute == "state_count" else model.indicators)()
        with pytest.raises(FMICallException):
            model.go_to(0.1, np.zeros(3))


def test_a_rope_reeled_in_past_its_end_discards_and_can_go_on(
    plain_fmus: RobotFmus, capsys: pytest.CaptureFixture[str]
) -> None:
    with in_model_exchange(plain_fmus.cables[0]) as model:
        model.run()
        states, rates = model.states(), model.rates()
        model.go_to(0.1, np.array([-1.0, 0.0]))
        for call in (model.rates, model.indicators):
            with pytest.raises(FMICallException) as caught:
                call()
            assert caught.value.status == FMI_DISCARD
        assert np.isnan(model.get("tension", "der(unstrained_length)")).all()
        model.go_to(0.1, states)
        assert np.array_equal(model.rates(), rates)
        assert "the law has no value; inputs" in capsys.readouterr().out


def test_inputs_that_are_not_finite_are_errors(plain_fmus: RobotFmus) -> None:
    with in_model_exchange(plain_fmus.cables[0]) as model:
        model.run()
        model.set({"winch_speed": float("nan")})
        with pytest.raises(FMICallException) as caught:
            model.rates()
        assert caught.value.status == FMI_ERROR


def test_rates_and_indicators_are_variables_too(plain_fmus: RobotFmus) -> None:
    for path in one_of_each(plain_fmus):
        with in_model_exchange(path) as model:
            model.run()
            names = [f"der({name})" for name in model.state_names]
            indicators = [f"event_indicator_{k + 1}" for k in range(model.indicator_count)]
            assert model.get(*names, *indicators) == [*model.rates(), *model.indicators()]
            with pytest.raises(FMICallException):
                model.set({names[0]: 0.0})


def test_in_co_simulation_rates_are_those_of_the_states(tmp_path: Path) -> None:
    fmus, step = build_fmus(ROBOTS["winches"], tmp_path, native=True), 1e-4
    with in_hand(fmus.cables[0]) as cable, in_hand(fmus.platform) as platform:
        for hand, inputs, state in (
            (cable, {"winch_speed": 0.3, "winch_acceleration": 0.5}, "unstrained_length"),
            (platform, {"external_force__x": 300.0, "external_force_rate__x": 900.0}, "velocity.x"),
        ):
            hand.set(**inputs)
            hand.run()
            before, rate = hand.get(state, f"der({state})")
            hand.step(0.0, step)
            after, last = hand.get(state, f"der({state})")
            assert abs(rate) > 0.1 and rate != last
            assert (after - before) / step == pytest.approx(0.5 * (rate + last), rel=1e-6)


def test_saved_states_go_on_with_the_same_bits(plain_fmus: RobotFmus, fmi: int) -> None:
    read, write = ("getFMUstate", "setFMUstate") if fmi == 2 else ("getFMUState", "setFMUState")
    with in_model_exchange(plain_fmus.cables[0]) as model:
        model.run()
        saved, expected = getattr(model.fmu, read)(), model.rates()
        model.set({"winch_speed": 0.4})
        model.go_to(0.3, 0.99 * model.states())
        assert not np.array_equal(model.rates(), expected)
        model.fmu.enterEventMode()
        getattr(model.fmu, write)(saved)
        assert np.array_equal(model.rates(), expected)
        model.fmu.enterEventMode()


def test_nominals_alone_are_known_before_initialization(plain_fmus: RobotFmus) -> None:
    with in_model_exchange(plain_fmus.cables[0]) as model:
        expected = model.nominals()
        model.fmu.reset()
        assert np.array_equal(model.nominals(), expected)
        assert_refused(model.states, model.rates)


def test_a_state_of_initialization_is_initialized_again(plain_fmus: RobotFmus, fmi: int) -> None:
    read, write = ("getFMUstate", "setFMUstate") if fmi == 2 else ("getFMUState", "setFMUState")
    with in_model_exchange(plain_fmus.cables[0]) as model:
        saved, expected = getattr(model.fmu, read)(), model.states()
        model.run()
        model.go_to(0.3, 0.99 * model.states())
        getattr(model.fmu, write)(saved)
        model.run()
        assert np.array_equal(model.states(), expected)


@pytest.mark.validate(but=["3"])
def test_time_of_a_formula_counts_from_the_start(fmi: int, tmp_path: Path) -> None:
    robot = replace(paper_robot(), formulas=(Formula("force_x", "300*time"),))
    with in_model_exchange(build_fmus(robot, tmp_path, native=True, fmi=fmi).platform, 3.0) as model:
        model.run()
        rates = {time: model_rates(model, time) for time in (3.0, 5.0)}
    assert rates[3.0][3] == pytest.approx(0.0, abs=1e-12)
    assert rates[5.0][3] == pytest.approx(2.0, rel=1e-9)


def model_rates(model: Model, time: float) -> np.ndarray:
    model.go_to(time, model.states())
    return model.rates()


def cable_run(path: Path, solver: str | None, step: float) -> np.ndarray:
    """Tensions of a cable that its winch reels in for a second; without a solver by co-simulation."""
    me = {"fmi_type": "ModelExchange", "solver": solver} if solver else {}
    result = simulate_fmu(
        str(path),
        stop_time=1.0,
        step_size=step,
        output_interval=0.1,
        relative_tolerance=1e-9,
        start_values={"winch_speed": 0.01},
        output=["tension", "unstrained_length"],
        **me,
    )
    return np.array([list(row)[1:] for row in result])


def test_fmpy_integrates_a_cable(plain_fmus: RobotFmus) -> None:
    path = plain_fmus.cables[0]
    expected, by_cvode, by_euler = (cable_run(path, *each) for each in ((None, 1e-2), ("CVode", 1e-2), ("Euler", 1e-3)))
    assert expected[-1, 0] > expected[0, 0] + 100.0
    assert by_cvode == pytest.approx(expected, rel=1e-6)
    assert by_euler == pytest.approx(expected, rel=1e-3)


def test_limits_of_winches_are_events(plain_fmus: RobotFmus) -> None:
    path = plain_fmus.winches[0]
    assert path is not None
    with in_model_exchange(path) as winch:
        winch.set({"speed_command": 0.5})
        winch.run()
        assert list(winch.indicators()) == winch.get("command_margin", "acceleration_margin", "speed_margin")
        assert winch.rates()[0] == winch.get("winch_acceleration")[0] == LIMITED.acceleration_limit


def test_default_of_fmpy_is_co_simulation(plain_fmus: RobotFmus) -> None:
    result = simulate_fmu(str(plain_fmus.cables[0]), stop_time=0.1, output=["tension"])
    assert len(result) > 1


def test_model_exchange_ends_initialization_with_its_start(plain_fmus: RobotFmus) -> None:
    with in_model_exchange(plain_fmus.platform, 3.0) as model:
        assert_start(model)
        middle = model.get("middle_position.z")
        model.run()
        assert_start(model)
        model.go_to(4.0, model.states() + 0.1)
        assert model.get("middle_position.z") == middle != model.get("position.z")


def assert_start(model: Model) -> None:
    assert model.get("position.x", "position.z") == model.get("start.x", "start.z")
