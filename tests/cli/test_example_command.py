"""``tautwire example``: examples listed, copied whole, and never over files that are there."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tautwire.cli import run
from tautwire.cli.robot_file_commands import EXAMPLE_FILES, EXAMPLES
from tests.support import robots


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_every_shipped_example_is_listed(capsys: pytest.CaptureFixture[str]) -> None:
    shipped = {folder.name for folder in robots.EXAMPLES.iterdir() if (folder / "robot.toml").exists()}
    assert set(EXAMPLES) == shipped
    assert run(["example"]) == 0
    captured = capsys.readouterr()
    assert {line.split()[0] for line in captured.out.splitlines()} == shipped
    assert captured.err == "next: tautwire example three\n"
    assert run(["example", "--json"]) == 0
    assert set(json.loads(capsys.readouterr().out)["examples"]) == shipped


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_is_copied_as_it_ships(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["example", name]) == 0
    copied = {path.name: path.read_bytes() for path in Path(name).iterdir()}
    assert copied == {path.name: path.read_bytes() for path in (robots.EXAMPLES / name).iterdir()}
    captured = capsys.readouterr()
    assert captured.out.split() == [f"{name}/{file}" for file in EXAMPLE_FILES]
    assert captured.err == f"next: tautwire check {name}/robot.toml {name}/fit.csv\n"


def test_a_folder_may_be_named_and_have_other_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "notes.txt").write_text("mine", encoding="utf-8")
    assert run(["example", "caroca", ".", "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document == {"robot": "robot.toml", "recordings": ["fit.csv", "check.csv"], "plan": "plan.toml"}
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*EXAMPLE_FILES, "notes.txt"])
    assert run(["example", "three", "a/b", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "") and Path("a/b/check.csv").exists()


@pytest.mark.parametrize("file", EXAMPLE_FILES)
def test_no_file_is_replaced(file: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("three").mkdir()
    mine = Path("three") / file
    mine.write_text("mine", encoding="utf-8")
    assert run(["example", "three"]) == 2
    assert capsys.readouterr().err == (
        f"tautwire: {mine}: exists already; choose another folder: tautwire example three FOLDER\n"
    )
    assert mine.read_text(encoding="utf-8") == "mine" and list(Path("three").iterdir()) == [mine]


def test_a_file_is_no_folder_to_copy_to(capsys: pytest.CaptureFixture[str]) -> None:
    Path("three").write_text("mine", encoding="utf-8")
    assert run(["example", "three"]) == 2
    assert "three: is a file; choose another folder" in capsys.readouterr().err
    assert Path("three").read_text(encoding="utf-8") == "mine"


def test_an_unknown_example_is_refused_with_the_names_of_all(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["example", "four"]) == 2
    names = ", ".join(EXAMPLES)
    assert capsys.readouterr().err == (
        f"tautwire: NAME: 'four' is not an example; give one of {names}; example: tautwire example three\n"
    )
    assert list(tmp_path.iterdir()) == []
