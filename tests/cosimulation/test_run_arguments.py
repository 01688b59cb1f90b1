"""What runs refuse: times, speeds, steps, controllers and paths that no co-simulation can have."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import tautwire
from tautwire.cli import run
from tautwire.control import (
    ClosedLoopOptions,
    Controller,
    Reference,
    RunOptions,
    build_controller_fmu,
    cosimulate_with_controller,
    rigid_reference,
    sample_times,
)
from tautwire.errors import ArgumentError
from tautwire.fmus.packaging import RobotFmus
from tests.support.refusals import refused
from tests.support.robots import EXAMPLES, example

THREE = EXAMPLES / "three"
ROBOT = example("three")
LINE = tautwire.Line((28.86, 0.0, 5.0), (28.86, 0.0, 6.0), 1.0)
TIME = np.arange(4) * 0.01
SPEEDS = np.zeros((4, 3))
NAN = float("nan")


@cache
def controller() -> Controller:
    return tautwire.design_controller(ROBOT)


WRONG_RUNS: list[tuple[str, Any, tuple[str, ...]]] = [
    ("time", [0.0, 0.02, 0.01, 0.03], ("entry 3", "0.01 after 0.02", "must rise")),
    ("time", [0.0, 0.01, 0.01, 0.02], ("entry 3", "must rise")),
    ("time", [0.0, NAN, 0.02, 0.03], ("entry 2 is nan", "finite")),
    ("time", [0.0], ("has 1 entries", "two or more")),
    ("time", [], ("has 0 entries", "two or more")),
    ("time", TIME[:, None], ("(4, 1)", "(N,)")),
    ("time", "now", ("'now'", "array of numbers")),
    ("time", None, ("shape ()", "(N,)")),
    ("time", [0, 10**400], ("a list", "array of numbers")),
    ("winch_speed", np.zeros((4, 4)), ("(4, 4)", "(4, 3)", "3 cables")),
    ("winch_speed", np.zeros((4, 2)), ("(4, 2)", "(4, 3)")),
    ("winch_speed", np.zeros(4), ("(4,)", "(4, 3)")),
    ("winch_speed", np.zeros((3, 3)), ("(3, 3)", "(4, 3)")),
    ("winch_speed", np.where(np.eye(4, 3), np.inf, 0.0), ("row 1, column 1 is inf", "finite")),
    ("winch_speed", np.zeros((4, 3), dtype=complex), ("array of numbers",)),
    ("winch_speed", [["a"] * 3] * 4, ("array of numbers",)),
    ("step", 0.0, ("0.0", "above 0 s")),
    ("step", -0.01, ("-0.01", "above 0 s")),
    ("step", NAN, ("nan", "finite")),
    ("step", "0.01", ("'0.01'", "not a number")),
    ("step", True, ("true", "not a number")),
    ("tolerance", -1e-6, ("-1e-06", "above 0 m")),
    ("tolerance", np.inf, ("inf", "finite")),
    ("patience", 0.0, ("0.0", "above 0 s")),
    ("progress", "loud", ("'loud'", "not a function")),
]


@pytest.mark.parametrize(("name", "value", "words"), WRONG_RUNS)
def test_a_run_refuses(three_fmus: RobotFmus, name: str, value: Any, words: tuple[str, ...]) -> None:
    arguments: dict[str, Any] = {"time": TIME, "winch_speed": SPEEDS} | {name: value}
    refused(lambda: tautwire.cosimulate(three_fmus, **arguments), f"cosimulate: {name}", *words)


def test_a_run_takes_lists_and_whole_numbers(three_fmus: RobotFmus) -> None:
    motion = tautwire.cosimulate(three_fmus, [0, 1], [[0, 0, 0]] * 2, step=np.int64(1), patience=None)
    assert motion.position.shape == (2, 3)


def test_a_run_has_no_bound_on_its_steps_where_the_longest_is_infinite(three_fmus: RobotFmus) -> None:
    motions = [tautwire.cosimulate(three_fmus, TIME, SPEEDS, step=step) for step in (np.inf, 0.01)]
    assert np.array_equal(*(motion.position for motion in motions))


def test_a_run_refuses_fmus_that_are_none_or_are_gone(three_fmus: RobotFmus, tmp_path: Path) -> None:
    gone = replace(three_fmus, platform=tmp_path / "platform.fmu")
    refused(lambda: tautwire.cosimulate([], TIME, SPEEDS), "cosimulate: fmus", "a list", "build_fmus")  # type: ignore[arg-type]
    refused(lambda: tautwire.cosimulate(gone, TIME, SPEEDS), "cosimulate: fmus", "platform.fmu is not there")


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(("step", value) for value in (0.0, NAN, -np.inf, 1e16)),
        *(("tolerance", value) for value in (0.0, NAN, np.inf)),
        *(("patience", value) for value in (0.0, NAN)),
    ],
)
def test_the_command_refuses_what_the_library_refuses(
    three_fmus: RobotFmus, tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, value: float
) -> None:
    arguments: dict[str, Any] = {"time": TIME, "winch_speed": SPEEDS, name: value}
    with pytest.raises(ArgumentError) as caught:
        tautwire.cosimulate(three_fmus, **arguments)
    asked = ["--speeds", str(THREE / "fit.csv"), "--out", str(tmp_path / "out.csv"), f"--{name}={value}"]
    assert run(["simulate", str(THREE / "robot.toml"), *asked]) == 2
    stderr = capsys.readouterr().err
    assert stderr.startswith(f"tautwire: --{name}: {caught.value.problem}; {caught.value.hint}; example: ")
    assert list(tmp_path.iterdir()) == []


WRONG_LOOPS: list[tuple[str, Any, tuple[str, ...]]] = [
    ("fmus", None, ("None", "build_fmus")),
    ("robot", "three", ("'three'", "read_robot")),
    ("controller", tautwire.Line, ("the class Line", "design_controller")),
    ("trajectory", [1.0, 2.0], ("a list", "Line(start, end, duration)")),
    ("duration", 0.0, ("above 0 s",)),
    ("duration", NAN, ("finite",)),
    ("step", 0.0, ("above 0 s",)),
    ("patience", -1.0, ("above 0 s",)),
    ("seed", -1, ("-1", "at least 0")),
    ("seed", 1.5, ("1.5", "whole number")),
    ("external_force", np.zeros((2, 2)), ("(2, 2)", "(3, 3)", "in N")),
    ("external_force", np.full((3, 3), NAN), ("row 1, column 1 is nan",)),
    ("reference", LINE, ("a Line", "elastic_reference")),
]


@pytest.mark.parametrize(("name", "value", "words"), WRONG_LOOPS)
def test_a_closed_loop_refuses(three_fmus: RobotFmus, name: str, value: Any, words: tuple[str, ...]) -> None:
    good = {"fmus": three_fmus, "robot": ROBOT, "controller": controller(), "trajectory": LINE, "duration": 0.02}
    arguments: dict[str, Any] = good | (
        {name: value} if name in good else {"options": ClosedLoopOptions(**{name: value})}
    )
    refused(lambda: tautwire.cosimulate_closed_loop(**arguments), f"cosimulate_closed_loop: {name}", *words)


def test_a_closed_loop_refuses_the_reference_of_another_duration(three_fmus: RobotFmus) -> None:
    reference: Reference = rigid_reference(ROBOT, LINE, sample_times(controller().aim.period, 0.05))

    def call() -> object:
        return tautwire.cosimulate_closed_loop(
            three_fmus, ROBOT, controller(), LINE, 0.02, ClosedLoopOptions(reference=reference)
        )

    refused(call, "cosimulate_closed_loop: reference.speeds", "(6, 3)", "(3, 3)")


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("fmus", [], ("a list", "build_fmus")),
        ("controller", "controller.fmu", ("there is no file",)),
        ("time", [0.0, 0.0], ("must rise",)),
        ("step", 0.0, ("above 0 s",)),
        ("external_force", np.zeros((3, 3)), ("(3, 3)", "(4, 3)")),
    ],
)
def test_a_run_with_a_controllers_fmu_refuses(
    three_fmus: RobotFmus, name: str, value: Any, words: tuple[str, ...]
) -> None:
    # Any file will do: it is not opened before all else is checked.
    good = {"fmus": three_fmus, "controller": three_fmus.platform, "time": TIME}
    arguments: dict[str, Any] = good | ({name: value} if name in good else {"options": RunOptions(**{name: value})})
    refused(lambda: cosimulate_with_controller(**arguments), f"cosimulate_with_controller: {name}", *words)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("robot", None, ("read_robot",)),
        ("controller", 3, ("design_controller",)),
        ("trajectory", 3, ("Line(start, end, duration)",)),
        ("duration", -1.0, ("above 0 s",)),
        ("folder", THREE / "robot.toml", ("not a folder",)),
        ("reference", 3, ("elastic_reference",)),
    ],
)
def test_building_a_controller_refuses(tmp_path: Path, name: str, value: Any, words: tuple[str, ...]) -> None:
    good = {"robot": ROBOT, "controller": controller(), "trajectory": LINE, "duration": 0.02, "folder": tmp_path}
    arguments: dict[str, Any] = good | {name: value}
    refused(lambda: build_controller_fmu(**arguments), f"build_controller_fmu: {name}", *words)
    assert list(tmp_path.iterdir()) == []
