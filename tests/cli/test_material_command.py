"""``tautwire material`` as a user meets it."""

import json
from pathlib import Path

import pytest

from tautwire.cli import run
from tautwire.materials import PAPER_TABLE
from tautwire.robot.robot_file_reader import read_robot
from tests.support.robots import EXAMPLES

ROBOT = EXAMPLES / "three" / "robot.toml"


@pytest.mark.validate
def test_the_papers_table_is_judged_without_arguments(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["material", "--out", str(tmp_path / "out")]) == 0
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "fit.json",
        "material.png",
        "material.svg",
        "relaxation.toml",
    ]
    document = json.loads((tmp_path / "out" / "fit.json").read_text(encoding="utf-8"))
    assert document["verdict"] == "effects"
    assert document["models"][0]["modulus"] == 134.8e9
    stdout = capsys.readouterr().out
    assert "A constant pair of modulus and damping is rejected" in stdout
    assert max(len(line) for line in stdout.splitlines()) <= 80 + len(str(tmp_path))
    assert "[effect.relaxation]" in (tmp_path / "out" / "relaxation.toml").read_text(encoding="utf-8")


@pytest.mark.validate
def test_a_robot_is_written_with_the_rope_and_reads_back(tmp_path: Path) -> None:
    assert run(["material", str(PAPER_TABLE), "--robot", str(ROBOT), "--out", str(tmp_path)]) == 0
    document = json.loads((tmp_path / "fit.json").read_text(encoding="utf-8"))
    before, after = read_robot(ROBOT), read_robot(tmp_path / "robot.toml")
    assert document["models"][0]["modulus"] == before.cables[0].modulus
    assert {cable.modulus for cable in after.cables} == {document["robot"]["modulus"]}
    (setting,) = after.effects
    relaxation = document["robot"]["effect"]["relaxation"]
    assert {name: setting.values[name] for name in relaxation} == relaxation


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["none.csv"], "none.csv: there is no such file"),
        (["--at", "3"], "--at: 3 Hz is no row"),
        (["--at", "2", "--robot", str(ROBOT)], "--at: the pair in use is the robot's; give either"),
        (["--shared", "1"], "--shared: 1 is not a share below 1"),
        (["--alpha", "0"], "--alpha: 0 is not a share below 1"),
        (["--coverage", "nan"], "--coverage: nan is not positive"),
    ],
)
def test_invalid_input_is_an_error_of_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], said: str
) -> None:
    assert run(["material", *arguments, "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.startswith("tautwire: ")
    assert said in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_an_input_is_never_written_over(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = tmp_path / "fit.json"
    table.write_text(PAPER_TABLE.read_text(encoding="utf-8"), encoding="utf-8")
    assert run(["material", str(table), "--out", str(tmp_path)]) == 2
    assert "is an input" in capsys.readouterr().err


@pytest.mark.validate
def test_trace_takes_a_dynamic_test_for_a_recording(tmp_path: Path) -> None:
    assert run(["trace", str(ROBOT), str(PAPER_TABLE), "--out", str(tmp_path)]) == 0
    report = json.loads((tmp_path / "report.json").read_text(encoding="utf-8"))
    assert report["verdict"] == "effects"
    assert "relaxation" in {effect["name"] for effect in report["effects"]}
    before, after = report["error_before"]["fit"], report["error_after"]["fit"]
    assert after["damping_rms"] < before["damping_rms"]
    assert read_robot(tmp_path / "robot.toml").effects[0].name == "relaxation"
    assert (tmp_path / "cable_1.fmu").exists()


@pytest.mark.parametrize("option", [("--check", str(PAPER_TABLE)), ("--time-limit", "60")])
def test_a_dynamic_test_needs_no_check_recording_and_no_time_limit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], option: tuple[str, str]
) -> None:
    out = tmp_path / "out"
    assert run(["trace", str(ROBOT), str(PAPER_TABLE), *option, "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert f"{option[0]}: " in said and "omit it" in said
    assert not out.exists()
