"""What commands say is to be done next: one line, the last, with a command that is one."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest
from scipy.io import savemat
from typer.main import get_command

from tautwire.cli import app, run
from tautwire.recordings.recording import read_recording
from tests.support.robots import EXAMPLES

THREE = EXAMPLES / "three"
ROBOT, FIT = str(THREE / "robot.toml"), str(THREE / "fit.csv")
PROGRAMS = ["--effects", "damping,payload", "--programs", "2", "--duration", "1", "--rate", "20"]

CASES = {
    "new": (["new", "hall"], "check hall.toml"),
    "example": (["example", "three"], "check three/robot.toml three/fit.csv"),
    "check": (["check", ROBOT], f"build {ROBOT} --out build/"),
    "check a recording": (["check", ROBOT, FIT], f"trace {ROBOT} {FIT} --out report/"),
    "columns": (["columns", FIT, ROBOT], f"columns {FIT} {ROBOT} --out columns.toml"),
    "columns, a table": (
        ["columns", FIT, ROBOT, "--out", "columns.toml"],
        f"check {ROBOT} {FIT} --columns columns.toml",
    ),
    "build": (["build", ROBOT, "--out", "fmus"], f"fmus {ROBOT}"),
    "fmus": (["fmus", ROBOT], f"build {ROBOT} --out build/"),
    "simulate": (
        ["simulate", ROBOT, "--speeds", FIT, "--until", "0.1", "--out", "result.csv"],
        f"trace {ROBOT} {FIT} --out report/",
    ),
    "excite": (["excite", ROBOT, *PROGRAMS, "--out", "out.csv"], f"trace {ROBOT} RECORDING.csv --out report/"),
    "material": (["material", "--robot", ROBOT, "--out", "rope"], "check rope/robot.toml RECORDING.csv"),
}


@pytest.mark.validate(but=[case for case in CASES if case != "material"])
@pytest.mark.parametrize("case", CASES)
def test_the_last_line_names_a_command_that_is_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], case: str
) -> None:
    arguments, expected = CASES[case]
    monkeypatch.chdir(tmp_path)
    assert run(arguments) == 0
    captured = capsys.readouterr()
    assert "next: " not in captured.out
    *before, last = captured.err.splitlines()
    assert last.startswith("next: ") and not [line for line in before if line.startswith("next: ")]
    (named,) = re.findall(r"tautwire (.+?)(?:,|;|$)", last)
    assert named == expected
    name, *given = named.split()
    # What is asked of the command is there, and it knows all that it is given.
    get_command(app).commands[name].make_context(name, given)  # type: ignore[attr-defined]


@pytest.mark.parametrize("unknown", ["log", "tracker"])
def test_a_file_of_unknown_columns_is_refused_with_the_command_that_proposes_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], unknown: str
) -> None:
    monkeypatch.chdir(tmp_path)
    log = FIT if unknown == "tracker" else "my log.csv"
    Path("my log.csv").write_text("t_ms,c1,c2\n0,1,2\n10,2,3\n", encoding="utf-8")
    Path("tracker.csv").write_text("Zeit,X,Y,Z\n0,1,2,3\n10,2,3,4\n", encoding="utf-8")
    assert run(["check", ROBOT, log, "--tracker", "tracker.csv"]) == 2
    (problem,) = capsys.readouterr().out.splitlines()
    command = problem.partition("what the columns are: tautwire ")[2]
    assert shlex.split(command) == ["columns", log, ROBOT, "--tracker", "tracker.csv"]
    assert run(shlex.split(command)) == 0


def test_one_winch_that_is_missing_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "log.csv"
    log.write_text("time,winch_speed_1,rope_length_3\n0,1,2\n1,2,3\n", encoding="utf-8")
    assert run(["check", ROBOT, str(log)]) == 2
    (problem,) = capsys.readouterr().out.splitlines()
    assert "the column winch_speed_2 is missing" in problem and "propose" not in problem


@pytest.mark.validate
def test_paths_with_spaces_are_one_word_of_the_suggested_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    robot, fit = tmp_path / "my robot's.toml", tmp_path / "fit 1.csv"
    shutil.copyfile(ROBOT, robot)
    shutil.copyfile(FIT, fit)
    for arguments, expected in (
        (["check", str(robot), str(fit)], ["trace", str(robot), str(fit), "--out", "report/"]),
        (["fmus", str(robot)], ["build", str(robot), "--out", "build/"]),
    ):
        assert run(arguments) == 0
        (named,) = re.findall(r"tautwire (.+?)(?:;|$)", capsys.readouterr().err.splitlines()[-1])
        assert shlex.split(named) == expected


@pytest.mark.validate(only=["build---quiet", "simulate"])
@pytest.mark.parametrize("how", ["--json", "--quiet"])
@pytest.mark.parametrize("case", ["new", "example", "check", "build", "fmus", "simulate"])
def test_nothing_of_it_is_for_machines(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], case: str, how: str
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run([*CASES[case][0], how]) == 0
    captured = capsys.readouterr()
    assert "next: " not in captured.out + captured.err


@pytest.mark.validate
def test_from_a_new_robot_on_each_line_leads_to_the_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    arguments, gone = ["new", "hall"], []
    while arguments[0] not in gone:
        gone.append(arguments[0])
        assert run(arguments) == 0
        last = capsys.readouterr().err.splitlines()[-1]
        arguments = re.findall(r"tautwire (.+?)(?:,|;|$)", last)[0].split()
    assert gone == ["new", "check", "build", "fmus"]
    assert (tmp_path / "build" / "hall.ssp").exists()


def test_a_recording_without_outputs_is_simulated_not_traced(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    speeds = tmp_path / "speeds.csv"
    pd.read_csv(FIT, usecols=["time", "winch_speed_1", "winch_speed_2", "winch_speed_3"], nrows=50).to_csv(speeds)
    assert run(["check", ROBOT, str(speeds)]) == 0
    assert f"next: tautwire simulate {ROBOT} --speeds {speeds} --out run.csv\n" in capsys.readouterr().err


def test_a_checked_recording_is_traced_against_a_second_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["check", ROBOT, FIT]) == 0
    assert (
        capsys.readouterr()
        .err.splitlines()[-1]
        .endswith("; with a second recording of the robot add --check SECOND.csv")
    )


def test_the_second_recording_is_asked_for_in_the_format_of_the_first(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = read_recording(FIT, 3).frame()
    path = tmp_path / "fit.mat"
    savemat(path, {name: recording[name].to_numpy() for name in recording.columns})
    assert run(["check", ROBOT, str(path)]) == 0
    assert capsys.readouterr().err.splitlines()[-1].endswith("add --check SECOND.mat")


def test_the_papers_page_is_to_be_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    result = SimpleNamespace(counts={"reproduced": 1}, entries=(1,))
    monkeypatch.setattr("tautwire.paper.write_paper", lambda folder, *_: result)
    out = tmp_path / "paper"
    assert run(["paper", "--out", str(out)]) == 0
    assert capsys.readouterr().err.splitlines() == ["1 reproduced", f"next: open {out / 'claims.html'} in a browser"]


def test_the_next_step_after_an_error_is_to_correct_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot = tmp_path / "robot.toml"
    robot.write_text(Path(ROBOT).read_text(encoding="utf-8").replace("mass", "mas", 1), encoding="utf-8")
    assert run(["check", str(robot)]) == 2
    assert re.search(
        r"^next: correct \d problems? in 1 file, then run this again$", capsys.readouterr().err, re.MULTILINE
    )
