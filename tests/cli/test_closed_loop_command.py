"""``tautwire simulate --controller``: files of each kind, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tautwire.cli.application import run
from tautwire.control import Feedforward, build_controller_fmu
from tautwire.robot.robot_file_writer import write_robot
from tautwire.robot.trajectory import Line
from tests.support.rigid_robots import crane_robot
from tests.support.robots import EXAMPLES, example

ROBOT = str(EXAMPLES / "three" / "robot.toml")
PATH = "end = [28.9, 0.05, 5.1]\nduration = 1.0\n"
STATE_SPACE = {"A": [], "B": [], "C": [], "D": np.zeros((3, 6)).tolist(), "dt": 0.01}
FUNCTION = "def controller(time, measured):\n    return [0.0] * (len(measured) - 3)\n"


def simulated(folder: Path, controller: Path) -> pd.DataFrame:
    (folder / "path.toml").write_text(PATH, encoding="utf-8")
    out = folder / "result.csv"
    arguments = ["simulate", ROBOT, "--controller", str(controller), "--path", str(folder / "path.toml")]
    assert run([*arguments, "--until", "1.1", "--out", str(out)]) == 0
    return pd.read_csv(out)


@pytest.mark.validate
def test_files_of_each_kind_close_the_loop(tmp_path: Path) -> None:
    robot = example("three")
    path = Line(robot.platform.start, (28.9, 0.05, 5.1), 1.0)
    matrices, script = tmp_path / "law.json", tmp_path / "law.py"
    matrices.write_text(json.dumps(STATE_SPACE), encoding="utf-8")
    script.write_text(FUNCTION, encoding="utf-8")
    by_fmu = simulated(tmp_path, build_controller_fmu(robot, Feedforward(3), path, 1.1, tmp_path))
    by_matrices, by_function = simulated(tmp_path, matrices), simulated(tmp_path, script)
    assert by_fmu["time"].to_numpy() == pytest.approx(np.arange(111) * 0.01)
    assert np.abs(by_fmu[["x", "y", "z"]] - by_matrices[["x", "y", "z"]]).to_numpy().max() < 1e-7
    assert by_fmu["z"].iloc[-1] > 5.08
    # Winches that are told to stand, but for the first samples.
    assert by_function["z"].iloc[-1] < 5.02


def test_the_run_begins_where_its_path_does(tmp_path: Path) -> None:
    script = tmp_path / "law.py"
    script.write_text(FUNCTION, encoding="utf-8")
    (tmp_path / "path.toml").write_text(f"start = [28.8, 0.0, 5.05]\n{PATH}", encoding="utf-8")
    files = ["--controller", str(script), "--path", str(tmp_path / "path.toml")]
    assert run(["simulate", ROBOT, *files, "--until", "0.05", "--out", str(tmp_path / "result.csv")]) == 0
    first = pd.read_csv(tmp_path / "result.csv")[["x", "y", "z"]].iloc[0]
    assert first.to_numpy() == pytest.approx([28.8, 0.0, 5.05], abs=1e-9)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("law.json", "{}", ("has no A, B, C, D, dt",)),
        ("law.json", "[1", ("is not JSON",)),
        ("law.json", json.dumps({**STATE_SPACE, "D": [[1, 2], [3]]}), ("is not a state space",)),
        ("law.json", json.dumps({**STATE_SPACE, "D": [[1, 2]]}), ("law.json", "has 2 inputs, must have 6")),
        ("law.py", "x = 1", ("has no function controller",)),
        ("law.py", "1 / 0", ("raised ZeroDivisionError",)),
        ("law.m", "", ("ending '.m'", "(.json)")),
    ],
)
def test_files_without_a_controller_are_refused(
    name: str, content: str, words: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_text(content, encoding="utf-8")
    (tmp_path / "path.toml").write_text(PATH, encoding="utf-8")
    out = tmp_path / "result.csv"
    arguments = ["simulate", ROBOT, "--controller", str(tmp_path / name), "--path", str(tmp_path / "path.toml")]
    assert run([*arguments, "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert all(word in said for word in words), said
    assert not out.exists()


@pytest.mark.validate
def test_a_function_that_raises_leaves_the_run_until_then(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    law, path, out = tmp_path / "law.py", tmp_path / "path.toml", tmp_path / "result.csv"
    law.write_text(FUNCTION.replace("    return", "    1 / (time < 0.045)\n    return"), encoding="utf-8")
    path.write_text(PATH, encoding="utf-8")
    arguments = ["simulate", ROBOT, "--controller", str(law), "--path", str(path), "--out", str(out)]
    assert run(arguments) == 1
    said = capsys.readouterr().err
    assert "raised ZeroDivisionError" in said and "at 0.05 s" in said and "the run up to then is in" in said
    assert pd.read_csv(out)["time"].to_numpy() == pytest.approx(np.arange(7) * 0.01)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], ("--speeds", "--controller and --path")),
        (["--controller", "law.py"], ("--path", "is missing")),
        (["--path", "path.toml"], ("--controller", "is missing")),
        (["--path", "path.toml", "--controller", "law.py", "--speeds", "s.csv"], ("--speeds", "beside")),
        (["--path", "path.toml", "--controller", "law.py", "--report", "run.html"], ("--report", "not available")),
        (["--path", "absent.toml", "--controller", "law.py"], ("absent.toml",)),
    ],
)
def test_options_that_do_not_go_together_are_refused(
    options: list[str], words: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["simulate", ROBOT, *options, "--out", "result.csv"]) == 2
    said = capsys.readouterr().err
    assert all(word in said for word in words), said


@pytest.mark.validate
def test_a_platform_that_turns_follows_a_path_with_an_orientation(tmp_path: Path) -> None:
    robot, x, y, z = tmp_path / "crane.toml", *crane_robot().platform.start
    write_robot(crane_robot(), robot)
    lines = f"end = [{x}, {y}, {z + 0.002}]\nend_orientation = [0.99995, 0.0, 0.0, 0.01]\nduration = 0.1\n"
    (tmp_path / "path.toml").write_text(lines, encoding="utf-8")
    state_space = {"A": [], "B": [], "C": [], "D": np.zeros((8, 14)).tolist(), "dt": 0.01}
    (tmp_path / "law.json").write_text(json.dumps(state_space), encoding="utf-8")
    files = ["--controller", str(tmp_path / "law.json"), "--path", str(tmp_path / "path.toml")]
    out = tmp_path / "result.csv"
    assert run(["simulate", str(robot), *files, "--until", "0.15", "--out", str(out)]) == 0
    result = pd.read_csv(out)
    assert result["qz"].iloc[-1] == pytest.approx(0.01, abs=2e-4)
    assert result["z"].iloc[-1] == pytest.approx(z + 0.002, abs=5e-4)
