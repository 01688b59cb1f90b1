"""The command check on rigid platforms: what it says of recordings with and without orientation."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd  # type: ignore[import-untyped,unused-ignore]
import pytest
from scipy.spatial.transform import Rotation

from tautwire.cli import run
from tautwire.cosimulation.recording_simulation import read_recorded_inputs
from tautwire.errors import UnreachableError
from tautwire.recordings.mistaken_motion import check_motion
from tautwire.recordings.recording import Recording, read_recording
from tautwire.robot.robot_file_writer import write_robot
from tautwire.robot.schema import Robot
from tautwire.robot.static_equilibrium import static_tensions
from tests.support.pose_recordings import noisy, rope_lengths, rotation_of, wandering_poses, wandering_recording
from tests.support.rigid_robots import crane_robot, suspended_robot

ROBOT = crane_robot()


def checked(folder: Path, recording: Recording, capsys: pytest.CaptureFixture[str]) -> tuple[int, dict[str, Any]]:
    """Exit status and JSON of a check."""
    write_robot(ROBOT, folder / "crane.toml")
    recording.frame().to_csv(folder / "log.csv", index=False)
    status = run(["check", str(folder / "crane.toml"), str(folder / "log.csv"), "--json"])
    return status, json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("rows", [(0, 501), (240, 501)], ids=["from the start", "in motion"])
def test_a_correct_recording_has_no_problem(
    rows: tuple[int, int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, result = checked(tmp_path, noisy(wandering_recording(ROBOT)).part(*rows), capsys)
    assert (status, result["problems"]) == (0, [])
    turned = [note for note in result["notes"] if "starts turned by" in note]
    assert len(turned) == 1 and "the run starts so too, at [" in turned[0]


@pytest.mark.validate
def test_quaternions_in_another_order_are_a_problem(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recording = noisy(wandering_recording(ROBOT))
    wrong = replace(recording, orientation=recording.orientation[:, [1, 2, 3, 0]])
    status, result = checked(tmp_path, wrong, capsys)
    (problem,) = result["problems"]
    assert status == 2 and "if the quaternion is written as x, y, z, w" in problem["problem"]
    assert 'qw = { name = "qz" }' in problem["hint"]


def test_a_centre_of_mass_in_mm_is_the_only_problem_though_cables_do_not_hold_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    in_mm = replace(ROBOT, platform=replace(ROBOT.platform, centre_of_mass=(80.0, 0.0, 30.0)))
    with pytest.raises(UnreachableError):
        static_tensions(in_mm)
    write_robot(in_mm, tmp_path / "crane.toml")
    assert run(["check", str(tmp_path / "crane.toml"), "--json"]) == 2
    (problem,) = json.loads(capsys.readouterr().out)["problems"]
    assert "centre_of_mass" in problem["where"] and "in mm multiply by 0.001" in problem["hint"]


def test_a_recording_without_orientation_is_noted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recording = noisy(wandering_recording(ROBOT))
    unturned = replace(recording, orientation=np.full((recording.sample_count, 4), np.nan))
    status, result = checked(tmp_path, unturned, capsys)
    assert (status, result["problems"]) == (0, [])
    assert any("no orientation (qw, qx, qy, qz)" in note for note in result["notes"])


def test_many_quaternions_of_another_norm_are_one_problem(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recording = wandering_recording(ROBOT)
    status, result = checked(tmp_path, replace(recording, orientation=1.3 * recording.orientation), capsys)
    (problem,) = result["problems"]
    assert status == 2 and problem["line"] == 2
    assert "has the norm 1.3 in qw, qx, qy, qz" in problem["problem"]
    assert "(and 500 more like it, last in line 502)" in problem["problem"]


def round_trip(folder: Path, robot: Robot, speeds: np.ndarray, time: np.ndarray) -> Recording:
    """The result of simulate over winch speeds (N, n), read as a recording of these, after check passed it."""
    write_robot(robot, folder / "robot.toml")
    program = pd.DataFrame({"time": time} | {f"winch_speed_{i}": column for i, column in enumerate(speeds.T, 1)})
    program.to_csv(folder / "speeds.csv", index=False)
    files = {name: str(folder / name) for name in ("robot.toml", "speeds.csv", "result.csv", "recording.csv")}
    arguments = ["--speeds", files["speeds.csv"], "--out", files["result.csv"], "--step", "0.02"]
    assert run(["simulate", files["robot.toml"], *arguments]) == 0
    pd.read_csv(files["result.csv"]).merge(program, on="time").to_csv(files["recording.csv"], index=False)
    assert run(["check", files["robot.toml"], files["recording.csv"]]) == 0
    return read_recording(files["recording.csv"], robot.cable_count)


def starting(time: np.ndarray) -> np.ndarray:
    """A factor that rises smoothly from rest."""
    return np.asarray(np.sin(0.5 * np.pi * np.clip(time / 0.5, 0.0, 1.0)) ** 2)


@pytest.mark.validate
def test_what_simulate_says_of_a_platform_on_four_cables_passes_the_check(tmp_path: Path) -> None:
    time = np.arange(81) / 32.0
    shape = 0.05 + 0.02 * np.array([1.0, 0.0, -1.0, 0.0])
    speeds = (starting(time) * np.sin(1.3 * time))[:, None] * shape
    recording = round_trip(tmp_path, suspended_robot(4), speeds, time)
    assert np.ptp(recording.orientation[:, 1:], axis=0).max() > 1e-3
    check = check_motion(suspended_robot(4), recording)
    assert check is not None and check.misfit < 5e-3


@pytest.mark.validate
def test_what_simulate_says_of_a_platform_on_eight_cables_passes_the_check(tmp_path: Path) -> None:
    time = np.arange(161) / 40.0
    positions, rotations = wandering_poses(ROBOT, time, 0.1, 0.05)
    factor = starting(time)[:, None]
    positions = np.array(ROBOT.platform.start) + factor * (positions - np.array(ROBOT.platform.start))
    turned = Rotation.from_rotvec(factor * rotations.as_rotvec())
    speeds = -np.gradient(rope_lengths(ROBOT, positions, turned), time, axis=0)
    recording = round_trip(tmp_path, ROBOT, speeds, time)
    assert (rotation_of(recording.orientation[1:]) * turned[1:].inv()).magnitude().max() < 0.01
    check = check_motion(ROBOT, recording)
    assert check is not None and check.misfit < 0.02


def test_simulate_starts_where_and_as_the_recording_does(tmp_path: Path) -> None:
    recording = noisy(wandering_recording(ROBOT)).part(200, 300)
    recording.frame().to_csv(tmp_path / "log.csv", index=False)
    recorded = read_recorded_inputs(ROBOT, tmp_path / "log.csv")
    platform = recorded.robot.platform
    assert platform.start == pytest.approx(recording.position[:5].mean(axis=0), abs=1e-9)
    turned = rotation_of(np.array(platform.start_orientation)) * rotation_of(recording.orientation[2]).inv()
    assert turned.magnitude() < 2e-3
    assert ["starts at" in note or "starts turned by" in note for note in recorded.notes[:2]] == [True, True]
