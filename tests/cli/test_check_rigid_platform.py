"""The command check on rigid platforms: what it says of recordings with and without orientation."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tautwire.cli import run
from tautwire.recordings.recording import Recording
from tautwire.robot.robot_file_writer import write_robot
from tests.support.pose_recordings import noisy, wandering_recording
from tests.support.rigid_robots import crane_robot

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


def test_quaternions_in_another_order_are_a_problem(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recording = noisy(wandering_recording(ROBOT))
    wrong = replace(recording, orientation=recording.orientation[:, [1, 2, 3, 0]])
    status, result = checked(tmp_path, wrong, capsys)
    (problem,) = result["problems"]
    assert status == 2 and "if the quaternion is written as x, y, z, w" in problem["problem"]
    assert 'qw = "qz"' in problem["hint"]


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
