"""A point mass that hangs on two cables in a vertical plane, from the robot file to each command."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tautwire.cli import run

ANCHORS, START, WEIGHT = np.array([[0.0, 0.0, 3.0], [3.0, 0.0, 3.0]]), np.array([1.4, 0.0, 0.9]), 5.0 * 9.81
CABLE = 'modulus = 1.0e10\narea = 2.0e-6\ndamping = 2.0e7\nlaw = "logarithmic"\n'


def robot_file(folder: Path, start: str = "[1.4, 0.0, 0.9]", cables: int = 2) -> str:
    """The file of the robot, or of one with another start or fewer cables."""
    tables = "".join(f"[[cable]]\nanchor = {anchor.tolist()}\n{CABLE}" for anchor in ANCHORS[:cables])
    path = folder / "pair.toml"
    path.write_text(f'name = "pair"\n[platform]\nmass = 5.0\nstart = {start}\n{tables}', encoding="utf-8")
    return str(path)


def tensions_by_moments() -> list[float]:
    """Tensions in N at the start, each by the moments about the other cable's exit point."""
    arms = np.cross(ANCHORS - START, ANCHORS[::-1] - START)[:, 1] / np.linalg.norm(ANCHORS - START, axis=1)
    levers = np.abs(ANCHORS[::-1, 0] - START[0])
    return list(WEIGHT * levers / np.abs(arms))


def test_pose_holds_the_weight_by_both_cables(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["pose", robot_file(tmp_path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["tensions"] == pytest.approx(tensions_by_moments(), rel=1e-9)


def test_the_mode_across_the_plane_is_that_of_a_pendulum(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plant = tmp_path / "plant.json"
    assert run(["linearise", robot_file(tmp_path), "--out", str(plant)]) == 0
    lowest = min(json.loads(plant.read_text())["frequencies_hz"])
    assert lowest == pytest.approx(np.sqrt(9.81 / (3.0 - 0.9)) / (2.0 * np.pi), rel=1e-6)
    assert "damping ratio 0.00000" in capsys.readouterr().out


@pytest.mark.validate
def test_simulation_and_check_of_its_result(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot, speeds, result = robot_file(tmp_path), tmp_path / "speeds.csv", tmp_path / "result.csv"
    time = np.arange(301) * 0.01
    commands = {"winch_speed_1": 0.15 * np.sin(4.0 * time), "winch_speed_2": 0.1 * np.sin(5.0 * time)}
    pd.DataFrame({"time": time, **commands}).to_csv(speeds, index=False)
    assert run(["simulate", robot, "--speeds", str(speeds), "--out", str(result)]) == 0
    motion = pd.read_csv(result)
    assert np.abs(motion["y"]).max() < 1e-9 and np.ptp(motion["x"]) > 0.01
    assert motion[["tension_1", "tension_2"]].iloc[0].to_numpy() == pytest.approx(tensions_by_moments(), rel=1e-6)
    lengths = np.linalg.norm(motion[["x", "y", "z"]].to_numpy()[:, None] - ANCHORS, axis=2)
    reeled = [0.15 * (1.0 - np.cos(4.0 * time)) / 4.0, 0.1 * (1.0 - np.cos(5.0 * time)) / 5.0]
    assert lengths[0] - lengths == pytest.approx(np.array(reeled).T, abs=0.02)
    recording = tmp_path / "recording.csv"
    pd.DataFrame({"time": time, **commands}).join(motion[["x", "z", "tension_1", "tension_2"]]).to_csv(
        recording, index=False
    )
    capsys.readouterr()
    assert run(["check", robot, str(recording)]) == 0
    assert "no problems found" in capsys.readouterr().out


@pytest.mark.validate
def test_a_new_robot_file_of_two_cables_runs_as_it_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["new", "pair", "--cables", "2"]) == 0
    assert run(["check", "pair.toml"]) == 0
    time = np.arange(51) * 0.01
    lift = {f"winch_speed_{cable}": 0.1 * np.sin(np.pi * time / 0.5) ** 2 for cable in (1, 2)}
    pd.DataFrame({"time": time, **lift}).to_csv("speeds.csv", index=False)
    assert run(["simulate", "pair.toml", "--speeds", "speeds.csv", "--out", "result.csv"]) == 0
    motion = pd.read_csv("result.csv")
    # Exit points at x = 4 and -4, 3 m above: half of the weight is the vertical part of each tension.
    assert motion[["tension_1", "tension_2"]].iloc[0].to_numpy() == pytest.approx(50.0 * 9.81 / 2.0 * 5.0 / 3.0)
    assert motion[["x", "y"]].abs().max().max() < 1e-9
    assert motion["z"].iloc[-1] - motion["z"].iloc[0] == pytest.approx(
        3.0 - np.sqrt((5.0 - 0.025) ** 2 - 16.0), abs=2e-3
    )
    capsys.readouterr()
    assert run(["linearise", "pair.toml", "--out", "plant.json"]) == 0
    lowest = min(json.loads(Path("plant.json").read_text(encoding="utf-8"))["frequencies_hz"])
    assert lowest == pytest.approx(np.sqrt(9.81 / 3.0) / (2.0 * np.pi), rel=1e-3)


def test_workspace_is_the_static_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot, out = robot_file(tmp_path), tmp_path / "workspace.csv"
    assert run(["workspace", robot, "--out", str(out)]) == 2
    assert "2 cables cannot exert a force of every direction" in capsys.readouterr().err
    assert run(["workspace", robot, "--criterion", "static", "--out", str(out)]) == 0
    points = pd.read_csv(out)
    inside = (points["z"] < 3.0 - 1e-9) & points["x"].between(1e-9, 3.0 - 1e-9)
    assert points["feasible"][inside].all() and inside.any()


@pytest.mark.parametrize(
    ("start", "cables", "words"),
    [
        ("[1.4, 0.2, 0.9]", 2, "exit points alone, and it is 0.2 m beside it"),
        ("[0.0, 0.0, 0.9]", 1, "1 given, a robot has two"),
    ],
)
def test_what_two_cables_cannot_hold_and_one_cable_are_refused(
    start: str, cables: int, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["check", robot_file(tmp_path, start, cables)]) == 2
    assert words in capsys.readouterr().out


def test_lengths_of_two_cables_determine_no_position(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["pose", robot_file(tmp_path), "--lengths", "2.5,2.6"]) == 2
    assert "compute the lengths at positions" in capsys.readouterr().err
