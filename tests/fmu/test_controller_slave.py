"""controller.fmu: the same numbers as the controller in our master, and good manners as an FMU."""

from __future__ import annotations

from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from numpy.typing import NDArray

from tautwire.control import (
    ClosedLoopOptions,
    ControlAim,
    Design,
    Feedforward,
    RunOptions,
    build_controller_fmu,
    cosimulate_closed_loop,
    cosimulate_with_controller,
    design_controller,
    design_robust,
    robot_with,
    sample_times,
    schedule_controller,
    schedule_robust,
    shape_along,
)
from tautwire.fmus.component import Component, ComponentError
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tautwire.robot.schema import Robot
from tautwire.robot.trajectory import Line, Trajectory
from tests.support.fmus import Hand, in_hand
from tests.support.robots import LIMITED, example, with_winch

Array = NDArray[np.float64]

PATHS: dict[str, Trajectory] = {
    "three": Line((28.86, 0.0, 5.0), (29.5, 0.7, 6.2), 2.0),
    "caroca": Line((1.0, 0.0, 1.0), (0.6, -0.2, 1.3), 2.0),
    "eight": Line((5.0, 4.0, 2.5), (5.7, 4.4, 2.9), 2.0),
}
DURATION = 2.5


@pytest.fixture(scope="module")
def three() -> Robot:
    return example("three")


@pytest.fixture(scope="module")
def three_example_fmus(three: Robot, tmp_path_factory: pytest.TempPathFactory) -> RobotFmus:
    return build_fmus(three, tmp_path_factory.mktemp("three"), native=True)


@pytest.fixture(scope="module")
def controller(three: Robot, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An LQG controller for a path of the three-cable robot."""
    folder = tmp_path_factory.mktemp("controller")
    return build_controller_fmu(three, design_controller(three), PATHS["three"], DURATION, folder)


def difference(
    robot: Robot,
    fmus: RobotFmus,
    design: Design,
    folder: Path,
    pushed: bool = False,
    moved: Trajectory | None = None,
) -> float:
    """Largest difference of position (m) between both ways to run a controller."""
    path = moved or PATHS[robot.name]
    times = sample_times(design.aim.period, DURATION)
    push = np.zeros((len(times), 3))
    push[30:, 2] = -0.05 * robot.platform.mass * robot.gravity
    force = push if pushed else None
    own = cosimulate_closed_loop(fmus, robot, design, path, DURATION, ClosedLoopOptions(external_force=force))
    fmu = build_controller_fmu(robot, design, path, DURATION, folder)
    other = cosimulate_with_controller(fmus, fmu, times, RunOptions(external_force=force))
    assert np.max(np.abs(own.position - own.position[0])) > 0.3
    assert other.tension == pytest.approx(own.tension, abs=1e-4)
    return float(np.max(np.abs(own.position - other.position)))


@pytest.mark.validate
@pytest.mark.parametrize("name", sorted(PATHS))
def test_lqg_gives_the_same_numbers_as_fmu(name: str, tmp_path: Path) -> None:
    robot = example(name)
    fmus = build_fmus(robot, tmp_path, native=True)
    assert difference(robot, fmus, design_controller(robot), tmp_path, pushed=True) < 1e-9


@pytest.mark.validate
def test_scheduled_and_pure_feedforward_do_so(three: Robot, three_example_fmus: RobotFmus, tmp_path: Path) -> None:
    scheduled = schedule_controller(three, PATHS["three"], points=4)
    assert difference(three, three_example_fmus, scheduled, tmp_path) < 1e-9
    assert difference(three, three_example_fmus, Feedforward(3), tmp_path) < 1e-9


@pytest.mark.validate
def test_shaped_path_does_so(three: Robot, three_example_fmus: RobotFmus, tmp_path: Path) -> None:
    path = shape_along(three, PATHS["three"], "EI")
    assert difference(three, three_example_fmus, Feedforward(3), tmp_path, moved=path) < 1e-9


@pytest.mark.validate
def test_robust_controllers_do_so(three: Robot, three_example_fmus: RobotFmus, tmp_path: Path) -> None:
    assert difference(three, three_example_fmus, design_robust(three), tmp_path, pushed=True) < 1e-9
    scheduled = schedule_robust(three, PATHS["three"], points=2)
    assert difference(three, three_example_fmus, scheduled, tmp_path, pushed=True) < 1e-9


@pytest.mark.validate
def test_limits_act_alike(three: Robot, three_example_fmus: RobotFmus, tmp_path: Path) -> None:
    aim = ControlAim(speed_limit=0.5, acceleration_limit=1.0, highest_tension=1750.0, lowest_tension=1450.0)
    assert difference(three, three_example_fmus, design_controller(three, aim), tmp_path) < 1e-9


@pytest.mark.validate
def test_payload_that_nobody_declared_is_tared_alike(three: Robot, tmp_path: Path) -> None:
    fmus = build_fmus(robot_with(three, 1.2e11, 0.8), tmp_path, native=True)
    assert difference(three, fmus, design_controller(three), tmp_path) < 1e-9


@pytest.mark.validate
def test_winches_are_asked_for_the_same_speeds(three: Robot, tmp_path: Path) -> None:
    robot = with_winch(three, LIMITED)
    assert difference(robot, build_fmus(robot, tmp_path, native=True), design_controller(robot), tmp_path) < 1e-9


@pytest.mark.validate
def test_macro_step_within_a_sample_does_not_matter(three_example_fmus: RobotFmus, controller: Path) -> None:
    times = sample_times(0.01, 1.5)
    whole = cosimulate_with_controller(three_example_fmus, controller, times)
    thirds = cosimulate_with_controller(three_example_fmus, controller, times, RunOptions(step=0.01 / 3))
    assert thirds.position == pytest.approx(whole.position, abs=1e-9)


def test_an_isolated_run_gives_the_same(three: Robot, three_example_fmus: RobotFmus, controller: Path) -> None:
    times = sample_times(0.01, 0.5)
    push = np.full((len(times), 3), 20.0)
    here = cosimulate_with_controller(three_example_fmus, controller, times, RunOptions(external_force=push))
    apart = cosimulate_with_controller(
        three_example_fmus, controller, times, RunOptions(external_force=push, patience=60.0)
    )
    assert np.array_equal(here.position, apart.position)
    design, path = design_controller(three), PATHS["three"]
    own = cosimulate_closed_loop(
        three_example_fmus, three, design, path, 0.5, ClosedLoopOptions(external_force=push, patience=60.0)
    )
    assert own.position == pytest.approx(here.position, abs=1e-9)


def test_description_is_valid_and_says_which_outputs_jump(controller: Path) -> None:
    assert validate_fmu(str(controller)) == []
    variables = {v.name: v for v in fmpy.read_model_description(str(controller)).modelVariables}
    for i in (1, 2, 3):
        assert variables[f"winch_speed_{i}"].variability == "continuous"
        assert variables[f"winch_acceleration_{i}"].variability == "discrete"
        assert variables[f"tension_{i}"].causality == "input"
    assert variables["limit.speed"].variability == "tunable"
    assert float(variables["period"].start) == 0.01


def test_default_step_is_the_sample_period(controller: Path) -> None:
    assert float(fmpy.read_model_description(str(controller)).defaultExperiment.stepSize) == 0.01


def walk(hand: Hand, step: float, count: int, seen: Array) -> Array:
    """Speeds and rates after each step, under deviations held over each sample of 10 ms."""
    rows, start = [], hand.get("position.x", "position.y", "position.z")
    for k in range(count):
        away = seen[int(k * step / 0.01 + 1e-6)]
        hand.set(**{f"position__{axis}": p + float(a) for axis, p, a in zip("xyz", start, away, strict=True)})
        hand.step(k * step, step)
        rows.append(hand.get(*(f"{name}_{i}" for name in ("winch_speed", "winch_acceleration") for i in (1, 2, 3))))
    return np.array(rows)


def test_speeds_ramp_and_rates_hold_within_a_sample(controller: Path) -> None:
    seen = 1e-3 * np.random.default_rng(2).standard_normal((20, 3))
    with in_hand(controller) as hand:
        hand.run()
        rows = walk(hand, 0.0025, 40, seen)
    speeds, rates = rows[:, :3], rows[:, 3:]
    assert np.diff(speeds, axis=0) / 0.0025 == pytest.approx(rates[:-1], abs=1e-9)
    jumps = np.any(np.diff(rates, axis=0) != 0.0, axis=1)
    assert np.flatnonzero(jumps).tolist() == list(range(2, 39, 4))


def test_steps_longer_than_a_sample_take_several(controller: Path) -> None:
    held = np.repeat(1e-3 * np.random.default_rng(2).standard_normal((4, 3)), 5, axis=0)
    ends = []
    for step, count in ((0.01, 20), (0.05, 4), (0.025, 8)):
        with in_hand(controller) as hand:
            hand.run()
            ends.append(walk(hand, step, count, held)[-1])
    assert ends[1] == pytest.approx(ends[0], rel=1e-9)
    # In steps of two and a half samples what is seen in the middle of one is late by a half.
    assert ends[2] == pytest.approx(ends[0], abs=0.2 * np.max(np.abs(ends[0])))


def test_state_can_be_saved_and_the_same_bits_come_again(controller: Path) -> None:
    seen = 1e-3 * np.random.default_rng(5).standard_normal((30, 3))
    with in_hand(controller) as hand:
        hand.run()
        walk(hand, 0.004, 8, seen)
        saved = hand.fmu.getFMUState()
        blob = hand.fmu.serializeFMUState(saved)
        first = walk(hand, 0.004, 10, seen)
        hand.fmu.setFMUState(hand.fmu.deserializeFMUState(blob))
        assert np.array_equal(walk(hand, 0.004, 10, seen), first)
        hand.fmu.freeFMUState(saved)


def test_another_period_is_refused(controller: Path) -> None:
    words = r"period is 0.02 s, it has to be at least 0.01 and at most 0.01 s"
    with Component("controller", controller) as component, pytest.raises(ComponentError, match=words):
        component.initialize(0.0, {"period": 0.02})


def test_tighter_limit_of_speed_may_be_set_while_it_runs(controller: Path) -> None:
    seen = np.full((200, 3), 0.05)
    with in_hand(controller) as hand:
        hand.run()
        free = walk(hand, 0.01, 20, seen)
        hand.set(limit__speed=0.05)
        held = walk(hand, 0.01, 20, seen)
    assert np.abs(free[-1, :3]).max() > 0.2
    assert np.abs(held[3:, :3]).max() == pytest.approx(0.05)
