"""The command line as a user meets it: exit status, one line for what is wrong, nothing written then."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

import tautwire
from tautwire.cli import app, run
from tautwire.robot.robot_file_reader import read_robot
from tests.support.progress import without_progress_lines
from tests.support.robots import EXAMPLES, example

THREE = EXAMPLES / "three"
ROBOT = str(THREE / "robot.toml")


@pytest.fixture
def short(tmp_path: Path) -> tuple[Path, Path]:
    """Four seconds of both shipped recordings, every second sample."""
    places = []
    for name in ("fit", "check"):
        place = tmp_path / f"{name}.csv"
        pd.read_csv(THREE / f"{name}.csv").iloc[:401:2].to_csv(place, index=False)
        places.append(place)
    return places[0], places[1]


def test_build_writes_the_fmus(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["build", ROBOT, "--out", str(tmp_path / "out")]) == 0
    listed = [f"cable_{i}.fmu" for i in (1, 2, 3)] + ["platform.fmu"]
    listed.append("three.ssp")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == sorted(listed)
    assert [Path(line).name for line in capsys.readouterr().out.split()] == listed


def test_simulate_answers_at_the_recordings_times(tmp_path: Path, short: tuple[Path, Path]) -> None:
    result = tmp_path / "result.csv"
    assert run(["simulate", ROBOT, "--speeds", str(short[0]), "--until", "1.0", "--out", str(result)]) == 0
    frame = pd.read_csv(result)
    recorded = pd.read_csv(short[0])
    assert list(frame["time"]) == list(recorded["time"][recorded["time"] <= 1.0])
    assert (frame["z"] - recorded["z"][: len(frame)]).abs().max() < 0.02
    assert {"vx", "tension_3", "length_1", "elongation_2", "strain_3"} <= set(frame.columns)


@pytest.mark.validate
def test_simulate_needs_only_times_and_speeds(tmp_path: Path, short: tuple[Path, Path]) -> None:
    speeds = tmp_path / "speeds.csv"
    pd.read_csv(short[0])[["time", "winch_speed_1", "winch_speed_2", "winch_speed_3"]].head(20).to_csv(
        speeds, index=False
    )
    assert run(["simulate", ROBOT, "--speeds", str(speeds), "--out", str(tmp_path / "result.csv")]) == 0
    assert len(pd.read_csv(tmp_path / "result.csv")) == 20


@pytest.mark.validate
def test_simulate_reads_and_writes_parquet(tmp_path: Path, short: tuple[Path, Path]) -> None:
    recording = tmp_path / "fit.parquet"
    pd.read_csv(short[0]).to_parquet(recording, index=False)
    results = []
    for place, speeds in ((tmp_path / "result.parquet", recording), (tmp_path / "result.csv", short[0])):
        assert run(["simulate", ROBOT, "--speeds", str(speeds), "--until", "0.5", "--out", str(place)]) == 0
        results.append(pd.read_parquet(place) if place.suffix == ".parquet" else pd.read_csv(place))
    pd.testing.assert_frame_equal(*results, rtol=1e-14)


@pytest.mark.validate
@pytest.mark.parametrize("name", ["result.csv", "result.parquet"])
def test_a_run_that_fails_leaves_what_it_had_computed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    recording, result = tmp_path / "torn.csv", tmp_path / name
    speeds = pd.DataFrame(
        {"time": [0.0, 0.1, 0.2, 0.3]} | {f"winch_speed_{i}": [0.0, 0.0, 0.0, 1e6] for i in (1, 2, 3)}
    )
    speeds.to_csv(recording, index=False)
    assert run(["simulate", ROBOT, "--speeds", str(recording), "--out", str(result)]) == 1
    stderr = capsys.readouterr().err
    assert stderr.count("\n") == 1
    assert "FMU " in stderr and f"the run up to then is in {result}" in stderr
    frame = pd.read_csv(result) if name.endswith(".csv") else pd.read_parquet(result)
    assert frame["time"].tolist() == [0.0, 0.1, 0.2]
    written = [name, "result.csv-metadata.json"] if name.endswith(".csv") else [name]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*written, "torn.csv"])


def test_linearise_writes_the_model(tmp_path: Path) -> None:
    place = tmp_path / "model.json"
    assert run(["linearise", ROBOT, "--at", "28.86,0,8", "--out", str(place)]) == 0
    model = json.loads(place.read_text())
    assert model["position"] == [28.86, 0.0, 8.0]
    assert len(model["frequencies_hz"]) == 3
    assert len(model["A"]) == len(model["states"])
    assert len(model["B"][0]) == len(model["inputs"])


def test_trace_finds_the_damping_of_the_shipped_robot(
    tmp_path: Path, short: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "report"
    assert run(["trace", ROBOT, str(short[0]), "--check", str(short[1]), "--out", str(out)]) == 0
    report = json.loads((out / "report.json").read_text())
    assert report["verdict"] == "effects"
    (effect,) = report["effects"]
    assert effect["name"] == "damping"
    assert effect["cables"] == [1, 2, 3]
    found = effect["parameters"]["damping"]
    assert found["low"] < 2.08e9 < found["high"]
    assert effect["share"] > 0.95
    assert report["left_share"] < 0.05
    assert effect["share"] + report["left_share"] <= 1.0 + 1e-12
    for role in ("fit", "check"):
        after, floor = report["error_after"][role], report["noise_floor"]
        assert after["position_rms"] < 1.2 * floor["position_rms"]
        assert after["tension_rms"] < 1.2 * floor["tension_rms"] < report["error_before"][role]["tension_rms"]
    assert report["residual_is_noise"] == {"before": False, "after": True}
    residuals = pd.read_parquet(out / "residuals.parquet")
    assert residuals["recording"].value_counts().to_dict() == {
        role: len(pd.read_csv(file)) for role, file in zip(("FIT", "CHECK"), short, strict=True)
    }
    check = residuals[residuals["recording"] == "CHECK"]
    assert (check["tension_2_innovation"] ** 2).mean() == pytest.approx(report["left"]["tension_2"], rel=1e-9)
    missed = check["x_measured"] - check["x_before"]
    assert (missed**2).mean() ** 0.5 == pytest.approx(report["error_before"]["check"]["axes"]["x"], rel=1e-9)
    captured = capsys.readouterr()
    assert "damping" in captured.out
    assert captured.err.splitlines()[-1].startswith(
        f"next: open {out / 'index.html'}; {out / 'robot.toml'} is the completed robot"
    )
    assert (out / "index.html").stat().st_size > 10_000
    again = read_robot(out / "robot.toml")
    assert again.effects[0].values["damping"] == pytest.approx(
        found["value"], abs=1e-3 * (found["high"] - found["low"])
    )
    result = tmp_path / "again.csv"
    assert run(["simulate", str(out / "robot.toml"), "--speeds", str(short[1]), "--out", str(result)]) == 0
    gap = pd.read_csv(result)["tension_1"] - pd.read_csv(short[1])["tension_1"]
    assert (gap**2).mean() ** 0.5 < 1.3 * report["noise_floor"]["tension_rms"]


@pytest.mark.validate
def test_trace_without_a_check_recording_judges_on_the_second_half(
    tmp_path: Path, short: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["trace", ROBOT, str(short[0]), "--out", str(tmp_path / "report"), "--json", "--quiet"]) == 0
    report = json.loads((tmp_path / "report" / "report.json").read_text())
    captured = capsys.readouterr()
    assert json.loads(captured.out) == {"folder": str(tmp_path / "report"), **report}
    assert captured.err == ""
    assert report["effects"][0]["name"] == "damping"
    assert report["error_after"]["check"]["position_rms"] is None
    assert any("no check recording" in note for note in report["notes"])


COMMANDS = [str(command.name) for command in app.registered_commands]


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help_with_an_example(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([command, "--help"]) == 0
    stdout = capsys.readouterr().out
    assert f"Usage: tautwire {command} " in stdout
    (example,) = [line for line in stdout.splitlines() if "Example:" in line]
    assert example.startswith(f"  Example: tautwire {command}")
    assert "--json" in stdout and "--quiet" in stdout


def test_help_is_shown_when_nothing_is_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    assert run([]) == 0
    stdout = capsys.readouterr().out
    assert all(f"\n  {command} " in stdout for command in COMMANDS)
    assert "..." not in stdout.partition("Commands:")[2]


def test_the_version_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--version"]) == 0
    assert capsys.readouterr().out == f"tautwire {tautwire.__version__}\n"


@pytest.mark.parametrize(
    ("words", "place", "offered"),
    [("tautwire li", 1, {"linearise"}), ("tautwire trace --a", 2, {"--alpha"}), ("tautwire ", 1, set(COMMANDS))],
)
def test_the_shell_completes(
    words: str, place: int, offered: set[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("_TAUTWIRE_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(place))
    with pytest.raises(SystemExit) as caught:
        run([])
    assert not caught.value.code
    assert set(capsys.readouterr().out.split()) == offered


JSON_RUNS = [
    (["build", ROBOT], "out", {"fmus", "ssp"}),
    (["simulate", ROBOT, "--speeds", str(THREE / "fit.csv"), "--until", "0.1"], "out.csv", {"result", "steps"}),
    (["linearise", ROBOT], "out.json", {"model", "A", "frequencies_hz"}),
    (["workspace", ROBOT, "--spacing", "40"], "out.csv", {"workspace", "feasible"}),
    (["excite", ROBOT, "--effects", "damping,payload", "--programs", "2", "--duration", "1"], "out.csv", {"pairs"}),
]


@pytest.mark.validate(but=["linearise", "workspace"])
@pytest.mark.parametrize(("arguments", "out", "keys"), JSON_RUNS, ids=[case[0][0] for case in JSON_RUNS])
def test_json_is_one_object_and_quiet_is_silent(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], out: str, keys: set[str]
) -> None:
    place = str(tmp_path / out)
    assert run([*arguments, "--out", place, "--json", "--quiet"]) == 0
    captured = capsys.readouterr()
    document = json.loads(captured.out)
    assert keys <= set(document)
    assert place in captured.out
    assert captured.err == ""
    assert_provenance_written(tmp_path, document)
    assert run([*arguments, "--out", place, "--quiet"]) == 0
    assert tuple(capsys.readouterr()) == ("", "")


def assert_provenance_written(folder: Path, document: dict[str, Any]) -> None:
    """Each file that holds text names the command and the hashes of its inputs; an FMU has the version alone."""
    files = [path for path in folder.rglob("*") if path.suffix in (".csv", ".json", ".toml")]
    metadata = [path.with_name(f"{path.name}-metadata.json") for path in files if path.suffix == ".csv"]
    for file in [*metadata, *(path for path in files if path.suffix != ".csv")]:
        text = file.read_text(encoding="utf-8")
        assert f"tautwire {document['provenance']['command'].split()[1]} " in text, file
        assert all(digest in text for digest in document["provenance"]["inputs"].values()), file


@pytest.mark.validate
def test_excite_tells_the_forms_of_an_effect_apart(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    program = str(tmp_path / "program.csv")
    assert (
        run(["excite", ROBOT, "--effects", "payload,drum", "--programs", "2", "--duration", "1", "--out", program]) == 0
    )
    pairs = [line.partition(":")[0] for line in capsys.readouterr().out.splitlines() if "separation" in line]
    assert len(set(pairs)) == len(pairs) > 1
    assert all("drum (" in pair for pair in pairs)


@pytest.mark.validate
def test_nothing_is_coloured_that_is_no_terminal(tmp_path: Path) -> None:
    process = subprocess.run(
        [sys.executable, "-m", "tautwire.cli", "material", "--out", str(tmp_path / "out")],
        capture_output=True,
        check=True,
    )
    assert process.stdout and b"\x1b" not in process.stdout + process.stderr


def test_shipped_robots_are_read(capsys: pytest.CaptureFixture[str]) -> None:
    assert [example(name).cable_count for name in ("three", "caroca", "eight")] == [3, 3, 8]


@pytest.mark.validate(but=["0.0"])
@pytest.mark.parametrize(
    ("command", "delay"), [("trace", 0.3), ("trace", 2.0), ("trace", 6.0), ("simulate", 3.0), ("build", 0.0)]
)
def test_ctrl_c_leaves_nothing_behind(tmp_path: Path, command: str, delay: float) -> None:
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    fit = str(THREE / "fit.csv")
    inputs = {"trace": [fit], "simulate": ["--speeds", fit, "--step", "1e-4"], "build": []}[command]
    robot = str(EXAMPLES / "eight" / "robot.toml") if command == "build" else ROBOT
    arguments = [command, robot, *inputs, "--out", str(tmp_path / "out.parquet")]
    process = subprocess.Popen(
        [sys.executable, "-m", "tautwire.cli", *arguments],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        env={**os.environ, "TMPDIR": str(scratch)},
        text=True,
    )
    begun = time.monotonic()
    # A build takes a second or two, so it is interrupted after its first FMU rather than after a time.
    awaited = ".tautwire-*/new/cable_1.fmu" if command == "build" else ".tautwire-*"
    while not list(tmp_path.glob(awaited)) and time.monotonic() - begun < 60.0:
        time.sleep(0.05)
    time.sleep(delay)
    process.send_signal(signal.SIGINT)
    stdout, stderr = process.communicate(timeout=60)
    # Python lets the signal end a process in which it was caught within some exec, as dataclasses do.
    assert process.returncode in (1, -signal.SIGINT)
    assert without_progress_lines(stderr) == "tautwire: interrupted; nothing was written\n"
    assert stdout == ""
    assert [path.name for path in tmp_path.iterdir()] == ["scratch"]
    assert list(scratch.iterdir()) == []


WINCH = "\n[winch]\ndrum_radius = 0.2\nacceleration_limit = 3.0\n"


def with_tables(tmp_path: Path, tables: str) -> str:
    """The three-cable robot file with more tables."""
    place = tmp_path / "robot.toml"
    place.write_text(Path(ROBOT).read_text(encoding="utf-8") + tables, encoding="utf-8")
    return str(place)


@pytest.mark.validate
def test_with_winches_speeds_are_commands_and_the_result_has_what_came_of_them(
    tmp_path: Path, short: tuple[Path, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    robot, result = with_tables(tmp_path, WINCH), tmp_path / "result.csv"
    assert run(["simulate", robot, "--speeds", str(short[0]), "--until", "0.5", "--out", str(result)]) == 0
    assert "winch speeds are taken as commands of the winches" in capsys.readouterr().err
    frame, recorded = pd.read_csv(result), pd.read_csv(short[0])
    gap = (frame["winch_speed_2"] - recorded["winch_speed_2"][: len(frame)]).abs()
    assert 0.0 < gap.max() < 0.05


def test_build_writes_winches(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert run(["build", with_tables(tmp_path, WINCH), "--out", str(out)]) == 0
    assert {f"winch_{i}.fmu" for i in (1, 2, 3)} < {path.name for path in out.iterdir()}
    assert [line for line in capsys.readouterr().out.split() if "winch_" in Path(line).name] == [
        str(out / f"winch_{i}.fmu") for i in (1, 2, 3)
    ]


def test_linearise_says_that_winches_have_no_part_in_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    place = tmp_path / "model.json"
    plain = tmp_path / "plain.json"
    assert run(["linearise", ROBOT, "--out", str(plain)]) == 0
    assert "[winch]" not in capsys.readouterr().err
    assert run(["linearise", with_tables(tmp_path, WINCH), "--out", str(place)]) == 0
    assert capsys.readouterr().err.startswith("[winch]: not used here")
    model, plain_model = (json.loads(path.read_text()) for path in (place, plain))
    assert model.pop("provenance")["inputs"] != plain_model.pop("provenance")["inputs"]
    assert model == plain_model


def test_toml_files_that_are_to_be_filled_in_tell_where_they_are_from(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("log.csv").write_text("t,Motor 1,Motor 2\n0,1,2\n", encoding="utf-8")
    assert run(["new", "hall"]) == 0 and run(["columns", "log.csv", "--out", "columns.toml"]) == 0
    for file, line in {"hall.toml": "# command: tautwire new hall", "columns.toml": "# input: log.csv sha256 "}.items():
        head = Path(file).read_text(encoding="utf-8").splitlines()[:3]
        assert head[0].startswith("# Written by Tautwire ") and any(each.startswith(line) for each in head)
