"""What the command line refuses: one line that tells what is wrong, and nothing written."""

import json
from pathlib import Path

import pandas as pd
import pytest

from tautwire.cli import run
from tests.support.robots import EXAMPLES

THREE = EXAMPLES / "three"
ROBOT = str(THREE / "robot.toml")


def edited(tmp_path: Path, old: str, new: str) -> Path:
    """The three-cable robot file with one line changed."""
    text = Path(ROBOT).read_text(encoding="utf-8")
    assert old in text
    place = tmp_path / "edited.toml"
    place.write_text(text.replace(old, new, 1), encoding="utf-8")
    return place


WRONG_ROBOTS = [
    ("mass = 300.0", "mass = -300.0", "platform.mass"),
    ("mass = 300.0", "mas = 300.0", "mas"),
    ("start = [28.86, 0.0, 5.0]", "start = [-30.0, 0.0, 5.0]", "platform.start"),
    ("gravity", "gravty", "gravty"),
]


@pytest.mark.parametrize(("old", "new", "said"), WRONG_ROBOTS)
@pytest.mark.parametrize("command", ["build", "simulate", "linearise", "trace"])
def test_a_wrong_robot_file_is_one_line_and_nothing_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], command: str, old: str, new: str, said: str
) -> None:
    robot = str(edited(tmp_path, old, new))
    out = tmp_path / "out"
    recording = str(THREE / "fit.csv")
    arguments = {
        "build": ["build", robot],
        "simulate": ["simulate", robot, "--speeds", recording],
        "linearise": ["linearise", robot],
        "trace": ["trace", robot, recording],
    }[command]
    assert run([*arguments, "--out", str(out)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert said in captured.err
    assert "edited.toml" in captured.err
    assert [path.name for path in tmp_path.iterdir()] == ["edited.toml"]


def with_cell(tmp_path: Path, row: int, column: str, cell: str) -> Path:
    frame = pd.read_csv(THREE / "fit.csv", dtype=str).head(40)
    frame.loc[row, column] = cell
    place = tmp_path / "wrong.csv"
    frame.to_csv(place, index=False)
    return place


@pytest.mark.parametrize(
    ("row", "column", "cell", "said"),
    [
        (5, "winch_speed_2", "fast", "line 7"),
        (39, "winch_speed_2", "nan", "line 41"),
        (5, "time", "0.001", "line 7"),
        (5, "x", "12m", "line 7"),
    ],
)
def test_a_wrong_recording_is_one_line_and_nothing_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], row: int, column: str, cell: str, said: str
) -> None:
    recording = with_cell(tmp_path, row, column, cell)
    assert run(["trace", ROBOT, str(recording), "--out", str(tmp_path / "out")]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert said in captured.err
    assert [path.name for path in tmp_path.iterdir()] == ["wrong.csv"]


def test_a_missing_column_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place = tmp_path / "wrong.csv"
    pd.read_csv(THREE / "fit.csv").drop(columns="winch_speed_3").to_csv(place, index=False)
    assert run(["trace", ROBOT, str(place), "--out", str(tmp_path / "out")]) == 2
    assert "winch_speed_3" in capsys.readouterr().err


def test_cables_that_cannot_hold_the_platform_build_no_fmus(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = Path(ROBOT).read_text(encoding="utf-8")
    robot_file = tmp_path / "two.toml"
    robot_file.write_text(text[: text.rindex("[[cable]]")], encoding="utf-8")
    assert run(["build", str(robot_file), "--out", str(tmp_path / "out")]) == 2
    assert "it is 28.9 m beside it" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "arguments",
    [
        ["build"],
        ["fly", ROBOT],
        ["build", ROBOT, "--sideways"],
        ["linearise", ROBOT, "--at", "here", "--out", "m.json"],
        ["simulate", ROBOT, "--speeds", str(THREE / "fit.csv"), "--step", "0", "--out", "r.csv"],
        ["simulate", ROBOT, "--speeds", str(THREE / "fit.csv"), "--until", "-1", "--out", "r.csv"],
        ["trace", ROBOT, str(THREE / "fit.csv"), "--alpha", "2", "--out", "f"],
        ["linearise", ROBOT, "--at", "nan,0,0", "--out", "m.json"],
        ["linearise", ROBOT, "--at", "0,50,50", "--out", "m.json"],
        ["linearise", ROBOT, "--at", "-30,0,5", "--out", "m.json"],
        ["simulate", ROBOT, "--speeds", str(THREE / "fit.csv"), "--until", "nan", "--out", "r.csv"],
        ["simulate", ROBOT, "--speeds", str(THREE / "fit.csv"), "--tolerance", "0", "--out", "r.csv"],
        ["simulate", ROBOT, "--speeds", str(THREE / "fit.csv"), "--patience", "nan", "--out", "r.csv"],
    ],
)
def test_wrong_usage_is_one_line(
    arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(arguments) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_check_tells_everything_and_fails(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot = edited(tmp_path, "mass = 300.0", "mas = 300.0")
    recording = with_cell(tmp_path, 5, "x", "12m")
    assert run(["check", str(robot), str(recording)]) == 2
    captured = capsys.readouterr()
    assert [line.partition(": line ")[0] for line in captured.out.splitlines()] == [str(robot)] * 2 + [str(recording)]
    assert "correct 3 problems in 2 files" in captured.err
    assert run(["check", str(robot), str(recording), "--json"]) == 2
    problems = json.loads(capsys.readouterr().out)["problems"]
    assert problems[-1]["line"] == 7
    assert run(["check", ROBOT, str(THREE / "fit.csv")]) == 0
    assert "no problems found" in capsys.readouterr().out


def test_an_input_is_never_overwritten(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot, recording = tmp_path / "robot.toml", tmp_path / "fit.csv"
    robot.write_text(Path(ROBOT).read_text(encoding="utf-8"), encoding="utf-8")
    recording.write_text((THREE / "fit.csv").read_text(encoding="utf-8"), encoding="utf-8")
    before = robot.read_bytes(), recording.read_bytes()
    for arguments in (
        ["trace", str(robot), str(recording), "--out", str(tmp_path)],
        ["simulate", str(robot), "--speeds", str(recording), "--out", str(recording)],
        ["linearise", str(robot), "--out", str(robot)],
    ):
        assert run(arguments) == 2
        assert "is an input" in capsys.readouterr().err
    assert (robot.read_bytes(), recording.read_bytes()) == before


def test_too_few_samples_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place = tmp_path / "short.csv"
    pd.read_csv(THREE / "fit.csv").head(150).to_csv(place, index=False)
    assert run(["trace", ROBOT, str(place), "--out", str(tmp_path / "out")]) == 2
    assert "at least 100 samples" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("platform=absent.fmu", ["absent.fmu", "FMU platform", "no such file", "check the path"]),
        ("cable_9=a.fmu", ["--fmu", "'cable_9=a.fmu'", "winch_3"]),
        ("robot.toml", ["--fmu", "names no slot"]),
    ],
)
def test_a_wrong_fmu_is_one_line_and_nothing_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], given: str, words: list[str]
) -> None:
    arguments = ["simulate", ROBOT, "--speeds", str(THREE / "fit.csv"), "--out", str(tmp_path / "out.csv")]
    assert run([*arguments, "--fmu", given]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert not [word for word in words if word not in captured.err], captured.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.validate
def test_a_port_that_is_missing_is_named_before_anything_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["build", ROBOT, "--out", str(tmp_path)]) == 0
    capsys.readouterr()
    arguments = ["simulate", ROBOT, "--speeds", str(THREE / "fit.csv"), "--out", str(tmp_path / "out.csv")]
    assert run([*arguments, "--fmu", f"platform={tmp_path / 'cable_1.fmu'}"]) == 2
    stderr = capsys.readouterr().err
    assert "cable_1.fmu: cannot be the FMU platform: position.x is a Real input; make it a Real output in m" in stderr
    assert not (tmp_path / "out.csv").exists()


@pytest.mark.validate
def test_build_does_not_write_over_a_users_fmu(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["build", ROBOT, "--out", str(tmp_path)]) == 0
    robot = str(edited(tmp_path, "[platform]", "[fmu]\nplatform = 'platform.fmu'\n\n[platform]"))
    assert run(["build", robot, "--out", str(tmp_path)]) == 2
    assert "is an input" in capsys.readouterr().err
    assert run(["build", robot, "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out" / "platform.fmu").read_bytes() == (tmp_path / "platform.fmu").read_bytes()


@pytest.mark.parametrize(
    ("arguments", "name", "hint"),
    [
        (["simulate", ROBOT, "--speeds", str(THREE / "fit.csv")], "r.xlsx", "give --out r.csv or r.parquet"),
        (["linearise", ROBOT], "r.XLSX", "give --out r.json"),
        (["workspace", ROBOT], "r.xlsx", "give --out r.csv"),
        (["excite", ROBOT], "r.parquet", "give --out r.csv"),
    ],
)
def test_a_name_that_promises_another_format_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], name: str, hint: str
) -> None:
    assert run([*arguments, "--out", str(tmp_path / name)]) == 2
    captured = capsys.readouterr()
    assert captured.err.count("\n") == 1
    assert f"{name}: ends in {Path(name).suffix.lower()}, which is not written here; {hint}" in captured.err
    assert not list(tmp_path.iterdir())
