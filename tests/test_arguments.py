"""What the library's names refuse: arguments that no run can have are told with value, bound and mend."""

from __future__ import annotations

import inspect
import pickle
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import control
import numpy as np
import pandas as pd
import pytest

import tautwire
from tautwire.control import (
    ControlAim,
    Controller,
    Reference,
    build_controller_fmu,
    cosimulate_with_controller,
    rigid_reference,
    sample_times,
)
from tautwire.errors import ArgumentError, InputError, RecordingError, TautwireError
from tautwire.fmus.packaging import RobotFmus
from tautwire.linear import LinearPlant
from tautwire.recordings.recording import Recording
from tautwire.trajectory import Helix
from tests.robots import EXAMPLES, example

THREE = EXAMPLES / "three"
ROBOT = example("three")
LINE = tautwire.Line((28.86, 0.0, 5.0), (28.86, 0.0, 6.0), 1.0)
TIME = np.arange(4) * 0.01
SPEEDS = np.zeros((4, 3))
NAN = float("nan")


@cache
def fit() -> Recording:
    return tautwire.read_recording(THREE / "fit.csv", 3).first(40)


@cache
def plant() -> LinearPlant:
    return tautwire.linearise(ROBOT)


@cache
def controller() -> Controller:
    return tautwire.design_controller(ROBOT)


def refused(call: Callable[[], object], argument: str, *words: str) -> None:
    """Assert that a call names its argument, what is wrong with it, and what to give instead, in one line."""
    with pytest.raises(ArgumentError) as caught:
        call()
    error = caught.value
    assert error.where == argument
    assert error.problem and error.mend and "\n" not in str(error)
    assert not [word for word in words if word not in str(error)], str(error)


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
    ("progress", "loud", ("'loud'", "cannot be called")),
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
    ("push", np.zeros((2, 2)), ("(2, 2)", "(3, 3)", "in N")),
    ("push", np.full((3, 3), NAN), ("row 1, column 1 is nan",)),
    ("reference", LINE, ("a Line", "elastic_reference")),
]


@pytest.mark.parametrize(("name", "value", "words"), WRONG_LOOPS)
def test_a_closed_loop_refuses(three_fmus: RobotFmus, name: str, value: Any, words: tuple[str, ...]) -> None:
    good = {"fmus": three_fmus, "robot": ROBOT, "controller": controller(), "trajectory": LINE, "duration": 0.02}
    arguments: dict[str, Any] = good | {name: value}
    refused(lambda: tautwire.cosimulate_closed_loop(**arguments), f"cosimulate_closed_loop: {name}", *words)


def test_a_closed_loop_refuses_the_reference_of_another_duration(three_fmus: RobotFmus) -> None:
    reference: Reference = rigid_reference(ROBOT, LINE, sample_times(controller().aim.period, 0.05))

    def call() -> object:
        return tautwire.cosimulate_closed_loop(three_fmus, ROBOT, controller(), LINE, 0.02, reference=reference)

    refused(call, "cosimulate_closed_loop: reference.speeds", "(6, 3)", "(3, 3)")


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("fmus", [], ("a list", "build_fmus")),
        ("controller", "controller.fmu", ("no file is",)),
        ("time", [0.0, 0.0], ("must rise",)),
        ("step", 0.0, ("above 0 s",)),
        ("push", np.zeros((3, 3)), ("(3, 3)", "(4, 3)")),
    ],
)
def test_a_run_with_a_controllers_fmu_refuses(
    three_fmus: RobotFmus, name: str, value: Any, words: tuple[str, ...]
) -> None:
    # Any file will do: it is not opened before all else is checked.
    good = {"fmus": three_fmus, "controller": three_fmus.platform, "time": TIME}
    arguments: dict[str, Any] = good | {name: value}
    refused(lambda: cosimulate_with_controller(**arguments), f"cosimulate_with_controller: {name}", *words)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("robot", None, ("read_robot",)),
        ("controller", 3, ("design_controller",)),
        ("trajectory", 3, ("Line(start, end, duration)",)),
        ("duration", -1.0, ("above 0 s",)),
        ("folder", THREE / "robot.toml", ("no folder",)),
        ("reference", 3, ("elastic_reference",)),
    ],
)
def test_building_a_controller_refuses(tmp_path: Path, name: str, value: Any, words: tuple[str, ...]) -> None:
    good = {"robot": ROBOT, "controller": controller(), "trajectory": LINE, "duration": 0.02, "folder": tmp_path}
    arguments: dict[str, Any] = good | {name: value}
    refused(lambda: build_controller_fmu(**arguments), f"build_controller_fmu: {name}", *words)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "where", "words"),
    [
        (((1.0, 2.0), (1.0, 2.0, 3.0), 1.0), "Line: start", ("(2,)", "(3,)", "in m")),
        (((1.0, 2.0, NAN), (1.0, 2.0, 3.0), 1.0), "Line: start", ("entry 3 is nan",)),
        (((1.0, 2.0, 3.0), "up", 1.0), "Line: end", ("'up'",)),
        (((1.0, 2.0, 3.0), (1.0, 2.0, 4.0), 0.0), "Line: duration", ("above 0 s",)),
        (((1.0, 2.0, 3.0), (1.0, 2.0, 4.0), "4"), "Line: duration", ("'4'", "not a number")),
    ],
)
def test_a_line_refuses(arguments: tuple[Any, ...], where: str, words: tuple[str, ...]) -> None:
    refused(lambda: tautwire.Line(*arguments), where, *words)


def test_a_line_takes_arrays_as_points() -> None:
    assert tautwire.Line(np.array([28.86, 0.0, 5.0]), [28.86, 0, 6], 1) == LINE  # type: ignore[arg-type]


def test_a_helix_refuses_what_turns_nothing() -> None:
    refused(lambda: Helix((0.0, 0.0, 1.0), 1.0, 1.0, 0.0, 4.0), "Helix: angle", "no turn")
    refused(lambda: Helix((0.0, 0.0, 1.0), -1.0, 1.0, 1.0, 4.0), "Helix: radius", "at least 0 m")


def test_ideal_winch_speeds_refuse() -> None:
    def speeds(robot: Any = ROBOT, path: Any = LINE, times: Any = TIME) -> object:
        return tautwire.ideal_winch_speeds(robot, path, times)

    refused(lambda: speeds(robot=THREE), "ideal_winch_speeds: robot", "read_robot")
    refused(lambda: speeds(path=np.zeros((4, 3))), "ideal_winch_speeds: trajectory", "velocity")
    refused(lambda: speeds(times=0.5), "ideal_winch_speeds: times", "(N,)")
    refused(lambda: speeds(times=[0.0, NAN]), "ideal_winch_speeds: times", "entry 2 is nan")
    through = tautwire.Line(ROBOT.anchors[1], ROBOT.anchors[1], 1.0)
    refused(lambda: speeds(path=through), "ideal_winch_speeds: trajectory", "cable 2", "exit point")


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("robot", {}, ("a dict", "read_robot")),
        ("folder", 3, ("3", "pathlib.Path")),
        ("folder", THREE / "robot.toml", ("robot.toml", "no folder")),
        ("progress", 1, ("cannot be called",)),
    ],
)
def test_building_refuses(tmp_path: Path, name: str, value: Any, words: tuple[str, ...]) -> None:
    arguments: dict[str, Any] = {"robot": ROBOT, "folder": tmp_path / "out"} | {name: value}
    refused(lambda: tautwire.build_fmus(**arguments), f"build_fmus: {name}", *words)
    assert list(tmp_path.iterdir()) == []


def test_folders_and_files_may_be_named_by_texts(tmp_path: Path) -> None:
    robot = tautwire.read_robot(str(THREE / "robot.toml"))
    assert tautwire.build_fmus(robot, str(tmp_path / "out")).platform == tmp_path / "out" / "platform.fmu"
    assert tautwire.read_recording(str(THREE / "fit.csv"), 3).sample_count > 1000


def test_reading_refuses() -> None:
    refused(lambda: tautwire.read_robot(3), "read_robot: path", "not a path")  # type: ignore[arg-type]
    refused(lambda: tautwire.read_recording(None, 3), "read_recording: path", "None")  # type: ignore[arg-type]
    for count in (0, -1, 3.0, "3", True):
        refused(
            lambda count=count: tautwire.read_recording(THREE / "fit.csv", count),  # type: ignore[misc]
            "read_recording: cable_count",
            "the robot's cable_count",
        )


def test_a_frame_that_is_none_is_refused() -> None:
    frame = pd.read_csv(THREE / "fit.csv").iloc[:5]
    refused(lambda: tautwire.recording_from_frame(THREE, 3), "recording_from_frame: frame", "pandas")  # type: ignore[arg-type]
    refused(lambda: tautwire.recording_from_frame(frame, 0), "recording_from_frame: cable_count", "at least 1")
    refused(lambda: tautwire.recording_from_frame(frame, 3, 7), "recording_from_frame: name", "7")  # type: ignore[arg-type]
    for empty in (pd.DataFrame(), frame.iloc[:0]):
        with pytest.raises(RecordingError):
            tautwire.recording_from_frame(empty, 3)


def test_linearising_refuses() -> None:
    refused(lambda: tautwire.linearise(THREE), "linearise: robot", "read_robot")  # type: ignore[arg-type]
    refused(lambda: tautwire.linearise(ROBOT, "here"), "at", "'here'")  # type: ignore[arg-type]
    refused(lambda: tautwire.linearise(ROBOT, (1.0, 2.0)), "at", "(2,)", "three finite coordinates")
    refused(lambda: tautwire.linearise(ROBOT, swing=-0.1), "linearise: swing", "at least 0 m")


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("system", [], ("a list", "StateSpace", "linearise(robot).system")),
        ("source", ["winch_speed_1"], ("a list", "winch_speed_2")),
        ("targets", [], ("names no output", "position_x")),
        ("targets", [1], ("1", "position_x")),
        ("targets", None, ("None", "position_x")),
        ("frequencies", [], ("has 0 entries",)),
        ("frequencies", [0.0, 1.0], ("entry 1 is 0.0", "above 0")),
        ("frequencies", [2.0, 1.0], ("must rise",)),
        ("frequencies", [[1.0, 2.0]], ("(1, 2)",)),
    ],
)
def test_a_bode_figure_refuses(name: str, value: Any, words: tuple[str, ...]) -> None:
    good = {"system": plant().system, "source": "winch_speed_1", "targets": "position_x"}
    arguments: dict[str, Any] = good | {name: value}
    refused(lambda: tautwire.bode_figure(**arguments), f"bode_figure: {name}", *words)


def test_a_bode_figure_refuses_a_signal_that_is_unknown() -> None:
    with pytest.raises(InputError, match="no output 'position'; choose among position_x"):
        tautwire.bode_figure(plant().system, "winch_speed_1", "position")
    assert isinstance(plant().system, control.StateSpace)


@pytest.mark.parametrize(
    ("arguments", "where", "words"),
    [
        ((THREE, LINE), "robot", ("read_robot",)),
        ((ROBOT, None), "path", ("None", "Line(start, end, duration)")),
        ((ROBOT, "up"), "path", ("'up'",)),
        ((ROBOT, []), "path", ("shape (0,)", "(N, 3)")),
        ((ROBOT, np.zeros((4, 4))), "path", ("(4, 4)", "(N, 3)")),
        ((ROBOT, LINE, [1.0, 0.5]), "times", ("must rise",)),
        ((ROBOT, LINE, []), "times", ("has 0 entries",)),
        ((ROBOT, [[28.86, 0.0, 5.0]] * 3, [0.0, 1.0]), "times", ("(2,)", "(3,)")),
        ((ROBOT, LINE, None, 1), "points", ("at least 2",)),
        ((ROBOT, LINE, None, 2.5), "points", ("whole number",)),
    ],
)
def test_modes_along_refuses(arguments: tuple[Any, ...], where: str, words: tuple[str, ...]) -> None:
    refused(lambda: tautwire.modes_along(*arguments), f"modes_along: {where}", *words)


def test_a_figure_of_modes_refuses() -> None:
    for nothing in ({}, [], None):
        refused(lambda runs=nothing: tautwire.modes_along_figure(runs), "modes_along_figure: runs", "no run")  # type: ignore[misc]
    refused(lambda: tautwire.modes_along_figure({"a": LINE}), "modes_along_figure: runs['a']", "modes_along")  # type: ignore[dict-item]


def test_a_design_refuses() -> None:
    refused(lambda: tautwire.design_controller(THREE), "design_controller: robot", "read_robot")  # type: ignore[arg-type]
    refused(lambda: tautwire.design_controller(ROBOT, 0.01), "design_controller: aim", "ControlAim")  # type: ignore[arg-type]
    refused(lambda: tautwire.design_controller(ROBOT, at=(0.0, NAN, 1.0)), "at", "entry 2 is nan")


@pytest.mark.parametrize(
    ("changes", "where", "words"),
    [
        ({"period": 0.0}, "period", ("above 0 s",)),
        ({"integral_time": -1.0}, "integral_time", ("above 0 s",)),
        ({"position": np.inf}, "position", ("finite",)),
        ({"speed_limit": None}, "speed_limit", ("None", "in m/s")),
        ({"lowest_tension": 2000.0, "highest_tension": 1000.0}, "lowest_tension", ("2000", "1000")),
    ],
)
def test_an_aim_refuses(changes: dict[str, Any], where: str, words: tuple[str, ...]) -> None:
    refused(lambda: ControlAim(**changes), f"ControlAim: {where}", *words)


@pytest.mark.parametrize(
    ("changes", "where", "words"),
    [
        ({"robot": "three"}, "robot", ("read_robot",)),
        ({"fit": THREE / "fit.csv"}, "fit", ("read_recording",)),
        ({"check": "check.csv"}, "check", ("read_recording",)),
        ({"robot": example("eight")}, "fit", ("3 cables", "the robot has 8")),
        ({"alpha": 0.0}, "alpha", ("above 0",)),
        ({"alpha": 1.0}, "alpha", ("below 1",)),
        ({"processes": 0}, "processes", ("at least 1",)),
        ({"progress": 1}, "progress", ("cannot be called",)),
    ],
)
def test_a_trace_refuses(changes: dict[str, Any], where: str, words: tuple[str, ...]) -> None:
    arguments: dict[str, Any] = {"robot": ROBOT, "fit": fit()} | changes
    refused(lambda: tautwire.trace(**arguments), f"trace: {where}", *words)


def test_the_error_keeps_the_value_on_its_way_between_processes() -> None:
    error = ArgumentError("Line: duration", -1.0, "is -1.0, must be above 0 s", "give a time")
    again = pickle.loads(pickle.dumps(error))
    assert (again.value, str(again)) == (-1.0, str(error))
    assert isinstance(error, InputError) and isinstance(error, TautwireError)


def test_signatures_show_nothing_of_the_inside() -> None:
    for name in tautwire.__all__:
        found = inspect.signature(getattr(tautwire, name))
        assert "<function" not in str(found) and "object at" not in str(found), name
    assert list(inspect.signature(tautwire.read_robot).parameters) == ["path"]


def test_writing_a_report_refuses(tmp_path: Path) -> None:
    refused(lambda: tautwire.write_report(ROBOT, tmp_path / "out"), "write_report: trace", "a Robot")  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []
