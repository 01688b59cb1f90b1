"""Recordings with the laboratory's names, units, signs and zeros are those of the standard file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import savemat

from tautwire.errors import InputError, RecordingError
from tautwire.recordings.column_map import column_map
from tautwire.recordings.recording import Recording, read_recording, recording_errors
from tautwire.robot.robot_file_reader import read_columns_file, robot_from_text
from tautwire.robot.robot_file_writer import write_robot
from tautwire.robot.schema import RecordedColumn
from tests.support.refusals import refused
from tests.support.robots import EXAMPLES

TABLE = "[recording.columns]\n"
SPEEDS = [f"winch_speed_{cable}" for cable in (1, 2, 3)]
TENSIONS = [f"tension_{cable}" for cable in (1, 2, 3)]


def standard() -> pd.DataFrame:
    """Some samples with numbers of few bits, so that scales of powers of two lose nothing."""
    frame = pd.read_csv(EXAMPLES / "three" / "fit.csv", nrows=40)[["time", *SPEEDS, *TENSIONS, "x", "y", "z"]]
    return (frame * 2**12).round() / 2**12


def written(folder: Path, frame: pd.DataFrame, columns: str, separator: str = ",") -> tuple[Path, Path]:
    recording, table = folder / "log.csv", folder / "columns.toml"
    frame.to_csv(recording, index=False, sep=separator)
    table.write_text(TABLE + columns, encoding="utf-8")
    return recording, table


def expected(folder: Path) -> Recording:
    standard().to_csv(folder / "standard.csv", index=False)
    return read_recording(folder / "standard.csv", 3)


def numbers(recording: Recording) -> np.ndarray:
    return recording.frame().to_numpy()


ALL_NAMES = {"time": "t_ms"} | {f"winch_speed_{i}": f"Drive{i}.Velocity" for i in (1, 2, 3)}
CASES = {
    "names and signs": (
        lambda f: f.assign(**{s: -f[s] for s in SPEEDS}).rename(columns=ALL_NAMES | {"time": "t"}),
        'time = "t"\n"winch_speed_{}" = { name = "Drive{}.Velocity", sign = -1 }\n',
    ),
    "ms in the table": (
        lambda f: f.assign(time=f.time * 1e3).rename(columns={"time": "t_ms"}),
        'time = { name = "t_ms", unit = "ms" }\n',
    ),
    "a unit beside the name": (
        lambda f: f.assign(x=f.x * 1e3).rename(columns={"x": "Rigid Body 1 X [mm]"}),
        'x = "Rigid Body 1 X"\n',
    ),
    "a name with the unit in it": (
        lambda f: f.assign(x=f.x * 1e3).rename(columns={"x": "Rigid Body 1 X [mm]"}),
        'x = "Rigid Body 1 X [mm]"\n',
    ),
    "the unit of the standard name": (lambda f: f.assign(x=f.x * 1e3), 'x = { unit = "mm" }\n'),
    "axes exchanged": (lambda f: f.rename(columns={"x": "y", "y": "x"}), 'x = "y"\ny = "x"\n'),
    "another column has the standard name": (
        lambda f: f.rename(columns={"x": "tracker x"}).assign(x=7.0),
        'x = "tracker x"\n',
    ),
    "single names before the pattern, from 0": (
        lambda f: f.rename(columns={"tension_1": "F0", "tension_2": "F2", "tension_3": "F3"}),
        '"tension_{}" = "F{}"\ntension_1 = "F0"\n',
    ),
    "a load cell with zero and factor": (
        lambda f: f.assign(tension_2=f.tension_2 * 4.0 + 8192.0).rename(columns={"tension_2": "ADC [cnt]"}),
        'tension_2 = { name = "ADC", factor = 0.25, offset = 8192 }\n',
    ),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_numbers_are_those_of_the_standard_file(case: str, separator: str, tmp_path: Path) -> None:
    change, columns = CASES[case]
    recording, table = written(tmp_path, change(standard()), columns, separator)
    read = read_recording(recording, 3, table)
    np.testing.assert_allclose(numbers(read), numbers(expected(tmp_path)), rtol=1e-14, atol=0.0)
    assert any(f"columns by {table}" in note for note in read.notes)
    declared = read_columns_file(table, 3)
    assert list(recording_errors(recording, 3, declared)) == []


def test_parquet_is_read_alike(tmp_path: Path) -> None:
    change, columns = CASES["names and signs"]
    change(standard()).to_parquet(tmp_path / "log.parquet")
    _, table = written(tmp_path, standard(), columns)
    read = read_recording(tmp_path / "log.parquet", 3, table)
    assert np.array_equal(numbers(read), numbers(expected(tmp_path)))


def test_channels_of_mdf_are_read_alike(tmp_path: Path) -> None:
    asammdf = pytest.importorskip("asammdf")
    frame = standard()
    times = frame.time.to_numpy()
    with asammdf.MDF() as content:
        for name in SPEEDS:
            counts = -frame[name].to_numpy() * 2048.0 + 512.0
            signal = asammdf.Signal(counts, times, name=name.replace("winch_speed_", "ax"), unit="inc/s")
            content.append(signal)
        content.append(asammdf.Signal(frame.x.to_numpy() * 1e3, times, name="BodyX", unit="mm"))
        content.save(tmp_path / "log.mf4")
    columns = '"winch_speed_{}" = { name = "ax{}", factor = 4.8828125e-4, sign = -1, offset = 512 }\nx = "BodyX"\n'
    _, table = written(tmp_path, frame, columns)
    read = read_recording(tmp_path / "log.mf4", 3, table)
    assert np.array_equal(read.winch_speed, frame[SPEEDS].to_numpy())
    np.testing.assert_allclose(read.position[:, 0], frame.x, rtol=1e-15)


def test_encoder_counts_stand_for_speeds(tmp_path: Path) -> None:
    frame = standard()
    lengths = pd.DataFrame({f"rope_length_{i}": np.round(4096 * np.sin(i + frame.time)) / 4096 for i in (1, 2, 3)})
    plain = pd.concat([frame.drop(columns=SPEEDS), lengths], axis=1)
    plain.to_csv(tmp_path / "plain.csv", index=False)
    counts = lengths * 2**14 + 131072.0
    log = pd.concat([frame.drop(columns=SPEEDS), counts.set_axis([f"Enc{i} cnt" for i in (1, 2, 3)], axis=1)], axis=1)
    columns = '"rope_length_{}" = { name = "Enc{} cnt", factor = 6.103515625e-5, offset = 131072 }\n'
    recording, table = written(tmp_path, log, columns)
    read = read_recording(recording, 3, table)
    assert read.rope_lengths == (1, 2, 3)
    assert np.array_equal(numbers(read), numbers(read_recording(tmp_path / "plain.csv", 3)), equal_nan=True)


def test_scaling_back_gives_the_same_recording(tmp_path: Path) -> None:
    generator = np.random.default_rng(7)
    for _ in range(5):
        factor, sign = 2.0 ** generator.integers(-6, 7), generator.choice([-1, 1])
        offset = float(generator.integers(-1000, 1000))
        frame = standard()
        log = frame.assign(**{name: frame[name] / (sign * factor) + offset for name in TENSIONS})
        columns = f'"tension_{{}}" = {{ factor = {factor}, sign = {sign}, offset = {offset} }}\n'
        recording, table = written(tmp_path, log, columns)
        assert np.array_equal(numbers(read_recording(recording, 3, table)), numbers(expected(tmp_path)))


def test_a_file_with_standard_names_alone_is_read_by_these(tmp_path: Path) -> None:
    recording, table = written(tmp_path, standard(), 'time = "t"\nx = "Body X"\n')
    read = read_recording(recording, 3, table)
    assert np.array_equal(numbers(read), numbers(expected(tmp_path)))
    assert "standard names" in read.notes[0]


REFUSED = {
    'speed = "v"': ("recording.columns.speed", "not a column", "winch_speed_{}"),
    'tension_4 = "F"': (
        "tension_4",
        "cables 1 to 3",
    ),
    'x = { name = "x", units = "mm" }': ("recording.columns.x.units", "'unit'"),
    'x = { unit = "kN" }': ("recording.columns.x.unit", "'kN'", "length", "mm"),
    "x = { factor = 0 }": ("recording.columns.x.factor", "must not be 0"),
    "x = { factor = inf }": ("recording.columns.x.factor", "finite"),
    "x = { sign = -2 }": ("recording.columns.x.sign", "-1"),
    "x = { sign = 0.5 }": ("recording.columns.x.sign", "0.5", "1 or -1"),
    "x = 3": ("recording.columns.x", "is 3", "name"),
    'x = "y"\nz = "y"': ("recording.columns.z", "'y'", "x"),
    '"tension_{}" = "F"': ("tension_{}", "'F'", "without {}"),
    'y = "y"\nx = "Body x"': ("log.csv: line 1", "'Body x'", "recording.columns.x"),
}


@pytest.mark.parametrize("columns", REFUSED)
def test_a_wrong_table_is_refused(columns: str, tmp_path: Path) -> None:
    recording, table = written(tmp_path, standard(), columns + "\n")
    with pytest.raises(InputError) as caught:
        read_recording(recording, 3, table)
    assert all(word in str(caught.value) for word in REFUSED[columns]), str(caught.value)


def test_a_missing_name_is_refused_with_the_closest_one(tmp_path: Path) -> None:
    frame = standard().rename(columns={"x": "Rigid Body 1 X"})
    recording, table = written(tmp_path, frame, 'y = "y"\nx = "Rigid Body1 X"\n')
    with pytest.raises(InputError, match="write 'Rigid Body 1 X'"):
        read_recording(recording, 3, table)


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ('{ name = "Body", unit = "m" }', "is in mm here and in m by"),
        ('{ name = "Body", factor = 0.001 }', "is in mm here and has the factor 0.001"),
    ],
)
def test_a_unit_that_the_file_contradicts_is_refused(entry: str, words: str, tmp_path: Path) -> None:
    frame = standard().rename(columns={"x": "Body [mm]"})
    recording, table = written(tmp_path, frame, f"x = {entry}\n")
    with pytest.raises(InputError, match=words):
        read_recording(recording, 3, table)


def test_clock_times_have_no_scale(tmp_path: Path) -> None:
    frame = standard()
    clock = [f"10:00:{second:06.3f}" for second in frame.time]
    recording, table = written(tmp_path, frame.assign(time=clock), 'time = { unit = "ms" }\n')
    with pytest.raises(InputError, match="clock times"):
        read_recording(recording, 3, table)


def test_a_robot_file_keeps_its_columns(tmp_path: Path) -> None:
    text = (EXAMPLES / "three" / "robot.toml").read_text(encoding="utf-8")
    columns = (
        'time = { name = "t \\"ms\\"", unit = "ms" }\n"winch_speed_{}" = { name = "v{}", sign = -1, offset = 0.5 }\n'
    )
    robot = robot_from_text(f"{text}\n{TABLE}{columns}", "robot.toml", "three")
    write_robot(robot, tmp_path / "robot.toml")
    again = robot_from_text((tmp_path / "robot.toml").read_text(encoding="utf-8"), "robot.toml", robot.name)
    assert again.recorded_columns == robot.recorded_columns
    assert [column.name for column in again.recorded_columns] == ['t "ms"', "v{}"]


def test_columns_that_are_none_are_refused() -> None:
    path = EXAMPLES / "three" / "fit.csv"
    refused(lambda: read_recording(path, 3, {"x": "y"}), "read_recording: columns", "a dict")  # type: ignore[arg-type]


@pytest.mark.parametrize("suffix", ["mat", "parquet"])
def test_a_recording_of_which_no_column_is_known_is_refused_at_once(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"log.{suffix}"
    frame = pd.DataFrame({"t_ms": [0.0, 1.0], "v1": [0.0, 0.1]})
    if suffix == "mat":
        savemat(path, {name: frame[name].to_numpy() for name in frame})
    else:
        frame.to_parquet(path)
    (problem,) = recording_errors(path, 3)
    assert "none of the columns time, winch_speed_1 ... winch_speed_3, it has 't_ms, v1'" in str(problem)


@pytest.mark.parametrize(("scale", "is_read"), [("", False), (", factor = 2e-3", True), (', unit = "mm"', True)])
def test_an_unknown_unit_in_a_declared_name_is_not_taken_for_si(tmp_path: Path, scale: str, is_read: bool) -> None:
    names = [f"Drum{cable} angle [deg]" for cable in (1, 2, 3)]
    pd.DataFrame({"time": [0.0, 0.1]} | {name: [0.0, 1.0] for name in names}).to_csv(tmp_path / "log.csv", index=False)
    table = tmp_path / "columns.toml"
    table.write_text(f'[recording.columns]\n"rope_length_{{}}" = {{ name = "Drum{{}} angle [deg]"{scale} }}\n')
    if is_read:
        assert read_recording(tmp_path / "log.csv", 3, table).cable_count == 3
        return
    with pytest.raises(RecordingError, match=r"'\[deg\]', not a known unit of length; write unit or factor into"):
        read_recording(tmp_path / "log.csv", 3, table)


def test_alike_columns_are_told_together() -> None:
    cells = [RecordedColumn(f"tension_{cable}", f"F{cable}", unit="kN") for cable in (1, 2, 3)]
    axes = [RecordedColumn(axis, axis.upper()) for axis in ("x", "y")]
    declared = [*cells, RecordedColumn("time", "t"), *axes, RecordedColumn("z", "Z", sign=-1.0)]
    assert column_map(declared, 3).in_words() == (
        "columns by the map: tension_1 to tension_3 are 'F1' to 'F3' in kN, time is 't', x to y are 'X' to 'Y', "
        "z is 'Z' with its sign changed"
    )
