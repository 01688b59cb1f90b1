"""Invalid arguments of the library's other names raise errors with value, bound and hint."""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import control
import numpy as np
import pandas as pd
import pytest

import tautwire
from tautwire.control import ControlAim
from tautwire.errors import InputError, RecordingError
from tautwire.linear import LinearPlant
from tautwire.recordings.recording import Recording
from tautwire.robot.trajectory import Helix
from tests.support.refusals import refused
from tests.support.robots import EXAMPLES, example

THREE = EXAMPLES / "three"
ROBOT = example("three")
LINE = tautwire.Line((28.86, 0.0, 5.0), (28.86, 0.0, 6.0), 1.0)
TIME = np.arange(4) * 0.01
NAN = float("nan")


@cache
def fit() -> Recording:
    return tautwire.read_recording(THREE / "fit.csv", 3).first(40)


@cache
def plant() -> LinearPlant:
    return tautwire.linearise(ROBOT)


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
    refused(lambda: Helix((0.0, 0.0, 1.0), 1.0, 1.0, 0.0, 4.0), "Helix: angle", "must turn")
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


@dataclass(frozen=True)
class Own:
    """A path of a user's, which is and does the same at all times."""

    place: Any
    speed: Any
    duration: float = 1.0

    def position(self, times: Any) -> Any:
        return self.place

    def velocity(self, times: Any) -> Any:
        return self.speed

    def acceleration(self, times: Any) -> Any:
        return self.speed


HELD = np.full((4, 3), 5.0)


@pytest.mark.parametrize(
    ("path", "part", "words"),
    [
        (Own(HELD.T, HELD), "position", ("(3, 4)", "(4, 3)", "position(times)")),
        (Own(HELD[0], HELD), "position", ("(3,)", "(4, 3)")),
        (Own(HELD, HELD[:2]), "velocity", ("(2, 3)", "(4, 3)", "velocity(times)")),
        (Own(HELD, None), "velocity", ("shape ()", "(4, 3)")),
        (Own(HELD * NAN, HELD), "position", ("row 1, column 1 is nan",)),
    ],
)
def test_ideal_winch_speeds_refuse_a_path_of_the_users_that_is_none(
    path: Own, part: str, words: tuple[str, ...]
) -> None:
    refused(lambda: tautwire.ideal_winch_speeds(ROBOT, path, TIME), f"ideal_winch_speeds: trajectory.{part}", *words)
    assert tautwire.ideal_winch_speeds(ROBOT, Own(HELD, HELD), TIME).shape == (4, 3)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("robot", {}, ("a dict", "read_robot")),
        ("folder", 3, ("3", "pathlib.Path")),
        ("folder", THREE / "robot.toml", ("not a folder", "name a folder")),
        pytest.param("folder", "a" * 300, ("cannot be looked up",), id="long name"),
        pytest.param("folder", "\ud800", ("cannot be looked up",), id="lone surrogate"),
        ("progress", 1, ("not a function",)),
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
    many = "read_recording: cable_count"
    refused(lambda: tautwire.read_recording(THREE / "fit.csv", 10**9), many, "1000000000", "at most 100")


def test_a_frame_that_is_none_is_refused() -> None:
    frame = pd.read_csv(THREE / "fit.csv").iloc[:5]
    refused(lambda: tautwire.recording_from_frame(frame, 101), "recording_from_frame: cable_count", "at most 100")
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
        ({"progress": 1}, "progress", ("not a function",)),
    ],
)
def test_a_trace_refuses(changes: dict[str, Any], where: str, words: tuple[str, ...]) -> None:
    arguments: dict[str, Any] = {"robot": ROBOT, "fit": fit()} | changes
    refused(lambda: tautwire.trace(**arguments), f"trace: {where}", *words)


def test_signatures_show_nothing_of_the_inside() -> None:
    for name in tautwire.__all__:
        result = inspect.signature(getattr(tautwire, name))
        assert "<function" not in str(result) and "object at" not in str(result), name
    assert list(inspect.signature(tautwire.read_robot).parameters) == ["path"]


def test_writing_a_report_refuses(tmp_path: Path) -> None:
    refused(lambda: tautwire.write_report(ROBOT, tmp_path / "out"), "write_report: trace", "a Robot")  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []
