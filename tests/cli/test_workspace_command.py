import json
from pathlib import Path

import pandas as pd
import pytest

from tautwire.cli import run
from tautwire.robot.robot_file_writer import write_robot
from tests.support.rigid_robots import crane_robot
from tests.support.robots import EXAMPLES

CAROCA = str(EXAMPLES / "caroca" / "robot.toml")


def test_it_writes_the_table_and_the_figure(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table, figure = tmp_path / "workspace.csv", tmp_path / "workspace.png"
    arguments = ["--lower", "-3,-2,1", "--upper", "3,2,3", "--spacing", "1", "--acceleration", "0.5"]
    assert run(["workspace", CAROCA, "--out", str(table), "--plot", str(figure), *arguments]) == 0
    positions = pd.read_csv(table)
    assert list(positions)[:5] == ["x", "y", "z", "feasible", "margin"]
    assert len(positions) == 7 * 5 * 3
    count = int(positions.feasible.sum())
    assert 0 < count < len(positions)
    assert f"{count} of 105 positions are wrench-feasible" in capsys.readouterr().out
    assert figure.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--lower", "here"], "--lower: 'here' is not a position"),
        (["--spacing", "-1"], "not positive"),
        (["--plot", "figure.csv"], "no suffix of a figure"),
        (["--lower", "0,0,9", "--upper", "0,0,1"], "lower ones first"),
    ],
)
def test_what_is_wrong_is_one_line_and_nothing_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    assert run(["workspace", CAROCA, "--out", str(tmp_path / "w.csv"), *arguments]) == 2
    captured = capsys.readouterr()
    assert message in captured.err and captured.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def written_crane(folder: Path) -> str:
    write_robot(crane_robot(), folder / "crane.toml")
    return str(folder / "crane.toml")


def test_the_orientations_at_a_position_of_a_rigid_platform(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table, figure = tmp_path / "turns.csv", tmp_path / "turns.svg"
    ranges = ["--at", "0,0,1.5", "--rotation-range", "0.2,0,0.4", "--spacing", "0.2", "--orientation", "1,0,0,0"]
    assert run(["workspace", written_crane(tmp_path), "--out", str(table), "--plot", str(figure), *ranges]) == 0
    turns = pd.read_csv(table)
    assert list(turns)[:4] == ["rotation_x", "rotation_y", "rotation_z", "feasible"]
    assert list(turns)[-2:] == ["cables_interfere", "platform_interferes"]
    assert len(turns) == 3 * 5 and f"{turns.feasible.sum()} of 15 orientations" in capsys.readouterr().out
    assert "<svg" in figure.read_text(encoding="utf-8")


@pytest.mark.validate
def test_a_range_of_rotations_makes_the_workspace_smaller(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot, counts = written_crane(tmp_path), []
    arguments = ["workspace", robot, "--json", "--spacing", "3", "--acceleration", "1", "--angular-acceleration", "1"]
    for rotations in ("0,0,0", "0.3,0.3,0.3"):
        assert run([*arguments, "--rotation-range", rotations]) == 0
        counts.append(json.loads(capsys.readouterr().out)["feasible"])
    assert 0 < counts[1] < counts[0]
    assert run([*arguments, "--criterion", "wrench-closure", "--quiet"]) == 0
    assert json.loads(capsys.readouterr().out)["feasible"] == 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--criterion", "wrench"], "criterion: 'wrench' is none"),
        (["--at", "0,0,1"], "--at: is given without rotations"),
        (["--at", "0,0,1", "--lower", "0,0,0", "--rotation-range", "1,1,1"], "--at: is given with a box"),
        (["--rotation-range", "1,1"], "--rotation-range: '1,1' is not 3 numbers"),
        (["--rotation-range", "1,1,4"], "three rotations from 0 to pi rad"),
        (["--orientation", "1,0,0,1"], "--orientation: has norm 1.41421"),
    ],
)
def test_what_a_rigid_platform_cannot_have_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], message: str
) -> None:
    assert run(["workspace", written_crane(tmp_path), "--out", str(tmp_path / "w.csv"), *arguments]) == 2
    captured = capsys.readouterr()
    assert message in captured.err and captured.err.count("\n") == 1
    assert not (tmp_path / "w.csv").exists()


def test_table_and_figure_are_not_written_to_one_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one = str(tmp_path / "w.png")
    assert run(["workspace", CAROCA, "--out", one, "--plot", one]) == 2
    assert "--plot: " in (stderr := capsys.readouterr().err) and "is what --out writes; choose another --plot" in stderr
    assert list(tmp_path.iterdir()) == []


def test_json_without_a_file_prints_the_table_and_writes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(constant: str) -> None:
        pytest.fail(f"{constant} is no JSON")

    monkeypatch.chdir(tmp_path)
    arguments = ["workspace", CAROCA, "--spacing", "2"]
    assert run([*arguments, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out, parse_constant=refuse)
    assert list(tmp_path.iterdir()) == []
    assert run([*arguments, "--out", "w.csv"]) == 0
    written = pd.read_csv("w.csv")
    assert written.lowest_tension.isna().any()
    pd.testing.assert_frame_equal(pd.DataFrame(printed["rows"]).astype(float), written.astype(float), rtol=1e-9)
    assert (printed["feasible"], printed["positions"]) == (written.feasible.sum(), len(written))


def test_a_robot_that_its_start_does_not_hold_is_mapped_too(tmp_path: Path) -> None:
    robot = tmp_path / "robot.toml"
    robot.write_text(Path(CAROCA).read_text().replace("start = [1.0, 0.0, 1.0]", "start = [3.0, 1.5, 1.0]"))
    assert run(["workspace", str(robot), "--out", str(tmp_path / "w.csv"), "--spacing", "1"]) == 0


def test_linearise_says_what_is_near(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["linearise", CAROCA, "--out", str(tmp_path / "model.json")]) == 0
    assert "cable 3 becomes slack at an amplitude of 0.0023 m" in capsys.readouterr().err


def test_help_has_an_example(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["workspace", "--help"]) == 0
    assert "Example: tautwire workspace" in " ".join(capsys.readouterr().out.split())
