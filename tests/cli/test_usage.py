"""Commands used wrongly say how they are used; those that print their result need no file for it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from importlib.machinery import ModuleSpec
from pathlib import Path

import pytest

from tautwire.cli import console, run
from tests.support.robots import EXAMPLES

ROBOT = str(EXAMPLES / "three" / "robot.toml")
EXAMPLES_OF = {
    "linearise": "tautwire linearise robot.toml --at ",
    "workspace": "tautwire workspace robot.toml --out ",
    "pose": "tautwire pose robot.toml --at ",
    "simulate": "tautwire simulate robot.toml --speeds ",
    "excite": "tautwire excite robot.toml --effects ",
    "new": "tautwire new hall --cables ",
    "material": "tautwire material dma.csv --robot ",
    "campaign": "tautwire campaign plan.toml --out ",
    "paper": "tautwire paper --out ",
    "build": "tautwire build robot.toml --out ",
    "fly": "tautwire --help",
}


@pytest.mark.parametrize(
    "arguments",
    [
        ["linearise", ROBOT],
        ["linearise", ROBOT, "--out", "m.json", "--at", "1,2"],
        ["pose", ROBOT, "--rule", "fair"],
        ["pose", ROBOT, "--lengths", "1,2"],
        ["pose", ROBOT, "--lengths", "30,30,30", "--rule", "least_norm"],
        ["workspace", ROBOT],
        ["workspace", ROBOT, "--out", "w.csv", "--lower", "here"],
        ["simulate", ROBOT, "--speeds", "s.csv", "--out", "r.csv", "--step", "0"],
        ["simulate", ROBOT, "--speeds", "s.csv", "--out", "r.csv", "--fmu", "wing=a.fmu"],
        ["excite", ROBOT, "--effects", "damping", "--out", "p.csv"],
        ["new", ""],
        ["new", "hall", "--cables", "99"],
        ["material", "--out", "m", "--coverage", "0"],
        ["campaign"],
        ["campaign", "plan.toml", "--out", "rows", "--scheduler", "tcp://localhost:8786", "--workers", "2"],
        ["paper", "--step", "1"],
        ["build"],
        ["build", ROBOT, "--outt", "build"],
        ["fly"],
    ],
)
def test_wrong_usage_ends_with_an_example(
    arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == "" and captured.err.count("\n") == 1
    said, _, example = captured.err.rstrip("\n").rpartition("; example: ")
    assert said and example.startswith(EXAMPLES_OF[arguments[0]])
    assert list(tmp_path.iterdir()) == []


def test_a_wrong_file_is_reported_without_an_example(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["linearise", str(tmp_path / "none.toml"), "--out", str(tmp_path / "m.json")]) == 2
    assert "example:" not in capsys.readouterr().err


def test_linearise_prints_the_model_as_json_and_writes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["linearise", ROBOT, "--json"]) == 0
    model = json.loads(capsys.readouterr().out)
    assert len(model["A"]) == len(model["states"]) and "model" not in model
    assert list(tmp_path.iterdir()) == []
    assert run(["linearise", ROBOT, "--json", "--report", "modes.html"]) == 0
    reported = json.loads(capsys.readouterr().out)
    provenance = reported.pop("provenance"), model.pop("provenance")
    assert reported == {**model, "report": "modes.html"}
    assert provenance[0]["inputs"] == provenance[1]["inputs"]
    assert [path.name for path in tmp_path.iterdir()] == ["modes.html"]


class Truncated:
    """An importer of a module whose compiled file ends too early."""

    def find_spec(self, name: str, *_: object) -> ModuleSpec | None:
        if name == "tautwire.robot.static_pose":
            raise EOFError("marshal data too short")
        return None


def test_a_damaged_installation_is_no_interrupt(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "tautwire.robot.static_pose", raising=False)
    monkeypatch.setattr(sys, "meta_path", [Truncated(), *sys.meta_path])
    with pytest.raises(EOFError, match="marshal data too short"):
        run(["pose", ROBOT])


@pytest.mark.validate
def test_a_name_that_standard_output_cannot_encode_is_printed_escaped(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text("time,\u03bcwinch_speed_1,x\n0,1,2\n0.1,1,2\n0.2,1,2\n", encoding="utf-8")
    result = subprocess.run(
        [sys.executable, "-m", "tautwire.cli", "columns", str(log), "--cables", "1"],
        env={**os.environ, "PYTHONIOENCODING": "ascii", "PYTHONUTF8": "0"},
        capture_output=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    assert rb"\u03bcwinch_speed_1" in result.stdout


def test_a_page_links_to_a_file_on_another_drive_by_its_uri(monkeypatch: pytest.MonkeyPatch) -> None:
    def on_another_drive(path: object, start: object) -> str:
        raise ValueError("path is on mount 'C:', start on mount 'D:'")

    monkeypatch.setattr(console.os.path, "relpath", on_another_drive)
    links = console.relative_links(Path("/reports/check.html"), Path("/lab/fit.csv"))
    assert links == {"fit.csv": "file:///lab/fit.csv"}
