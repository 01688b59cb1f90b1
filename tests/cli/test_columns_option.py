"""Commands read recordings with the laboratory's names, by the robot file or a file of its own."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from tautwire.cli import run
from tests.support.robots import EXAMPLES

THREE = EXAMPLES / "three"
NAMES = {"time": "t_ms"} | {f"winch_speed_{i}": f"Drive{i}" for i in (1, 2, 3)}
TABLE = (
    '[recording.columns]\ntime = { name = "t_ms", unit = "ms" }\n"winch_speed_{}" = { name = "Drive{}", sign = -1 }\n'
)


def laboratory_file(folder: Path) -> str:
    frame = pd.read_csv(THREE / "fit.csv", nrows=400)
    speeds = {name: -frame[name] for name in NAMES if name != "time"}
    frame.assign(time=frame.time * 1e3, **speeds).rename(columns=NAMES).to_csv(folder / "log.csv", index=False)
    return str(folder / "log.csv")


@pytest.mark.validate
@pytest.mark.parametrize("is_own_file", [True, False])
def test_check_and_simulate_read_columns(is_own_file: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log, robot = laboratory_file(tmp_path), tmp_path / "robot.toml"
    own = tmp_path / "columns.toml"
    own.write_text(TABLE, encoding="utf-8")
    text = (THREE / "robot.toml").read_text(encoding="utf-8")
    robot.write_text(text if is_own_file else f"{text}\n{TABLE}", encoding="utf-8")
    options = ["--columns", str(own)] if is_own_file else []
    assert run(["check", str(robot), log, *options]) == 0
    captured = capsys.readouterr()
    assert "winch_speed_{} is 'Drive{}' with its sign changed" in captured.err
    if is_own_file:
        assert f"--columns {own}" in captured.err
    result, standard = tmp_path / "result.csv", tmp_path / "standard.csv"
    run_options = ["--until", "0.2", "--out"]
    assert run(["simulate", str(robot), "--speeds", log, *options, *run_options, str(result)]) == 0
    shipped = str(THREE / "fit.csv")
    assert run(["simulate", str(THREE / "robot.toml"), "--speeds", shipped, *run_options, str(standard)]) == 0
    pd.testing.assert_frame_equal(pd.read_csv(result), pd.read_csv(standard), rtol=1e-6, atol=1e-8)


def test_check_tells_a_wrong_unit_with_its_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log, own = laboratory_file(tmp_path), tmp_path / "columns.toml"
    own.write_text(TABLE.replace('"ms"', '"mm"'), encoding="utf-8")
    assert run(["check", str(THREE / "robot.toml"), log, "--columns", str(own)]) == 2
    assert f"{own}: line 2, recording.columns.time.unit: is 'mm', not a known unit of time" in capsys.readouterr().out


@pytest.mark.validate
def test_columns_of_a_robot_file_are_read_from_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log, other = laboratory_file(tmp_path), tmp_path / "other.toml"
    other.write_text((THREE / "robot.toml").read_text(encoding="utf-8") + "\n" + TABLE, encoding="utf-8")
    robot = str(THREE / "robot.toml")
    assert run(["check", robot, log, "--columns", str(other)]) == 0
    result = ["--until", "0.05", "--out", str(tmp_path / "result.csv")]
    assert run(["simulate", robot, "--speeds", log, "--columns", str(other), *result]) == 0
    assert f"--columns {other} --out report/" in capsys.readouterr().err


def test_columns_that_would_not_be_read_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    own = tmp_path / "columns.toml"
    own.write_text(TABLE, encoding="utf-8")
    assert run(["check", str(THREE / "robot.toml"), "--columns", str(own)]) == 2
    assert "--columns: is given without a recording" in capsys.readouterr().err


def test_a_log_with_a_column_of_frequencies_is_no_test_of_a_rope(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own, log = tmp_path / "columns.toml", tmp_path / "log.csv"
    own.write_text(TABLE, encoding="utf-8")
    log.write_text("t_ms,frequency,Drive1,Drive2,Drive3\n0,50,0.1,fast,0.1\n20,50,0.1,0.1,0.1\n", encoding="utf-8")
    arguments = ["trace", str(THREE / "robot.toml"), str(log), "--columns", str(own), "--out", str(tmp_path / "report")]
    assert run(arguments) == 2
    assert f"{log}: line 2, column winch_speed_2: is 'fast'" in capsys.readouterr().err
