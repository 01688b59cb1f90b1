"""Controllers from elsewhere, in closed loop: the same trajectory as the LQG that they are made of."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire.control import (
    POSITION_NOISE,
    ClosedLoopOptions,
    ControlAim,
    ControllerError,
    Feedforward,
    build_controller_fmu,
    cosimulate_closed_loop,
    design_controller,
    elastic_reference,
    fmu_controller,
    function_controller,
    sample_times,
    speed_controller,
    state_space_controller,
)
from tautwire.control.controller_fmu import ControllerFmu, ControllerFmuError, Sample
from tautwire.control.design import measurement_noise
from tautwire.cosimulation.robot_cosimulation import CosimulationResult, RunError
from tautwire.errors import ArgumentError
from tautwire.fmus.component import Component, ComponentError
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.schema import Sensors
from tautwire.robot.trajectory import Line
from tests.support.pythonfmu_command import build_by_command
from tests.support.robots import example

Array = NDArray[np.float64]

ROBOT = example("three")
PATH = Line((28.86, 0.0, 5.0), (29.0, 0.2, 5.4), 0.8)
DURATION = 1.0
AIM = ControlAim(tare=False)
SPANS = np.array(ROBOT.anchors) - ROBOT.platform.start
DIRECTIONS = SPANS / np.linalg.norm(SPANS, axis=1, keepdims=True)
# m; the same arithmetic in another order rounds otherwise.
SAME = 1e-10
SLAVE = """
import json
from pathlib import Path

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Regulator(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        data = json.loads((Path(self.resources) / "matrices.json").read_text())
        self.A, self.B, self.C, self.D = (data[name] for name in "ABCD")
        self.state = [0.0] * len(self.A)
        tensions = [f"tension_{i}" for i in (1, 2, 3)]
        self.names = [f"position.{axis}" for axis in "xyz"] + tensions
        references = [f"reference_{name}" for name in self.names]
        self.feedforward = [f"reference_winch_speed_{i}" for i in (1, 2, 3)]
        self.values = dict.fromkeys(self.names + references + self.feedforward + data["extra"], 0.0)
        self.speeds = dict.fromkeys((f"Winch_Speed[{i}]" for i in (1, 2, 3)), 0.0)
        for causality, values in ((Fmi2Causality.input, self.values), (Fmi2Causality.output, self.speeds)):
            for name in values:
                self.port(name, causality, values)

    def port(self, name, causality, values):
        def put(value):
            values[name] = value

        variable = Real(name, causality=causality, getter=lambda: values[name], setter=put)
        self.register_variable(variable, nested=False)

    def do_step(self, current_time, step_size):
        seen = [self.values[name] - self.values["reference_" + name] for name in self.names]
        demand = [dot(c, self.state) + dot(d, seen) for c, d in zip(self.C, self.D)]
        self.state = [dot(a, self.state) + dot(b, seen) for a, b in zip(self.A, self.B)]
        for name, feedforward, each in zip(self.speeds, self.feedforward, demand):
            self.speeds[name] = self.values[feedforward] + each
        return True


def dot(row, values):
    return sum(a * b for a, b in zip(row, values))
"""


@pytest.fixture(scope="module")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    return build_fmus(ROBOT, tmp_path_factory.mktemp("three"), native=True)


def lqg() -> Any:
    """The LQG from deviations at a sample to the deviations of the speeds two samples later, which it can know."""
    system = speed_controller(design_controller(ROBOT, AIM).knots()[0].regulator)
    assert not np.any(system.C @ system.B)
    A, B, C = system.A, system.B, system.C
    return control.ss(A, B, C @ A @ A, C @ A @ B, system.dt, inputs=system.input_labels, outputs=system.output_labels)


@pytest.fixture(scope="module")
def native(fmus: RobotFmus) -> CosimulationResult:
    return closed_loop(fmus, design_controller(ROBOT, AIM))


def closed_loop(fmus: RobotFmus, controller: Any, **options: Any) -> CosimulationResult:
    return cosimulate_closed_loop(
        fmus, ROBOT, controller, PATH, DURATION, ClosedLoopOptions(**{"aim": AIM, "seed": 3, **options})
    )


def lqg_function() -> Callable[[float, Array], Array]:
    """The LQG as a function with a state of its own."""
    system, times = lqg(), sample_times(AIM.period, DURATION)
    reference = elastic_reference(ROBOT, PATH, times)
    states = [np.zeros(system.nstates)]

    def speeds(time: float, measured: Array) -> Array:
        k = round(time / AIM.period)
        seen = measured - reference.expected[k]
        demand = system.C @ states[0] + system.D @ seen
        states[0] = system.A @ states[0] + system.B @ seen
        result: Array = reference.speeds[min(k + 2, len(times) - 1)] + demand
        return result

    return speeds


def lqg_fmu(folder: Path, extra: tuple[str, ...] = (), script: str = SLAVE) -> Path:
    """The LQG as an FMU that a user may build with plain pythonfmu."""
    system, matrices = lqg(), folder / "matrices.json"
    data = {name: np.asarray(getattr(system, name)).tolist() for name in "ABCD"}
    (folder / "regulator.py").write_text(script, encoding="utf-8")
    matrices.write_text(json.dumps({**data, "extra": extra}), encoding="utf-8")
    return build_by_command(folder / "regulator.py", folder / "Regulator.fmu", matrices)


@pytest.mark.validate
def test_lqg_as_a_state_space_moves_as_it_does_natively(fmus: RobotFmus, native: CosimulationResult) -> None:
    by_name = lqg()
    by_order = control.ss(by_name.A, by_name.B, by_name.C, by_name.D, by_name.dt)
    shuffled = by_name[[2, 0, 1], [5, 3, 1, 4, 0, 2]]
    assert np.max(np.abs(native.position - native.position[0])) > 0.2
    for system in (by_name, by_order, shuffled):
        motion = closed_loop(fmus, system)
        assert np.max(np.abs(motion.position - native.position)) < SAME
    assert np.max(np.abs(closed_loop(fmus, 0.0 * by_order).position - native.position)) > 1e-4


def test_lqg_as_a_function_moves_as_it_does_natively(fmus: RobotFmus, native: CosimulationResult) -> None:
    motion = closed_loop(fmus, lqg_function())
    assert np.max(np.abs(motion.position - native.position)) < SAME


def test_lqg_as_an_fmu_of_its_user_moves_as_it_does_natively(
    fmus: RobotFmus, native: CosimulationResult, tmp_path: Path
) -> None:
    file = lqg_fmu(tmp_path)
    speeds_from: Any = fmu_controller(file, 3).speeds_from
    assert speeds_from.inputs["position.x"] == "position_x"
    assert speeds_from.outputs["Winch_Speed[2]"] == "winch_speed_2"
    # Twice: each run has an instance of its own. In a worker process as well.
    for patience in (None, 60.0):
        motion = closed_loop(fmus, file, patience=patience)
        assert np.max(np.abs(motion.position - native.position)) < SAME


def test_controller_fmu_of_ours_moves_as_its_design(fmus: RobotFmus, tmp_path: Path) -> None:
    design = design_controller(ROBOT, AIM)
    file = build_controller_fmu(ROBOT, design, PATH, DURATION, tmp_path)
    exact = closed_loop(fmus, design, seed=None)
    assert np.max(np.abs(closed_loop(fmus, str(file), seed=None).position - exact.position)) < SAME


def test_state_space_travels_in_a_controller_fmu(fmus: RobotFmus, native: CosimulationResult, tmp_path: Path) -> None:
    file = build_controller_fmu(ROBOT, state_space_controller(lqg(), 3, AIM), PATH, DURATION, tmp_path)
    assert np.max(np.abs(closed_loop(fmus, file).position - native.position)) < SAME


@pytest.mark.validate
def test_limits_of_the_winches_bound_a_function_as_they_bound_a_state_space(fmus: RobotFmus) -> None:
    aim = ControlAim(tare=False, speed_limit=0.2, acceleration_limit=0.3)
    by_matrices = closed_loop(fmus, lqg(), aim=aim)
    by_function = closed_loop(fmus, lqg_function(), aim=aim)
    assert np.max(np.abs(by_matrices.position - by_function.position)) < SAME
    assert np.max(np.abs(closed_loop(fmus, lqg()).position - by_matrices.position)) > 0.01
    assert np.max(np.abs(by_function.position - PATH.position(by_function.time))) > 0.01


@pytest.mark.parametrize("method", ["tustin", "zoh"])
def test_continuous_state_space_is_discretised_at_the_period(method: str, fmus: RobotFmus) -> None:
    position = ["position_x", "position_y", "position_z"]
    speeds = [f"winch_speed_{i}" for i in (1, 2, 3)]
    system = control.ss(-10.0 * np.eye(3), 10.0 * np.eye(3), -DIRECTIONS, 0.0, inputs=position, outputs=speeds)
    sampled = control.sample_system(system, 0.02, method=method)
    by_hand = control.ss(sampled.A, sampled.B, sampled.C, sampled.D, 0.02, inputs=position, outputs=speeds)
    aim = ControlAim(period=0.02, tare=False)
    motions = [closed_loop(fmus, each, aim=aim, discretisation=method) for each in (system, by_hand)]
    assert np.array_equal(*(motion.position for motion in motions))
    assert motions[0].time[1] == 0.02


def matrices(inputs: int = 6, outputs: int = 3, dt: Any = 0.01) -> Any:
    return control.ss([[0.5]], np.ones((1, inputs)), np.ones((outputs, 1)), 0.0, dt)


def labelled(inputs: list[str], outputs: list[str] | None = None) -> Any:
    names = outputs or [f"winch_speed_{i}" for i in (1, 2, 3)]
    return control.ss(matrices(len(inputs), len(names)), inputs=inputs, outputs=names)


@pytest.mark.parametrize(
    ("system", "words"),
    [
        (matrices(inputs=5), ("5 inputs, must have 6", "position_x")),
        (matrices(outputs=2), ("2 outputs, must have 3",)),
        (matrices(dt=None), ("dt is None", "dt=0")),
        (matrices(dt=True), ("dt is True", "sample period in s")),
        (labelled(["tension1"]), ("'tension1'", "'tension_1'")),
        (labelled(["tension_1"], ["winch_speed_2"]), ("no output winch_speed_1, winch_speed_3",)),
        (control.ss([[np.nan]], np.ones((1, 6)), np.ones((3, 1)), 0.0, 0.01), ("entries of A", "finite")),
        (control.ss([[200.0]], np.ones((1, 6)), np.ones((3, 1)), 0.0), ("200 1/s", "Tustin", "zoh")),
        (control.tf([1.0], [1.0, 1.0]), ("TransferFunction", "control.ss")),
        (control.frd([1.0, 1.0], [1.0, 2.0]), ("control.ss",)),
    ],
)
def test_state_spaces_that_do_not_fit_are_refused(fmus: RobotFmus, system: Any, words: tuple[str, ...]) -> None:
    with pytest.raises(ArgumentError) as caught:
        closed_loop(fmus, system)
    assert all(word in str(caught.value) for word in words), caught.value


@pytest.mark.validate(only=["60.0-<lambda>-words2"])
@pytest.mark.parametrize(
    ("speeds", "words"),
    [
        (lambda time, measured: [0.0, 0.0], ("(2,)", "(3,)")),
        (lambda time, measured: [0.0, float("nan"), 0.0], ("nan m/s for winch 2", "finite")),
        (lambda time, measured: "fast", ("'fast'", "3 numbers")),
        (lambda time, measured: 1 / (time < 0.05) * np.zeros(3), ("ZeroDivisionError", "at 0.05 s")),
    ],
)
@pytest.mark.parametrize("patience", [None, 60.0])
def test_functions_that_fail_say_when_and_leave_the_run_until_then(
    fmus: RobotFmus, speeds: Any, words: tuple[str, ...], patience: float | None
) -> None:
    with pytest.raises(RunError) as caught:
        closed_loop(fmus, speeds, patience=patience)
    assert all(word in str(caught.value) for word in words), caught.value
    assert "measured [28.8" in str(caught.value)
    cause = caught.value.cause
    assert isinstance(cause, ControllerError)
    whole = closed_loop(fmus, lambda time, measured: np.zeros(3))
    count = len(caught.value.result.time)
    # One sample of computing delay: the speeds of sample k are computed once sample k + 1 is recorded.
    assert count == round(cause.time / 0.01) + 2
    assert caught.value.result.position == pytest.approx(whole.position[:count], abs=1e-9)


def test_fmus_that_do_not_fit_are_refused(fmus: RobotFmus, tmp_path: Path) -> None:
    (tmp_path / "input").mkdir()
    (tmp_path / "output").mkdir()
    wrong_input = lqg_fmu(tmp_path / "input", extra=("positon_y",))
    wrong_output = lqg_fmu(tmp_path / "output", script=SLAVE.replace("Winch_Speed[{i}]", "speed_{i}"))
    with pytest.raises(
        ControllerFmuError, match="input positon_y is no signal of the robot; rename it, to 'position_y'"
    ):
        closed_loop(fmus, wrong_input)
    with pytest.raises(ControllerFmuError, match="no output winch_speed_1; rename 'speed_1'"):
        closed_loop(fmus, wrong_output)
    with pytest.raises(ArgumentError, match="there is no file"):
        closed_loop(fmus, tmp_path / "absent.fmu")


def test_a_controller_fmu_contains_no_function(tmp_path: Path) -> None:
    law = function_controller(lambda time, measured: np.zeros(3), 3)
    with pytest.raises(ArgumentError, match="is a function or an FMU, which no controller FMU contains"):
        build_controller_fmu(ROBOT, law, PATH, 1.0, tmp_path)
    assert not list(tmp_path.iterdir())


def test_an_fmu_matched_for_another_platform_is_refused(fmus: RobotFmus, tmp_path: Path) -> None:
    of_turning = fmu_controller(lqg_fmu(tmp_path), 3, is_rigid=True)
    with pytest.raises(ControllerFmuError, match=r"another platform; match it by fmu_controller\(path, 3, is_r"):
        closed_loop(fmus, of_turning)


def test_an_fmu_runs_at_the_period_that_it_states(tmp_path: Path) -> None:
    slow = Feedforward(3, ControlAim(period=0.02))
    ours = build_controller_fmu(ROBOT, slow, PATH, 1.0, tmp_path)
    assert fmu_controller(ours, 3).aim.period == 0.02
    assert fmu_controller(ours, 3, ControlAim(period=0.02)).aim.period == 0.02
    with pytest.raises(ControllerFmuError, match=r"samples every 0\.02 s, aim\.period is 0\.01 s"):
        fmu_controller(ours, 3, ControlAim(period=0.01))
    slow = Feedforward(3, ControlAim(period=1.0 / 120.0))
    file = build_controller_fmu(ROBOT, slow, PATH, 1.0, tmp_path)
    with pytest.raises(ControllerFmuError, match=r"give ControlAim\(period=0\.008333333333333333\)"):
        fmu_controller(file, 3, ControlAim(period=0.01))


def test_a_period_of_other_tools_is_a_parameter_like_others(tmp_path: Path) -> None:
    variable = 'Real("period", causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable)'
    lines = "\n        ".join(("self.period = 2.0", f"self.register_variable({variable})", "self.state = [0.0]"))
    file = lqg_fmu(
        tmp_path,
        script=SLAVE.replace("self.state = [0.0]", lines, 1).replace("Fmi2Slave,", "Fmi2Slave, Fmi2Variability,"),
    )
    assert fmu_controller(file, 3).aim.period == ControlAim().period
    assert fmu_controller(file, 3, ControlAim(period=0.02)).aim.period == 0.02


def leaving(time: float, measured: Array) -> Array:
    if time > 0.095:
        os._exit(3)
    return np.zeros(3)


def test_a_controller_that_ends_the_process_is_named_and_the_run_until_then_kept(fmus: RobotFmus) -> None:
    with pytest.raises(RunError, match=r"exit status 3 in the controller leaving at 0\.11 s: call it alone") as caught:
        closed_loop(fmus, leaving, patience=30.0)
    assert caught.value.result.time == pytest.approx(np.arange(12) * 0.01)


def test_a_sensor_that_is_declared_without_noise_has_none() -> None:
    sensors = Sensors(position_noise=0.0, tension_noise=2.0)
    robot = replace(ROBOT, sensors=sensors)
    assert measurement_noise(robot).tolist() == [0.0, 0.0, 0.0, 2.0, 2.0, 2.0]
    assert measurement_noise(robot, positive=True).tolist() == [POSITION_NOISE] * 3 + [2.0] * 3
    assert np.all(np.isfinite(design_controller(robot, AIM).knots()[0].regulator.A))


def test_an_fmu_whose_initialization_fails_is_freed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    controller = ControllerFmu(lqg_fmu(tmp_path), 3)
    closed: list[str] = []
    close = Component.close

    def fail(component: Component) -> None:
        raise ComponentError(component.name, "fmi2ExitInitializationMode", "error", 0.0, {}, ())

    def note(component: Component) -> None:
        closed.append(component.name)
        close(component)

    monkeypatch.setattr(Component, "run", fail)
    monkeypatch.setattr(Component, "close", note)
    with pytest.raises(ComponentError):
        controller.speeds(Sample(0.0, 0.01, [0.0] * 6, np.zeros(6), np.zeros(3)))
    assert closed == ["controller"]
