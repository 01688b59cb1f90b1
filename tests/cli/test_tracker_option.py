"""Commands take positions from a tracker's file beside the winches' log."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest

from tautwire.cli import run
from tautwire.recordings.recording import read_recording
from tests.support.robots import EXAMPLES
from tests.support.trackers import split

THREE = EXAMPLES / "three"
ROBOT = str(THREE / "robot.toml")
TABLE = "[recording.tracker.columns]\n" + "".join(f'{axis} = {{ name = "P{axis}", unit = "mm" }}\n' for axis in "xyz")


@pytest.fixture
def files(tmp_path: Path) -> tuple[str, str, str]:
    """A log, a tracker's file in mm, and the table of its columns."""
    log, tracker = split(read_recording(THREE / "fit.csv", 3).first(2000), 60.0, 5.25, 1.0)
    log_file, tracker_file, columns = (tmp_path / name for name in ("log.csv", "tracker.csv", "columns.toml"))
    log.frame().drop(columns=["x", "y", "z"]).to_csv(log_file, index=False)
    positions = {f"P{axis}": 1e3 * tracker.position[:, i] for i, axis in enumerate("xyz")}
    pd.DataFrame({"time": tracker.time, **positions}).to_csv(tracker_file, index=False, sep=";")
    columns.write_text(TABLE, encoding="utf-8")
    return str(log_file), str(tracker_file), str(columns)


def test_check_tells_the_clock_that_it_found(files: tuple[str, str, str], capsys: pytest.CaptureFixture[str]) -> None:
    log, tracker, columns = files
    page = Path(log).with_name("check.html")
    options = ["--tracker", tracker, "--columns", columns]
    assert run(["check", ROBOT, log, *options, "--report", str(page)]) == 0
    captured = capsys.readouterr()
    assert f"{log}: positions are from {tracker}, whose clock shows 5.2" in captured.err
    assert "from winch travel, +- 0." in captured.err
    assert f"--columns {columns} --tracker {tracker}" in captured.err
    assert f"{tracker}: no problems found" in captured.out
    assert tracker in page.read_text(encoding="utf-8")


def test_check_lists_problems_of_the_trackers_file(
    files: tuple[str, str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    log, tracker, columns = files
    text = Path(tracker).read_text(encoding="utf-8").splitlines()
    text[7], text[9] = "x" + text[7], "y" + text[9]
    Path(tracker).write_text("\n".join(text), encoding="utf-8")
    assert run(["check", ROBOT, log, "--tracker", tracker, "--columns", columns, "--json"]) == 2
    (problem,) = json.loads(capsys.readouterr().out)["problems"]
    assert (problem["file"], problem["line"]) == (tracker, 8)
    Path(columns).write_text(TABLE.replace("mm", "ms"), encoding="utf-8")
    assert run(["check", ROBOT, log, "--tracker", tracker, "--columns", columns]) == 2
    assert f"{columns}: line 2, recording.tracker.columns.x.unit: is 'ms'" in capsys.readouterr().out


def test_a_tracker_in_another_unit_is_refused(files: tuple[str, str, str], capsys: pytest.CaptureFixture[str]) -> None:
    log, tracker, columns = files
    Path(columns).write_text(TABLE.replace(', unit = "mm"', ""), encoding="utf-8")
    for command in (["check"], ["trace", "--out", str(Path(log).with_name("report"))]):
        name, *out = command
        assert run([name, ROBOT, log, "--tracker", tracker, "--columns", columns, *out]) == 2
        captured = capsys.readouterr()
        text = captured.out + captured.err
        assert "match the winch travel at no offset of its clock, but do if its x, y, z are in" in text


def test_a_tracker_without_its_log_is_refused(files: tuple[str, str, str], capsys: pytest.CaptureFixture[str]) -> None:
    log, tracker, _ = files
    assert run(["check", ROBOT, "--tracker", tracker]) == 2
    assert "--tracker: is given without a recording" in capsys.readouterr().err
    out = str(Path(log).with_name("report"))
    assert run(["trace", ROBOT, log, "--out", out, "--check-tracker", tracker]) == 2
    assert "--check-tracker: is given without --check" in capsys.readouterr().err
