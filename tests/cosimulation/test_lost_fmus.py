"""The command line with a user's FMU that hangs or dies: one line says which, the run until then stays."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from tautwire.cli import run
from tests.support.faults import FAULT, NUMBERS, build_faulty
from tests.support.progress import without_progress_lines
from tests.support.robots import EXAMPLES


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The three-cable robot with the faulty winch at its second cable, and a second of slow speeds."""
    folder = tmp_path_factory.mktemp("robot")
    build_faulty(folder)
    text = (EXAMPLES / "three" / "robot.toml").read_text(encoding="utf-8")
    (folder / "robot.toml").write_text(text + '\n[fmu]\nwinch_2 = "Faulty.fmu"\n', encoding="utf-8")
    times = np.linspace(0.0, 1.0, 11)
    speeds = {f"winch_speed_{cable}": 0.01 * cable * times for cable in (1, 2, 3)}
    pd.DataFrame({"time": times, **speeds}).to_csv(folder / "speeds.csv", index=False)
    return folder


@pytest.fixture
def scratch(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where all temporary files go."""
    folder = tmp_path / "scratch"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    monkeypatch.setenv("TMPDIR", str(folder))
    return folder


def arguments(robot: Path, out: Path, *more: str) -> list[str]:
    files = [str(robot / "robot.toml"), "--speeds", str(robot / "speeds.csv"), "--out", str(out)]
    return ["simulate", *files, *more]


@pytest.mark.validate(but=["crash"])
@pytest.mark.parametrize(
    ("how", "fate"),
    [
        ("hang", "did not return for 1 s"),
        ("crash", "ended its process by SIGSEGV"),
        ("leave", "ended its process with exit status 3"),
    ],
)
def test_the_run_until_then_is_written(
    robot: Path,
    scratch: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    how: str,
    fate: str,
) -> None:
    out = scratch.parent / "result.csv"
    monkeypatch.setenv(FAULT, f"winch_2:step:{how}:0.55")
    assert run(arguments(robot, out, *(["--patience", "1"] if how == "hang" else []))) == 1
    stderr = without_progress_lines(capsys.readouterr().err)
    assert stderr.count("\n") == 1
    assert stderr.startswith(
        f"tautwire: FMU winch_2: fmi2DoStep {fate} at 0.55 s with speed_command=0.0111; it logged: "
    )
    assert stderr.endswith(f"; the run up to then is in {out}\n")
    assert pd.read_csv(out)["time"].tolist() == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4, 0.5])
    assert sorted(path.name for path in scratch.parent.iterdir()) == [
        "result.csv",
        "result.csv-metadata.json",
        "scratch",
    ]
    assert list(scratch.iterdir()) == []


@pytest.mark.validate
def test_the_run_of_a_controller_until_then_is_written(
    robot: Path, scratch: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    out = scratch.parent / "result.csv"
    (scratch / "law.py").write_text("def controller(time, measured):\n    return [0.0, 0.0, 0.0]\n", encoding="utf-8")
    (scratch / "path.toml").write_text("end = [28.9, 0.05, 5.1]\nduration = 1.0\n", encoding="utf-8")
    files = ["--controller", str(scratch / "law.py"), "--path", str(scratch / "path.toml"), "--out", str(out)]
    assert run(["simulate", str(robot / "robot.toml"), *files, "--until", "0.02"]) == 0
    assert "ports have no unit" in capsys.readouterr().err
    monkeypatch.setenv(FAULT, "winch_2:step:crash:0.105")
    assert run(["simulate", str(robot / "robot.toml"), *files]) == 1
    stderr = capsys.readouterr().err
    assert "FMU winch_2" in stderr and stderr.endswith(f"; the run up to then is in {out}\n")
    assert pd.read_csv(out)["time"].to_numpy() == pytest.approx(np.arange(12) * 0.01)


@pytest.mark.validate
def test_nothing_is_written_where_nothing_was_computed(
    robot: Path, scratch: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv(FAULT, "winch_2:enter:crash:0")
    assert run(arguments(robot, scratch.parent / "result.csv")) == 1
    stderr = capsys.readouterr().err
    assert stderr == "tautwire: FMU winch_2: fmi2EnterInitializationMode ended its process by SIGSEGV at 0 s\n"
    assert [path.name for path in scratch.parent.iterdir()] == ["scratch"]
    assert list(scratch.iterdir()) == []


@pytest.mark.validate
@pytest.mark.skipif(sys.platform == "win32", reason="needs process groups")
def test_ctrl_c_ends_a_run_that_hangs(robot: Path, scratch: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    numbers = scratch.parent / "numbers"
    monkeypatch.setenv(NUMBERS, str(numbers))
    monkeypatch.setenv(FAULT, "winch_2:step:hang:0.55")
    command = [sys.executable, "-m", "tautwire.cli", *arguments(robot, scratch.parent / "result.csv")]
    # As from a terminal: to all processes of the group.
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    begun = time.monotonic()
    while not numbers.exists() and time.monotonic() - begun < 60.0:
        time.sleep(0.05)
    time.sleep(1.5)
    os.killpg(process.pid, signal.SIGINT)
    stdout, stderr = process.communicate(timeout=20)
    assert (process.returncode, stdout) == (1, "")
    assert without_progress_lines(stderr) == "tautwire: interrupted; nothing was written\n"
    assert sorted(path.name for path in scratch.parent.iterdir()) == ["numbers", "scratch"]
    assert list(scratch.iterdir()) == []
    for number in numbers.read_text().split():
        with pytest.raises(ProcessLookupError):
            os.kill(int(number), 0)
