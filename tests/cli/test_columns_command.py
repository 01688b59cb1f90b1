"""`tautwire columns` proposes a table that reads a laboratory's recording, and says what it cannot tell."""

from __future__ import annotations

import json
import re
import shlex
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import tomlkit
from scipy.io import savemat

from tautwire.cli import run
from tautwire.recordings.column_names import column_names
from tautwire.recordings.column_proposal import propose_columns
from tautwire.recordings.recording import read_recording
from tautwire.robot.robot_file_writer import write_robot
from tests.support.pose_recordings import noisy, wandering_recording
from tests.support.rigid_robots import crane_robot
from tests.support.robots import EXAMPLES
from tests.support.trackers import split

FIT = EXAMPLES / "three" / "fit.csv"
ROBOT = str(EXAMPLES / "three" / "robot.toml")
PER_COUNT = "metres per count (2 pi * drum radius / counts per turn)"


def standard() -> pd.DataFrame:
    columns = [f"{kind}_{cable}" for kind in ("winch_speed", "tension") for cable in (1, 2, 3)]
    return pd.read_csv(FIT, nrows=60)[["time", *columns, "x", "y", "z"]]


def renamed(speed: str, tension: str, axis: str, time: str, first: int = 1) -> dict[str, str]:
    numbers = {cable: cable - 1 + first for cable in (1, 2, 3)}
    speeds = {f"winch_speed_{cable}": speed.format(number) for cable, number in numbers.items()}
    tensions = {f"tension_{cable}": tension.format(number) for cable, number in numbers.items()}
    return {"time": time} | speeds | tensions | {each: axis.format(each.upper()) for each in "xyz"}


LOGS = {
    "drives and a tracker": (renamed("Drive{}.Velocity", "Load Cell {}", "Rigid Body {}", "Timestamp"), {}, ","),
    "German, ends of names": (
        renamed("v{}_mm/s", "Kraft{}_kN", "pos_{}_mm", "Zeit_ms"),
        {"time": 1e3, "winch": 1e3, "tension": 1e-3, "xyz": 1e3},
        ";",
    ),
    "German, joined words": (
        renamed("Seilgeschwindigkeit {} [mm/s]", "Seilkraft {} [kN]", "Position {} [mm]", "Zeit [s]"),
        {"winch": 1e3, "tension": 1e-3, "xyz": 1e3},
        ";",
    ),
    "French": (renamed("Vitesse treuil {} (m/s)", "Tension c\u00e2ble {} (N)", "{} (m)", "Temps (s)"), {}, ";"),
    "Spanish": (renamed("Velocidad {} (m/s)", "Fuerza {} (N)", "Posicion {} (m)", "Tiempo (s)"), {}, ";"),
    "ROS, exported": (
        renamed("/drives/winch_{}/velocity", "/load_cell_{}/wrench.force.z", "/tracker/position/{}", "/time"),
        {},
        ",",
    ),
    "units before the numbers": (
        renamed("v_mm/s_{}", "F_kN_{}", "pos_{}", "t_ms"),
        {"time": 1e3, "winch": 1e3, "tension": 1e-3},
        ",",
    ),
    "brackets, from 0": (
        renamed("motor {} speed [m/min]", "F{} [N]", "{} [mm]", "t [ms]", first=0),
        {"time": 1e3, "winch": 60.0, "xyz": 1e3},
        "\t",
    ),
}


@pytest.mark.parametrize("name", LOGS)
def test_a_proposal_reads_the_recording_as_it_stands(name: str, tmp_path: Path) -> None:
    names, scales, separator = LOGS[name]
    frame = standard()
    log = pd.DataFrame(
        {names[c]: frame[c] * scales.get("xyz" if c in "xyz" else c.partition("_")[0], 1.0) for c in frame}
    )
    log["Setpoint 1"] = 1.0
    log.to_csv(tmp_path / "log.csv", index=False, sep=separator)
    table = tmp_path / "columns.toml"
    assert run(["columns", str(tmp_path / "log.csv"), ROBOT, "--out", str(table)]) == 0
    read = read_recording(tmp_path / "log.csv", 3, table)
    frame.to_csv(tmp_path / "standard.csv", index=False)
    expected = read_recording(tmp_path / "standard.csv", 3)
    np.testing.assert_allclose(read.frame(), expected.frame(), rtol=1e-12, atol=1e-15)
    assert "# not used: 'Setpoint 1'" in table.read_text(encoding="utf-8")


@pytest.mark.parametrize("mark", ["", "# "])
def test_a_line_of_units_tells_as_names_do(mark: str, tmp_path: Path) -> None:
    frame = standard()
    names = renamed("Drive {}", "Kraft {}", "{}", "Zeit")
    log = pd.DataFrame({names[c]: frame[c] * (1e3 if c in "xyz" else 1.0) for c in frame})
    head, _, rows = log.to_csv(index=False, sep=";").partition("\n")
    units = ["s", *["m/s"] * 3, *["N"] * 3, *["mm"] * 3]
    (tmp_path / "log.csv").write_text(f"{head}\n{mark}{';'.join(units)}\n{rows}", encoding="utf-8")
    table = tmp_path / "columns.toml"
    assert run(["columns", str(tmp_path / "log.csv"), ROBOT, "--out", str(table)]) == 0
    text = table.read_text(encoding="utf-8")
    assert 'x = { name = "X", unit = "mm" }\n' in text and "no unit" not in text
    assert 'winch_speed_2 = { name = "Drive 2", unit = "m/s" }  # positive has to reel in' in text
    read = read_recording(tmp_path / "log.csv", 3, table).frame()
    np.testing.assert_allclose(read["z"], frame["z"], rtol=1e-12)


def test_a_line_of_units_tells_which_columns_need_a_factor(tmp_path: Path) -> None:
    text = "Zeit;Motor 1;Motor 2;X\ns;counts;rpm;mm\n1;2;3;4\n"
    (tmp_path / "log.csv").write_text(text, encoding="utf-8")
    proposal = {each.column: each for each in propose_columns(column_names(tmp_path / "log.csv"), 3).columns}
    assert proposal["rope_length_1"].doubt == f"add factor = {PER_COUNT}; has to fall as it reels in"
    assert proposal["winch_speed_2"].doubt.startswith("add factor = radius * pi / 30")


@pytest.mark.parametrize(
    ("names", "count"),
    [
        ("Zeit;Motor 1;Motor 2;Motor 3;X", 3),
        ("t;Enc0 cnt;Enc1 cnt;Kraft0 [N];Kraft1 [N]", 2),
        ("time;winch_speed_1;winch_speed_2;winch_speed_3;winch_speed_4;tension_1", 4),
    ],
)
def test_names_tell_the_number_of_cables_where_nothing_else_does(
    names: str, count: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "log.csv"
    log.write_text(names + "\n" + ";".join("1" for _ in names.split(";")) + "\n", encoding="utf-8")
    assert run(["columns", str(log), "--cables", str(count)]) == 0
    expected = capsys.readouterr()
    assert run(["columns", str(log)]) == 0
    assert capsys.readouterr() == expected


def test_what_is_ambiguous_or_missing_is_a_comment(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = tmp_path / "log.csv"
    log.write_text("t,Time,Drive1.Velocity,Enc2 cnt,blob\n0,0,1,2,3\n1,1,1,2,3\n", encoding="utf-8")
    assert run(["columns", str(log), "--cables", "3"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "# not used: 't': one of 2 that look like time" in lines
    assert any(line.startswith("# time = ") and "required" in line for line in lines)
    assert any(line.startswith("# winch_speed_3 = ") for line in lines)
    (encoder,) = [line for line in lines if line.startswith("rope_length_2 = ")]
    assert "# add factor = metres per count" in encoder
    (speed,) = [line for line in lines if line.startswith("winch_speed_1 = ")]
    assert "the file's, or SI; positive has to reel in" in speed


def proposed(tmp_path: Path, *names: str) -> tuple[dict[str, dict[str, str]], dict[str, str]]:
    """The columns that are proposed for a recording of three cables, and the reasons for names that are not used."""
    log = tmp_path / "log.csv"
    log.write_text(f"{','.join(names)}\n{','.join('1' for _ in names)}\n", encoding="utf-8")
    proposal = propose_columns(column_names(log), 3)
    return {each.column: asdict(each) for each in proposal.columns}, dict(proposal.unused)


def test_a_force_along_several_axes_is_no_tension(tmp_path: Path) -> None:
    columns, unused = proposed(tmp_path, "time", *(f"/wrench_1/force/{axis}" for axis in "xyz"))
    assert set(columns) == {"time"} and len(unused) == 3


@pytest.mark.parametrize(
    "name",
    [
        "Motor1 temp",
        "acc_x",
        "gyro y",
        "quat_z",
        "rot z",
        "Load 1 [%]",
        "Drive1 Voltage [V]",
        "Drive2 Status",
        "v1 [N]",
        "x [m/s^2]",
        "Kraft1 [bar]",
        "Motor1 [kN]",
        "time_2",
        "Torque1",
        "Cycle Time [ms]",
    ],
)
def test_other_quantities_are_not_used(name: str, tmp_path: Path) -> None:
    columns, unused = proposed(tmp_path, "Zeit", name)
    assert set(columns) == {"time"}
    assert set(unused) == {name}


@pytest.mark.parametrize(
    ("name", "column", "unit", "remark"),
    [
        ("Winch3.Position [mm]", "rope_length_3", "mm", "has to fall"),
        ("Drive1 [mm]", "rope_length_1", "mm", "has to fall"),
        ("Seil2 [kN]", "tension_2", "kN", ""),
        ("T2 [N]", "tension_2", "N", ""),
        ("T3", "tension_3", "", "no unit in the name: the file's, or SI; quantity not named"),
        ("Drive2", "winch_speed_2", "", "quantity not named"),
        ("Drive2 [m/min]", "winch_speed_2", "m/min", "positive has to reel in"),
        ("motor_1_velocity", "winch_speed_1", "", "no unit in the name: the file's, or SI; positive has"),
        ("foo y", "y", "", "quantity not named"),
        ("Encoder1 [counts]", "rope_length_1", "", f"add factor = {PER_COUNT}; has to fall"),
        ("Trommel2 Winkel [deg]", "rope_length_2", "", "add factor = radius * pi / 180; has to fall"),
        ("Drum2 angle [rad]", "rope_length_2", "", "add factor = the drum's radius; has to fall"),
        ("enc_1", "rope_length_1", "", f"add factor = {PER_COUNT}, or the drum's radius for rad; has to fall"),
        ("Geber 3", "rope_length_3", "", f"add factor = {PER_COUNT}, or the drum's radius for rad; has to fall"),
        ("motor1 speed rpm", "winch_speed_1", "", "add factor = radius * pi / 30; positive"),
        ("Drehzahl 2 [1/min]", "winch_speed_2", "", "add factor = radius * pi / 30; positive"),
        ("Motor3 [rad/s]", "winch_speed_3", "", "add factor = the drum's radius; positive"),
        ("Encoder velocity 1 [deg/s]", "winch_speed_1", "", "add factor = radius * pi / 180; positive"),
        ("v[2]", "winch_speed_2", "", "quantity not named"),
    ],
)
def test_a_name_tells_quantity_cable_unit_and_factor(
    name: str, column: str, unit: str, remark: str, tmp_path: Path
) -> None:
    columns, unused = proposed(tmp_path, "Zeit", name)
    assert not unused
    assert columns.keys() == {"time", column}
    assert columns[column]["unit"] == unit
    assert remark in columns[column]["doubt"]


def test_a_number_0_beside_those_of_all_cables_is_none(tmp_path: Path) -> None:
    columns, unused = proposed(tmp_path, "Zeit", "T0", "F1 [N]", "F2 [N]", "F3 [N]")
    assert [columns[f"tension_{cable}"]["name"] for cable in (1, 2, 3)] == ["F1 [N]", "F2 [N]", "F3 [N]"]
    assert unused == {"T0": "looks like tension of cable 0, and there are 3"}


def test_counts_are_read_with_the_factor_that_is_asked_for(tmp_path: Path) -> None:
    frame = standard()
    names = {f"winch_speed_{cable}": f"Motor{cable} [rpm]" for cable in (1, 2, 3)}
    rpm = frame.assign(**{name: frame[name] / (0.05 * np.pi / 30) for name in names}).rename(columns=names)
    rpm.to_csv(tmp_path / "log.csv", index=False)
    table = tmp_path / "columns.toml"
    assert run(["columns", str(tmp_path / "log.csv"), "--cables", "3", "--out", str(table)]) == 0
    text = table.read_text(encoding="utf-8")
    assert text.count("add factor = radius * pi / 30") == 3
    table.write_text(text.replace(']" }', f']", factor = {0.05 * np.pi / 30} }}'), encoding="utf-8")
    read = read_recording(tmp_path / "log.csv", 3, table).frame()
    np.testing.assert_allclose(read["winch_speed_2"], frame["winch_speed_2"], rtol=1e-12, atol=1e-15)


def test_standard_names_are_read_as_they_are(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    frame = standard().assign(t=0.0)
    frame.to_csv(tmp_path / "log.csv", index=False)
    assert run(["columns", str(tmp_path / "log.csv"), ROBOT]) == 0
    text = capsys.readouterr().out
    assert "# read by their standard names: time, winch_speed_1, " in text
    assert "# not used: 't': looks like time, which is read by its standard name" in text
    assert tomlkit.parse(text).unwrap() == {"recording": {"columns": {}}}
    assert "required" not in text
    (tmp_path / "columns.toml").write_text(text, encoding="utf-8")
    read = read_recording(tmp_path / "log.csv", 3, tmp_path / "columns.toml")
    np.testing.assert_array_equal(read.frame()["tension_3"], frame["tension_3"])


def test_matrices_of_matlab_keep_their_standard_names(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    frame = standard()
    speeds = frame[[f"winch_speed_{cable}" for cable in (1, 2, 3)]].to_numpy()
    log = {"t": frame["time"].to_numpy(), "winch_speed": speeds, "position": frame[["x", "y", "z"]].to_numpy()}
    savemat(tmp_path / "log.mat", {"log": log}, oned_as="column")
    table = tmp_path / "columns.toml"
    assert run(["columns", str(tmp_path / "log.mat"), ROBOT, "--out", str(table)]) == 0
    text = table.read_text(encoding="utf-8")
    assert "# read by their standard names: winch_speed_1, winch_speed_2, winch_speed_3, x, y, z" in text
    assert "not used" not in text
    assert tomlkit.parse(text).unwrap()["recording"]["columns"] == {"time": {"name": "log.t", "unit": "s"}}
    read = read_recording(tmp_path / "log.mat", 3, table)
    np.testing.assert_array_equal(read.frame()["y"], frame["y"])


@pytest.mark.validate(but=["mat"])
@pytest.mark.parametrize("kind", ["csv", "mat", "parquet"])
def test_columns_without_names_are_proposed_by_their_values(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    frame = pd.read_csv(FIT, nrows=2000)
    counts = np.round(frame.filter(like="winch").cumsum() * 0.01 / -2.5e-5)
    unnamed = pd.concat(
        [1e3 * frame["time"], counts, frame.filter(like="tension"), 1e3 * frame[["x", "y", "z"]]], axis=1
    )
    unnamed.columns = pd.Index([f"data_{index}" for index in range(1, 11)])
    log, table = tmp_path / f"log.{kind}", tmp_path / "columns.toml"
    if kind == "csv":
        text = unnamed.to_csv(index=False, sep=";", decimal=",")
        log.write_text(f"Laboratory;12,5\n{text}# end\n", encoding="utf-8")
    elif kind == "mat":
        savemat(log, {"data": unnamed.to_numpy(), "rate": 100.0})
    else:
        unnamed.to_parquet(log)
    assert run(["columns", str(log), ROBOT, "--out", str(table)]) == 0
    proposal = table.read_text(encoding="utf-8")
    assert proposal.count("factor and sign by the coordinates") == 3
    assert run(["check", ROBOT, str(log), "--columns", str(table)]) == 0
    read = read_recording(log, 3, table)
    np.testing.assert_allclose(read.position[:, 2], frame["z"], rtol=1e-12)
    assert "no problems found" in capsys.readouterr().out


@pytest.mark.parametrize("robot", [[ROBOT], ["--cables", "3"]])
def test_the_next_step_is_a_command_that_runs(
    robot: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    standard().rename(columns={"time": "t"}).to_csv("log 1.csv", index=False)
    assert run(["columns", "log 1.csv", *robot]) == 0
    last = capsys.readouterr().err.splitlines()[-1]
    arguments = shlex.split(last.removeprefix("next: tautwire "))
    assert arguments == ["columns", "log 1.csv", *robot, "--out", "columns.toml"]
    assert run(arguments) == 0
    last = capsys.readouterr().err.splitlines()[-1]
    assert last.endswith("--columns columns.toml")
    if robot == [ROBOT]:
        assert run(shlex.split(last.partition("tautwire ")[2])) == 0
    else:
        assert ".toml" not in last.removesuffix("columns.toml")


def test_json_lists_the_columns(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    frame = standard().rename(columns={"x": "Rigid Body 1 X", "time": "t_ms"})
    frame.to_parquet(tmp_path / "log.parquet")
    assert run(["columns", str(tmp_path / "log.parquet"), ROBOT, "--json", "--quiet"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["columns"][0] == {
        "column": "time",
        "name": "t_ms",
        "unit": "ms",
        "doubt": "unit by the name's end",
        "factor": None,
        "sign": 1,
    }
    assert {"x", "y", "z", "tension_3", "winch_speed_3"} < {each["column"] for each in document["columns"]}


def test_a_trackers_file_has_a_table_of_its_own_beside_the_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    log, tracker = split(read_recording(FIT, 3).first(2000), 60.0, 5.25, 1.0)
    log.frame().rename(columns={"time": "t", "x": "set X"}).drop(columns=["y"]).to_csv("log.csv", index=False)
    positions = {f"Rigid Body 1 {axis}": 1e3 * tracker.position[:, i] for i, axis in enumerate("XYZ")}
    marked = {f"{name} [mm]": values for name, values in positions.items()}
    pd.DataFrame({"Time (Seconds)": tracker.time, **marked, "Marker 1": 0.0}).to_csv(
        "tracker.csv", index=False, sep=";"
    )
    arguments = ["columns", "log.csv", ROBOT, "--tracker", "tracker.csv"]
    assert run(arguments) == 0
    captured = capsys.readouterr()
    assert tomlkit.parse(captured.out).unwrap()["recording"]["tracker"]["columns"] == {
        "time": {"name": "Time (Seconds)", "unit": "s"},
        **{axis: {"name": f"Rigid Body 1 {axis.upper()} [mm]", "unit": "mm"} for axis in "xyz"},
    }
    assert "# not used: 'z': is z of the log, beside that of tracker.csv: rename or remove it" in captured.out
    assert "# not used: 'Marker 1': no known word" in captured.out
    pd.read_csv("log.csv").drop(columns=["z"]).to_csv("log.csv", index=False)
    assert run(shlex.split(captured.err.splitlines()[-1].partition("tautwire ")[2])) == 0
    last = capsys.readouterr().err.splitlines()[-1]
    assert run(shlex.split(last.partition("tautwire ")[2])) == 0
    assert "tracker.csv: no problems found" in capsys.readouterr().out


@pytest.mark.validate
def test_counts_of_a_log_get_their_factor_by_the_trackers_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = read_recording(FIT, 3).first(2000)
    log, tracker = split(recording, 60.0, 5.25, 1.0)
    counts = {f"enc_{cable}": np.round(log.wound_lengths()[:, cable - 1] / 2.5e-5) for cable in (1, 2, 3)}
    pd.DataFrame({"t_ms": 1e3 * log.time, **counts}).to_csv(tmp_path / "log.csv", index=False)
    positions = {axis: tracker.position[:, index] for index, axis in enumerate("xyz")}
    pd.DataFrame({"time": tracker.time, **positions}).to_csv(tmp_path / "tracker.csv", index=False)
    files = ["--tracker", str(tmp_path / "tracker.csv")]
    table = tmp_path / "columns.toml"
    assert run(["columns", str(tmp_path / "log.csv"), ROBOT, *files, "--out", str(table)]) == 0
    proposal = table.read_text(encoding="utf-8")
    factors = [float(factor) for factor in re.findall(r"factor = ([0-9.e-]+), sign = -1 }", proposal)]
    assert factors == pytest.approx([2.5e-5] * 3, rel=2e-3)
    assert proposal.count("sign by the tracker's coordinates") == 3
    check = ["check", ROBOT, str(tmp_path / "log.csv"), "--columns", str(table), *files]
    capsys.readouterr()
    assert run(check) == 0
    lines = [number for number, line in enumerate(proposal.splitlines(), 1) if line.startswith("rope_length_")]
    note = f"{table}: lines {', '.join(map(str, lines))}: factors that were estimated from a recording hold the errors"
    captured = capsys.readouterr()
    assert note in captured.err
    assert captured.err.splitlines()[-1].endswith("add --check SECOND.csv --check-tracker ITS_TRACKER.csv")
    table.write_text(re.sub(" +#.*", "", proposal), encoding="utf-8")
    assert run(check) == 0
    assert "were estimated" not in capsys.readouterr().err


def test_what_a_trackers_file_does_not_tell_is_listed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "tracker.csv").write_text("frame,X,Y,Motor 1\n1,0,0,0\n2,0,0,0\n", encoding="utf-8")
    (tmp_path / "log.csv").write_text("t,Motor 1 [m/s],pos x\n0,0,0\n1,0,0\n", encoding="utf-8")
    files = [str(tmp_path / "log.csv"), "--cables", "1", "--tracker", str(tmp_path / "tracker.csv")]
    assert run(["columns", *files, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["unused"] == {"pos x": "looks like x, which is read from tracker.csv"}
    assert [each["column"] for each in document["tracker"]["columns"]] == ["x", "y"]
    assert document["tracker"]["unused"]["Motor 1"] == "looks like winch_speed, and a tracker's file has none"
    assert run(["columns", *files]) == 0
    missing = [line.split(" = ")[0] for line in capsys.readouterr().out.splitlines() if "none of the names" in line]
    assert missing == ["# time", "# z"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["{unnumbered}"], "--cables: is missing, and no column of"),
        (["{fit}", "{robot}", "--cables", "4"], "--cables: is 4, the robot has 3"),
        (["{robot}", "--cables", "3"], "no line of names above numbers"),
        (["{empty}", "--cables", "3"], "no line of names above numbers"),
        (["{bad}", "--cables", "3"], "bad.parquet: cannot be read as Parquet"),
    ],
)
def test_what_cannot_be_told_is_refused(
    arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "empty.csv").write_text("1,2\n3,4\n", encoding="utf-8")
    (tmp_path / "unnumbered.csv").write_text("time,speed,x,y,z\n0,1,2,3,4\n", encoding="utf-8")
    (tmp_path / "bad.parquet").write_bytes(b"PAR1 and no more of it")
    places = {"fit": str(FIT), "robot": ROBOT} | {path.stem: str(path) for path in tmp_path.iterdir()}
    assert run(["columns", *(argument.format_map(places) for argument in arguments)]) == 2
    assert words in capsys.readouterr().err


QUATERNIONS = {
    "standard": (["qw", "qx", "qy", "qz"], ""),
    "numbers": (["q0", "q1", "q2", "q3"], "numbered from 0: the scalar part has to be the first"),
    "a word": (["quat_w", "quat_x", "quat_y", "quat_z"], ""),
    "a message": ([f"pose.orientation.{part}" for part in "wxyz"], ""),
    "a body": ([f"Rigid Body 1 Rotation {part}" for part in "WXYZ"], ""),
    "numbered words": ([f"platform_quaternion{part}" for part in range(4)], "numbered from 0"),
    "an order from 0": ([f"tr_xyzw[{part}]" for part in (3, 0, 1, 2)], ""),
    "an order from 1": ([f"rot_wxyz_{part}" for part in (1, 2, 3, 4)], ""),
}


@pytest.mark.parametrize("name", QUATERNIONS)
def test_the_parts_of_a_quaternion_are_proposed(name: str, tmp_path: Path) -> None:
    names, doubt = QUATERNIONS[name]
    frame = standard().assign(**dict(zip(names, [[1.0] * 60, [0.0] * 60, [0.0] * 60, [0.0] * 60], strict=True)))
    frame.to_csv(tmp_path / "log.csv", index=False)
    proposal = propose_columns(column_names(tmp_path / "log.csv"), 3)
    told = {each.column: each for each in proposal.columns if each.column.startswith("q")}
    assert {column: each.name for column, each in told.items()} == dict(
        zip(("qw", "qx", "qy", "qz"), names, strict=True)
    )
    assert all(each.doubt.startswith(doubt) and not each.unit for each in told.values())
    assert all(bool(each.doubt) == bool(doubt) for each in told.values())


@pytest.mark.parametrize("names", [["w1_rpm", "w2_rpm", "w3_rpm"], ["w_rpm[0]", "w_rpm[1]", "w_rpm[2]"]])
def test_a_unit_that_only_speeds_or_forces_have_tells_them_where_no_word_does(names: list[str], tmp_path: Path) -> None:
    frame = standard().rename(columns={f"winch_speed_{cable}": name for cable, name in enumerate(names, start=1)})
    forces = [f"S{cable} [kN]" for cable in (1, 2, 3)]
    frame.rename(columns={f"tension_{cable}": name for cable, name in enumerate(forces, start=1)}).to_csv(
        tmp_path / "log.csv", index=False
    )
    told = {each.column: each for each in propose_columns(column_names(tmp_path / "log.csv"), 3).columns}
    assert [told[f"winch_speed_{cable}"].name for cable in (1, 2, 3)] == names
    assert [(told[f"tension_{cable}"].name, told[f"tension_{cable}"].unit) for cable in (1, 2, 3)] == [
        (name, "kN") for name in forces
    ]
    assert "radius * pi / 30; quantity not named" in told["winch_speed_1"].doubt


@pytest.mark.parametrize(
    ("names", "are_coordinates"),
    [
        (["tracker_pos[0]", "tracker_pos[1]", "tracker_pos[2]"], True),
        (["tcp.1", "tcp.2", "tcp.3"], True),
        (["pos_1", "pos_2", "pos_3"], False),
        (["marker_1", "marker_2", "marker_3", "marker_4"], False),
    ],
)
def test_numbered_coordinates_are_those_of_a_tracked_point(
    names: list[str], are_coordinates: bool, tmp_path: Path
) -> None:
    frame = standard().drop(columns=["x", "y", "z"]).assign(**dict.fromkeys(names, 1.0))
    frame.to_csv(tmp_path / "log.csv", index=False)
    told = {each.column: each.name for each in propose_columns(column_names(tmp_path / "log.csv"), 3).columns}
    assert ([told.get(axis) for axis in "xyz"] == names[:3]) == are_coordinates
    assert are_coordinates or not {"x", "y", "z"} & told.keys()


@pytest.mark.parametrize(
    "names",
    [
        ["Rotation_X", "Rotation_Y", "Rotation_Z"],
        ["qw_set", "qx_set", "qy_set", "qz_set"],
        ["q1", "q2", "q3", "q4"],
        ["imu_quat_w", "imu_quat_x", "imu_quat_y", "imu_quat_z"],
    ],
)
def test_angles_set_points_and_other_quaternions_are_not_the_platforms(names: list[str], tmp_path: Path) -> None:
    standard().assign(**dict.fromkeys(names, 0.5)).to_csv(tmp_path / "log.csv", index=False)
    proposal = propose_columns(column_names(tmp_path / "log.csv"), 3)
    assert [each for each in proposal.columns if each.column.startswith("q")] == []
    assert set(names) <= proposal.unused.keys()


def test_an_orientation_beside_a_point_mass_is_not_proposed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = [f"pose.orientation.{part}" for part in "wxyz"]
    standard().assign(**dict.fromkeys(names, 0.0)).to_csv(tmp_path / "log.csv", index=False)
    assert run(["columns", str(tmp_path / "log.csv"), ROBOT, "--json"]) == 0
    unused = json.loads(capsys.readouterr().out)["unused"]
    assert [unused[name] for name in names] == [
        f"looks like q{part}, and a point mass has no orientation" for part in "wxyz"
    ]


@pytest.mark.validate
def test_the_proposal_for_a_rigid_platform_is_read_by_the_check(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    robot, recording = crane_robot(), noisy(wandering_recording(crane_robot()))
    write_robot(robot, tmp_path / "crane.toml")
    frame = recording.frame()
    counts = {f"Enc{i}": np.round((1.0 - wound) / 2e-5) for i, wound in enumerate(recording.wound_lengths().T, 1)}
    poses = {f"RB Rotation {part.upper()}": frame[f"q{part}"] for part in "xyzw"}
    poses |= {f"RB Position {axis.upper()}": frame[axis] for axis in "xyz"}
    cells = {f"Force {i} [N]": frame[f"tension_{i}"] for i in range(1, 9)}
    pd.DataFrame({"t [s]": frame["time"]} | counts | poses | cells).to_csv(tmp_path / "log.csv", index=False)
    files = [str(tmp_path / name) for name in ("log.csv", "crane.toml", "columns.toml")]
    assert run(["columns", files[0], files[1], "--out", files[2]]) == 0
    table = (tmp_path / "columns.toml").read_text()
    assert 'qw = { name = "RB Rotation W" }' in table
    assert "rope_length_8" in table and "factor = 2e-05" in table
    assert run(["check", files[1], files[0], "--columns", files[2], "--json"]) == 0
    assert json.loads(capsys.readouterr().out.splitlines()[-1])["problems"] == []
