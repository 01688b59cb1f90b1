"""Commands that build and run native FMUs."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pandas as pd
import pytest

from tautwire.cli import run
from tautwire.fmus.native.c_toolchain import THIS_PLATFORM
from tautwire.robot.robot_file_writer import write_robot
from tests.support.robots import example


@pytest.fixture
def robot_file(tmp_path: Path) -> Path:
    write_robot(example("three"), tmp_path / "robot.toml")
    return tmp_path / "robot.toml"


@pytest.mark.validate(but=["2"])
@pytest.mark.parametrize(("fmi", "folder"), [(2, THIS_PLATFORM), (3, "")])
def test_build_writes_libraries_and_source_without_python(
    robot_file: Path, fmi: int, folder: str, tmp_path: Path
) -> None:
    assert run(["build", str(robot_file), "--out", str(tmp_path / "out"), "--native", "--fmi", str(fmi)]) == 0
    with zipfile.ZipFile(tmp_path / "out" / "three.ssp") as archive:
        assert {"resources/cable_1.fmu", "resources/platform.fmu"} <= set(archive.namelist())
    with zipfile.ZipFile(tmp_path / "out" / "cable_1.fmu") as archive:
        names = archive.namelist()
    assert not [name for name in names if name.endswith(".py")]
    assert "sources/all.c" in names
    assert [name for name in names if name.startswith(f"binaries/{folder}")]


@pytest.mark.validate(but=["both"])
@pytest.mark.parametrize("options", [[], ["--co-simulation-only"]], ids=["both", "alone"])
def test_build_leaves_model_exchange_out_by_an_option(robot_file: Path, options: list[str], tmp_path: Path) -> None:
    assert run(["build", str(robot_file), "--out", str(tmp_path / "out"), "--native", *options]) == 0
    interface = fmpy.read_model_description(str(tmp_path / "out" / "platform.fmu")).modelExchange
    assert (interface is None) == bool(options)


@pytest.mark.validate
def test_build_writes_the_whole_robot_as_one_fmu(
    robot_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["build", str(robot_file), "--out", str(tmp_path / "out"), "--native", "--whole", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["fmus"] == {"robot": str(tmp_path / "out" / "robot.fmu")}
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["robot.fmu"]


def test_a_robot_file_that_asks_for_native_fmus_takes_their_options(robot_file: Path, tmp_path: Path) -> None:
    native = tmp_path / "native.toml"
    native.write_text(robot_file.read_text(encoding="utf-8") + "\n[fmu]\nnative = true\n", encoding="utf-8")
    assert run(["build", str(native), "--out", str(tmp_path / "out"), "--whole"]) == 0


def test_simulate_runs_native_fmus_to_the_same_result(robot_file: Path, tmp_path: Path) -> None:
    speeds = {f"winch_speed_{i}": [0.0, 0.05 * i, 0.0] for i in (1, 2, 3)}
    pd.DataFrame({"time": [0.0, 0.2, 0.4]} | speeds).to_csv(tmp_path / "speeds.csv", index=False)
    call = ["simulate", str(robot_file), "--speeds", str(tmp_path / "speeds.csv"), "--out"]
    results = []
    for options in ([], ["--native"]):
        result = tmp_path / "result.csv"
        assert run([*call, str(result), *options]) == 0
        results.append(pd.read_csv(result).to_numpy())
    assert results[0] == pytest.approx(results[1], rel=1e-10, abs=1e-10)
    assert np.ptp(results[0][:, 1]) > 1e-6


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--native", "--for-c-hosts"], ["--for-c-hosts", "leave it out"]),
        (["--platforms", "win64"], ["--platforms", "add --native"]),
        (["--native", "--platforms", "amiga"], ["'amiga'", "linux64"]),
        (["--whole"], ["--whole", "add --native"]),
        (["--fmi", "3"], ["--fmi", "--native"]),
        (["--co-simulation-only"], ["--co-simulation-only", "--native"]),
        (["--native", "--fmi", "4"], ["--fmi", "is 4"]),
    ],
)
def test_options_that_do_not_fit_are_refused(
    robot_file: Path, options: list[str], words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["build", str(robot_file), "--out", str(tmp_path / "out"), *options]) == 2
    message = capsys.readouterr().err
    assert all(word in message for word in words), message
    assert not (tmp_path / "out").exists()
