"""``tautwire pose``: from a pose to lengths and tensions, and back."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tautwire.cli import run
from tautwire.robot.robot_file_reader import read_robot
from tautwire.robot.robot_file_text import robot_text
from tautwire.robot.static_pose import static_pose
from tests.support.robots import EXAMPLES, example

COGIRO, THREE = (str(EXAMPLES / name / "robot.toml") for name in ("cogiro", "three"))
POSE = ["--at", "0.5,-0.4,2.2", "--orientation", "0.9999,0,0,0.01414"]


def test_it_prints_lengths_and_tensions(capsys: pytest.CaptureFixture[str]) -> None:
    held = static_pose(read_robot(Path(COGIRO)))
    assert run(["pose", COGIRO]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[:2] == [
        "position 0.000000, 0.000000, 2.000000 m",
        "orientation 1.000000, 0.000000, 0.000000, 0.000000",
    ]
    assert lines[2] == f"cable 1: {held.lengths[0]:.6f} m, {held.tensions[0]:.6g} N"
    assert lines[-1] == f"wrench margin {held.wrench_margin:.4g} N"
    assert run(["pose", THREE]) == 0
    assert "orientation" not in capsys.readouterr().out


def test_its_lengths_lead_back_to_the_pose(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["pose", COGIRO, *POSE, "--rule", "least_norm", "--json"]) == 0
    held = json.loads(capsys.readouterr().out)
    assert (held["rule"], len(held["lengths"]), len(held["tensions"])) == ("least_norm", 8, 8)
    assert np.shape(held["stiffness_matrix"]) == (6, 6) and np.shape(held["structure_matrix"]) == (6, 8)
    lengths = ",".join(map(str, held["lengths"]))
    assert run(["pose", COGIRO, "--lengths", lengths, "--json"]) == 0
    first = json.loads(capsys.readouterr().out)["poses"][0]
    assert first["position"] == pytest.approx([0.5, -0.4, 2.2], abs=1e-6) and first["residual"] < 1e-9
    assert abs(np.dot(first["orientation"], held["orientation"])) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--rule", "fair"], "--rule: 'fair' is no rule; give one of nearest, least_norm, barycentre, closed_form"),
        (["--lengths", "1,2"], "--lengths: '1,2' is not 8 numbers"),
        (["--at", "here"], "--at: 'here' is not a position"),
        (["--orientation", "1,1,0,0"], "--orientation: has norm 1.41421"),
    ],
)
def test_what_is_wrong_is_one_line(capsys: pytest.CaptureFixture[str], arguments: list[str], message: str) -> None:
    assert run(["pose", COGIRO, *arguments]) == 2
    captured = capsys.readouterr()
    assert message in captured.err and captured.err.count("\n") == 1 and not captured.out


def test_a_pose_that_cannot_be_held_tells_the_cable(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["pose", COGIRO, "--at", "50,0,0"]) != 0
    assert "cannot be held at [50, 0, 0] m: no wrench closure" in capsys.readouterr().err


def test_json_has_no_number_that_is_not_finite(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Cables on all sides without a largest tension hold any wrench."""
    robot = tmp_path / "robot.toml"
    robot.write_text(robot_text(replace(example("eight"), tension=None)), encoding="utf-8")
    assert run(["pose", str(robot), "--json"]) == 0
    assert json.loads(capsys.readouterr().out, parse_constant=pytest.fail)["wrench_margin"] is None
