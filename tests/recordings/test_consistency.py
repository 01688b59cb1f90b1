"""A recording that cannot be one of the robot is refused; one that merely starts elsewhere is not."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tautwire.cli import run
from tautwire.cli.input_checks import check_files
from tautwire.errors import RecordingError, UnreachableError
from tautwire.recordings.consistency import (
    MAX_REELING_MISMATCH,
    MIN_CHECKED_START_SHARE,
    recording_mistakes,
    reeling_mismatch,
    require_matching_reeling,
    require_plausible,
    robot_size,
    travel_error,
)
from tautwire.recordings.recording import Recording, read_recording
from tautwire.recordings.start_position import start_position
from tautwire.robot.schema import Robot
from tests.support.recordings import recorded
from tests.support.robots import EXAMPLES, example

THREE, CAROCA = example("three"), example("caroca")
NOISE = 3e-4


def of(name: str) -> Recording:
    return read_recording(EXAMPLES / name / "check.csv", example(name).cable_count)


def moved(recording: Recording, offset: list[float]) -> Recording:
    return replace(recording, position=recording.position + np.array(offset))


def elsewhere(robot: Robot, offset: list[float]) -> Robot:
    """The robot file with another start: of it, recordings of the old one start elsewhere."""
    start = np.array(robot.platform.start) + np.array(offset)
    return replace(robot, platform=replace(robot.platform, start=tuple(start.tolist())))


def test_another_robots_recording_is_refused_by_its_ropes() -> None:
    with pytest.raises(RecordingError, match=r"first positions: they begin at .*28\.1 m from .*28\.86, 0, 5\]") as e:
        start_position(THREE, NOISE, of("caroca"))
    assert "winch travel does not match the positions" in e.value.problem and "correct the robot file" in e.value.hint


def test_a_start_farther_away_than_the_robot_is_large_is_refused() -> None:
    assert robot_size(CAROCA) == pytest.approx(7.0, rel=1e-3)
    with pytest.raises(RecordingError, match=r"28\.1 m from .*\[1, 0, 1\] m, and the robot is no larger than 7 m"):
        start_position(CAROCA, NOISE, of("three"))


def test_a_start_that_cables_cannot_hold_tells_how_far_it_is_from_the_robot_files() -> None:
    with pytest.raises(UnreachableError, match=r"60 m from the start in the robot file.*cable \d would need -") as e:
        start_position(THREE, NOISE, moved(recorded("three", 1), [-60.0, 0.0, 0.0]))
    assert "correct the robot file" in e.value.hint


@pytest.mark.parametrize("name", ["three", "caroca", "eight"])
def test_a_start_far_from_the_robot_files_is_taken_where_the_ropes_fit(name: str) -> None:
    away = elsewhere(example(name), [0.0, 0.0, -1.5 * MIN_CHECKED_START_SHARE * robot_size(example(name))])
    start, notes = start_position(away, NOISE, of(name))
    assert start == pytest.approx(example(name).platform.start, abs=2e-3)
    assert "the run starts there too" in notes[0]


@pytest.mark.validate
@pytest.mark.parametrize(
    "effects",
    [
        {"payload": {"mass": 100.0}},
        {"modulus": {"modulus": 3e10}},
        {"drum": {"radius_ratio": 1.15, "eccentricity": 0.05, "slip": 1e-6}},
        {"anchor": {"x": 1.0, "z": -2.0, "cables": [1]}},
        {"creep": {"compliance": 1e-11, "time": 5.0}},
        {"sensor_delay": {"seconds": 0.3}},
        {"unlisted_frame": {"stiffness_constant": 1e5, "viscosity": 2e3}},
    ],
)
def test_what_a_model_may_lack_does_not_make_it_another_robots(effects: dict[str, dict[str, float]]) -> None:
    recording = recorded("three", 3, effects)
    far = elsewhere(THREE, [0.0, 0.0, 15.0])
    reeled, missed = reeling_mismatch(far, recording)
    assert missed < 0.5 * MAX_REELING_MISMATCH * reeled
    require_matching_reeling(far, recording, recording.position[0], "here")


@pytest.mark.parametrize("name", ["three", "caroca", "eight"])
def test_a_tracker_that_jumps_now_and_then_does_not_make_it_another_robots(name: str) -> None:
    recording = of(name)
    position = recording.position.copy()
    position[[0, 500, 501, 900]] += 100.0
    far = elsewhere(example(name), [0.0, 0.0, -1.5 * MIN_CHECKED_START_SHARE * robot_size(example(name))])
    require_matching_reeling(far, replace(recording, position=position), recording.position[1], "here")


def test_a_recording_without_positions_or_motion_is_no_other_robots() -> None:
    far, still = elsewhere(THREE, [0.0, 0.0, 15.0]), recorded("three", 1)
    at_rest = replace(still, winch_speed=np.zeros_like(still.winch_speed))
    unseen = replace(still, position=np.full_like(still.position, np.nan))
    start = np.array(THREE.platform.start)
    require_matching_reeling(far, at_rest, start, "here")
    require_matching_reeling(far, unseen, start, "here")


def test_counts_that_pass_for_metres_are_told_without_positions() -> None:
    recording = of("three")
    blind = replace(recording, position=np.full_like(recording.position, np.nan))
    assert travel_error(THREE, blind) is None
    counts = 1e4 * blind.wound_lengths()
    moving = replace(blind, winch_speed=1e4 * blind.winch_speed, rope_length=-counts)
    (error,) = recording_mistakes(THREE, moving)
    winch, travel = int(np.argmax(np.max(np.abs(counts), axis=0))) + 1, float(np.max(np.abs(counts)))
    assert error.problem == (
        f"winch {winch} moves {travel:,.4g} m of rope, and the robot is no larger than {robot_size(THREE):.3g} m"
    )
    assert f"give rope_length_{winch} in m: for counts add factor = 2 pi * drum radius" in error.hint


def test_a_platform_may_hang_far_below_its_start() -> None:
    time, centre = 0.02 * np.arange(4001), np.mean(THREE.anchors, axis=0)
    anchors = centre + 0.3 * (np.array(THREE.anchors) - centre)
    cables = tuple(replace(c, anchor=tuple(a.tolist())) for c, a in zip(THREE.cables, anchors, strict=True))
    start = tuple((centre - np.array([0.0, 0.0, 1.0])).tolist())
    shaft = replace(THREE, cables=cables, platform=replace(THREE.platform, start=start))
    depth = 1.0 + 60.0 * (1.0 - np.cos(2.0 * np.pi * time / time[-1]))
    position = centre - depth[:, None] * np.array([0.0, 0.0, 1.0])
    lengths = np.linalg.norm(anchors - position[:, None], axis=2)
    speeds, unmeasured = -np.gradient(lengths, time, axis=0), np.full(lengths.shape, np.nan)
    recording = Recording("shaft.csv", time, speeds, unmeasured, position)
    assert np.max(np.abs(recording.wound_lengths())) > 3.0 * robot_size(shaft)
    assert not recording_mistakes(shaft, recording)
    assert travel_error(shaft, replace(recording, position=unmeasured)) is not None


def test_time_in_milliseconds_is_told_without_positions() -> None:
    recording = of("three")
    late = replace(recording, position=np.full_like(recording.position, np.nan), time=1e3 * recording.time)
    (error,) = recording_mistakes(THREE, late)
    assert "check that time is in s" in error.hint


@pytest.mark.validate(but=["simulate"])
@pytest.mark.parametrize("command", ["trace", "simulate", "check"])
def test_commands_tell_of_another_robots_recording(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    robot, recording = str(EXAMPLES / "three" / "robot.toml"), str(EXAMPLES / "caroca" / "fit.csv")
    out = ["--out", str(tmp_path / "out")]
    arguments = {"check": [recording, "--json"], "trace": [recording, *out], "simulate": ["--speeds", recording, *out]}
    assert run([command, robot, *arguments[command]]) == 2
    captured = capsys.readouterr()
    said = json.loads(captured.out)["problems"][0]["problem"] if command == "check" else captured.err
    assert "28.1 m from the start in the robot file" in said
    assert list(tmp_path.iterdir()) == []
    assert check_files(EXAMPLES / "three" / "robot.toml", EXAMPLES / "three" / "fit.csv").problems == ()


def test_cables_of_the_robot_file_in_another_order_are_told_by_winches_and_load_cells() -> None:
    cables = (*THREE.cables[1:], THREE.cables[0])
    (error,) = recording_mistakes(replace(THREE, cables=cables), of("three"))
    match = re.search(r"write the \[\[cable\]\] tables of the robot file in the order ([0-9, ]+), as win", error.hint)
    assert match is not None
    written = tuple(cables[int(number) - 1] for number in match.group(1).split(","))
    assert written == THREE.cables
    assert "or else write into [recording.columns] winch_speed_1" in error.hint and "tension_1 = {" in error.hint


@pytest.mark.parametrize("newtons", [1.0, 1e3])
def test_winches_alone_in_another_order_are_no_order_of_cables(newtons: float) -> None:
    recording = of("three")
    shown = replace(recording, winch_speed=recording.winch_speed[:, [1, 2, 0]], tension=recording.tension / newtons)
    errors = recording_mistakes(THREE, shown)
    assert len(errors) == (1 if newtons == 1.0 else 2)
    assert not any("[[cable]]" in error.hint for error in errors)


def test_what_mends_several_mistakes_is_told_once() -> None:
    recording, rows = of("three"), np.r_[0:1500, 300:1500]
    parts = {key: getattr(recording, key)[rows] for key in ("winch_speed", "tension", "position", "orientation")}
    twice = replace(recording, time=recording.time[: len(rows)], **parts)
    with pytest.raises(RecordingError) as caught:
        require_plausible(THREE, twice)
    assert caught.value.problem.count("winch travel of cable") > 1
    assert caught.value.hint == "cut the recording there"


@pytest.mark.validate(but=["1.0"])
@pytest.mark.parametrize("unit", [1.0, 1e-3])
def test_lengths_in_the_columns_of_speeds_are_told(unit: float) -> None:
    recording = of("three")
    lengths = (70.0 - recording.wound_lengths()) / unit
    (error,) = recording_mistakes(THREE, recording.with_winch_speed(lengths))
    assert "vary as the lengths of the ropes, not their rates" in error.problem
    assert f"name them rope_length_1 to rope_length_3; 1 of theirs is about {unit:g} m of rope" in error.hint


@pytest.mark.validate
def test_times_that_count_samples_are_told_with_the_interval() -> None:
    recording = of("three")
    (error,) = recording_mistakes(THREE, replace(recording, time=np.arange(recording.sample_count) + 0.0))
    assert "as the number of a sample does" in error.problem and "about 0.00999 by" in error.hint
