"""Mistakes in a log or a tracker's file are told where no offset of the tracker's clock fits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tautwire.errors import RecordingError
from tautwire.recordings import tracker as tracker_module
from tautwire.recordings.alternative_readings import mistakes_text
from tautwire.recordings.consistency import recording_mistakes
from tautwire.recordings.mistaken_tracker import frame_mistakes, tracker_mistakes
from tautwire.recordings.recording import Recording, read_recording
from tautwire.robot.schema import RecordedColumn, Tracker
from tests.support.robots import EXAMPLES, example
from tests.support.told_columns import told_columns
from tests.support.trackers import split

Files = tuple[Recording, Recording]


def files(name: str) -> Files:
    """A log at the example's rate, and a tracker at 120 Hz, whose clock is 5.25 s ahead."""
    recording = read_recording(EXAMPLES / name / "fit.csv", example(name).cable_count)
    return split(recording, 120.0, 5.25, 1.0)


def winches(change: Callable[[np.ndarray], np.ndarray]) -> Callable[[Files], Files]:
    return lambda pair: (replace(pair[0], winch_speed=change(pair[0].winch_speed)), pair[1])


def tracked(length: float = 1.0, time: float = 1.0) -> Callable[[Files], Files]:
    return lambda pair: (pair[0], replace(pair[1], position=length * pair[1].position, time=time * pair[1].time))


def with_one_sign(speeds: np.ndarray) -> np.ndarray:
    return np.asarray(speeds * [1.0, -1.0, *[1.0] * (speeds.shape[1] - 2)])


def swapped(speeds: np.ndarray) -> np.ndarray:
    return speeds[:, [1, 0, *range(2, speeds.shape[1])]]


CASES: dict[str, tuple[Callable[[Files], Files], list[str]]] = {
    "tracker in mm": (tracked(length=1e3), ["its x, y, z are in mm"]),
    "tracker's time in ms": (tracked(time=1e3), ["its time is in ms"]),
    "log's time in ms": (lambda pair: (replace(pair[0], time=1e3 * pair[0].time), pair[1]), ["time is in ms"]),
    "speeds in mm/s": (winches(lambda speeds: 1e3 * speeds), ["are in mm/s"]),
    "all signs": (winches(lambda speeds: -speeds), ["have the other sign"]),
    "one sign": (winches(with_one_sign), ["winch_speed_2 has the other sign"]),
    "two winches swapped": (winches(swapped), ["are winch_speed_2, winch_speed_1"]),
    "mm and mm/s": (
        lambda pair: winches(lambda speeds: 1e3 * speeds)(tracked(length=1e3)(pair)),
        ["its x, y, z are in mm", "are in mm/s"],
    ),
}


@pytest.mark.validate(only=["eight-one sign", "eight-two winches swapped"])
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("name", ["three", "eight"])
def test_a_mistake_is_told_with_its_cause(name: str, case: str) -> None:
    change, causes = CASES[case]
    log, tracker = change(files(name))
    (mistakes,) = tracker_mistakes(example(name), log, tracker)
    assert len(mistakes) == len(causes)
    assert all(cause in mistake.cause for cause, mistake in zip(causes, mistakes, strict=True))


def test_a_wrong_motion_is_no_mistake_of_units() -> None:
    log, tracker = winches(lambda speeds: speeds[:, ::-1] ** 2)(files("three"))
    assert tracker_mistakes(example("three"), log, tracker) == ()


def test_the_error_names_the_column_and_the_table_that_mend_it(monkeypatch: pytest.MonkeyPatch) -> None:
    log, tracker = tracked(length=1e3)(files("three"))
    monkeypatch.setattr(tracker_module, "read_tracker", lambda *_: tracker)
    with pytest.raises(RecordingError, match="match the winch travel at no offset of its clock, but do if") as caught:
        tracker_module.with_tracker(example("three"), log, "tracker.csv")
    assert told_columns(caught.value.hint, "recording.tracker.columns") == {axis: {"unit": "mm"} for axis in "xyz"}
    assert caught.value.hint.endswith("which is to multiply its x, y, z by 0.001")


@pytest.mark.validate
def test_the_lines_of_log_and_tracker_are_in_tables_of_their_own(monkeypatch: pytest.MonkeyPatch) -> None:
    log, tracker = CASES["mm and mm/s"][0](files("three"))
    monkeypatch.setattr(tracker_module, "read_tracker", lambda *_: tracker)
    with pytest.raises(RecordingError) as caught:
        tracker_module.with_tracker(example("three"), log, "tracker.csv")
    assert told_columns(caught.value.hint, "recording.tracker.columns") == {axis: {"unit": "mm"} for axis in "xyz"}
    assert told_columns(caught.value.hint) == {"winch_speed_{}": {"unit": "mm/s"}}


@pytest.mark.validate
def test_axes_of_a_tracker_are_mended_in_its_table(tmp_path: Path) -> None:
    """Positions in mm by other names, x and y swapped, and a clock that is stated."""
    log, shown = files("three")
    columns = {"time": "T", "x": "Body Y", "y": "Body X", "z": "Body Z"}
    frame = shown.frame()[list(columns)].rename(columns=columns)
    frame[["Body X", "Body Y", "Body Z"]] *= 1e3
    file, table = tmp_path / "tracker.csv", "recording.tracker.columns"
    frame.to_csv(file, index=False)
    declared = tuple(
        RecordedColumn(name, {"x": "Body X", "y": "Body Y"}.get(name, columns[name]), "" if name == "time" else "mm")
        for name in columns
    )
    robot = replace(example("three").as_modelled(), tracker=Tracker(declared, 5.25, 1.0))
    (error,) = recording_mistakes(robot, tracker_module.with_tracker(robot, log, file))
    told = told_columns(error.hint, table)
    assert told == {axis: {"name": columns[axis], "unit": "mm"} for axis in ("x", "y")}
    mended = tuple(replace(column, name=told.get(column.column, {}).get("name", column.name)) for column in declared)
    robot = replace(robot, tracker=Tracker(mended, 5.25, 1.0))
    assert recording_mistakes(robot, tracker_module.with_tracker(robot, log, file)) == ()


TURN = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
FRAMES = {
    "origin": (lambda position: position - [20.0, -8.0, 4.0], ["x, y, z have another origin"]),
    "z down": (lambda position: position * [1.0, 1.0, -1.0], ["are the recording's x, y, -z"]),
    "a quarter turn": (lambda position: position @ TURN, ["are the recording's"]),
    "a left-handed frame in mm": (
        lambda position: 1e3 * (position * [1.0, -1.0, 1.0] - [2.0, 0.5, 1.0]),
        ["x, y, z are in mm", "are the recording's x, -y, z", "x, y, z have another origin"],
    ),
}


@pytest.mark.validate
@pytest.mark.parametrize("frame", FRAMES)
def test_the_frame_of_a_tracker_is_told_whatever_its_clock(monkeypatch: pytest.MonkeyPatch, frame: str) -> None:
    change, causes = FRAMES[frame]
    log, tracker = files("three")
    framed = replace(tracker, position=change(tracker.position))
    (mistakes,) = frame_mistakes(example("three"), log, framed)
    assert len(mistakes) == len(causes) and all(mistake.is_of_tracker for mistake in mistakes)
    assert all(cause in mistake.cause for cause, mistake in zip(causes, mistakes, strict=True))
    columns = told_columns(mistakes_text([mistakes], log, framed)[1], "recording.tracker.columns")
    mended = np.column_stack([_read(framed, axis, columns.get(axis, {})) for axis in "xyz"])
    assert np.nanmax(np.abs(mended - tracker.position)) < 0.1
    monkeypatch.setattr(tracker_module, "read_tracker", lambda *_: replace(tracker, position=mended))
    assert recording_mistakes(example("three"), tracker_module.with_tracker(example("three"), log, "t.csv")) == ()


def _read(tracker: Recording, axis: str, column: dict[str, Any]) -> np.ndarray:
    """What a declared column reads."""
    source = tracker.position[:, "xyz".index(column.get("name", axis))]
    unit = {"": 1.0, "mm": 1e-3}[column.get("unit", "")]
    return np.asarray(column.get("sign", 1.0) * unit * (source - column.get("offset", 0.0)))


@pytest.mark.validate
def test_another_motion_is_no_mistake_of_the_frame() -> None:
    log, tracker = files("three")
    random = np.random.default_rng(3)
    steps = np.cumsum(np.cumsum(random.standard_normal(tracker.position.shape), axis=0), axis=0)
    other = tracker.position[0] + 3.0 * steps / np.abs(steps).max()
    assert frame_mistakes(example("three"), log, replace(tracker, position=other)) == ()


@pytest.mark.validate
@pytest.mark.parametrize(("stated", "unit", "size"), [("cm", "mm", 1e3), ("mm", "m", 1.0)])
def test_a_unit_that_is_stated_wrongly_is_told(
    monkeypatch: pytest.MonkeyPatch, stated: str, unit: str, size: float
) -> None:
    log, tracker = files("three")
    columns = {axis: RecordedColumn(axis, f"Body {axis}", stated, table="recording.tracker.columns") for axis in "xyz"}
    read = replace(tracker, position=size * tracker.position * {"cm": 1e-2, "mm": 1e-3}[stated], columns=columns)
    monkeypatch.setattr(tracker_module, "read_tracker", lambda *_: read)
    with pytest.raises(RecordingError, match=f"but do if x, y, z are in {unit}, not in {stated}") as caught:
        tracker_module.with_tracker(example("three"), log, "tracker.csv")
    told = told_columns(caught.value.hint, "recording.tracker.columns")
    factor = {"cm": 0.1, "mm": 1000}[stated]
    assert told == {axis: {"name": f"Body {axis}", "unit": stated, "factor": factor} for axis in "xyz"}


def test_a_clock_has_no_line_for_its_time() -> None:
    log, tracker = files("three")
    in_ms = replace(log, time=1e3 * log.time, has_time_column=False)
    (mistakes,) = tracker_mistakes(example("three"), in_ms, tracker)
    assert mistakes_text([mistakes], in_ms, tracker)[1] == "multiply time by 0.001"
