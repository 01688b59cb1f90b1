"""Recordings in MDF files: the same numbers as in CSV files, groups at their own times."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tautwire.errors import RecordingError
from tautwire.recordings.recording import read_recording
from tests.recordings.test_parquet_file import COLUMNS, same

asammdf = pytest.importorskip("asammdf")

TIME = np.array(COLUMNS["time"])
SPEEDS = {name: COLUMNS[name] for name in ("winch_speed_1", "winch_speed_2", "winch_speed_3")}
OUTPUTS = {name: values for name, values in COLUMNS.items() if name != "time" and name not in SPEEDS}
UNITS = {"winch_speed": "m/s", "tension": "N"}


def written(path: Path, *groups: tuple[Any, dict[str, Any]], units: dict[str, str] | None = None) -> Path:
    """An MDF 4 file of groups, each with its times and its channels."""
    content = asammdf.MDF(version="4.10")
    for time, channels in groups:
        signals = []
        for name, values in channels.items():
            unit = (units or {}).get(name, UNITS.get(name.rpartition("_")[0], "m"))
            samples, text = np.array(values), np.array(values).dtype.kind == "S"
            encoding = "utf-8" if text else None
            signals.append(asammdf.Signal(samples, np.array(time, dtype=float), unit, name, encoding=encoding))
        content.append(signals)
    content.save(path, overwrite=True)
    content.close()
    return path


def refused(path: Path) -> str:
    with pytest.raises(RecordingError) as caught:
        read_recording(path, 3)
    assert str(caught.value).startswith(str(path))
    assert len(str(caught.value).splitlines()) == 1
    return str(caught.value)


def test_an_mdf_file_says_what_a_csv_file_says(tmp_path: Path) -> None:
    path = written(tmp_path / "fit.mf4", (TIME, SPEEDS | OUTPUTS))
    text = tmp_path / "fit.csv"
    rows = zip(*COLUMNS.values(), strict=True)
    text.write_text("\n".join([",".join(COLUMNS), *(",".join(map(repr, row)) for row in rows)]))
    assert same(read_recording(path, 3), read_recording(text, 3))


def test_it_is_known_by_its_first_bytes(tmp_path: Path) -> None:
    path = written(tmp_path / "fit.mf4", (TIME, SPEEDS | OUTPUTS))
    assert read_recording(path.rename(tmp_path / "fit.dat"), 3).sample_count == 3


def test_groups_keep_their_times_and_winch_speeds_are_linear_between_them(tmp_path: Path) -> None:
    fast = np.arange(0.0, 0.0201, 0.005)
    path = written(
        tmp_path / "fit.mf4",
        (TIME, SPEEDS),
        (fast, {"tension_1": 100.0 + fast}),
        ([-0.01, 0.01, 0.03], {"x": [0.0, 1.0, 2.0]}),
    )
    recording = read_recording(path, 3)
    assert recording.time == pytest.approx(fast)
    assert recording.winch_speed[:, 0] == pytest.approx(np.interp(fast, TIME, SPEEDS["winch_speed_1"]))
    assert recording.tension[:, 0] == pytest.approx(100.0 + fast)
    assert np.isnan(recording.tension[:, 1]).all()
    assert np.flatnonzero(np.isfinite(recording.position[:, 0])).tolist() == [2]
    assert recording.position[2, 0] == 1.0


def test_other_channels_are_named_and_not_read(tmp_path: Path) -> None:
    path = written(tmp_path / "fit.mf4", (TIME, SPEEDS | OUTPUTS), (TIME, {"voltage": [1, 2, 3]}))
    assert read_recording(path, 3).unknown_columns == ("voltage",)


def test_other_units_are_converted_with_a_note(tmp_path: Path) -> None:
    plain = read_recording(written(tmp_path / "fit.mf4", (TIME, SPEEDS | OUTPUTS)), 3)
    units = {"x": "mm", "winch_speed_1": "m*s^-1", "tension_1": "kN"}
    recording = read_recording(written(tmp_path / "units.mf4", (TIME, SPEEDS | OUTPUTS), units=units), 3)
    assert np.array_equal(recording.position[:, 0], plain.position[:, 0] / 1e3, equal_nan=True)
    assert np.array_equal(recording.tension[:, 0], plain.tension[:, 0] * 1e3, equal_nan=True)
    assert np.array_equal(recording.winch_speed, plain.winch_speed)
    (note,) = recording.notes
    assert note.partition(": read ")[2] == "tension_1 in kN; x in mm"
    assert recording.columns["x"].unit == "mm" and not recording.has_time_column


def test_what_cannot_be_right_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "fit.mf4"
    fewer = {name: values for name, values in SPEEDS.items() if name != "winch_speed_2"}
    assert "the column winch_speed_2 is missing" in refused(written(path, (TIME, fewer | OUTPUTS)))
    in_furlongs = written(path, (TIME, SPEEDS | OUTPUTS), units={"x": "fur"})
    assert ": channel x: is in 'fur', not a known unit of length; write one of m, mm" in refused(in_furlongs)
    twice = written(path, (TIME, SPEEDS | OUTPUTS), (TIME, {"z": [1.0, 2.0, 3.0]}))
    assert "channel z: appears more than once" in refused(twice)
    words = written(path, (TIME, SPEEDS | {"z": np.array([b"a", b"b", b"c"])}))
    assert "channel z: contains no numbers" in refused(words)


def test_a_broken_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "fit.mf4"
    path.write_text("time,x\n0,1\n")
    assert "cannot be read as MDF" in refused(path)


def test_the_missing_package_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path / "fit.mf4", (TIME, SPEEDS | OUTPUTS))
    monkeypatch.setitem(sys.modules, "asammdf", None)
    assert "needs the package asammdf, which is not installed; run pip install asammdf" in refused(path)


def test_a_gap_of_winch_speeds_beside_another_group_is_not_interpolated(tmp_path: Path) -> None:
    time = np.arange(0.0, 10.0, 0.01)
    kept = time[(time <= 3.0) | (time >= 8.0)]
    speeds = {name: np.sin(kept) for name in SPEEDS}
    said = refused(written(tmp_path / "fit.mf4", (kept, speeds), (time, {"x": time})))
    assert "row 302, column winch_speed_1: is 'nan'" in said and "at most 5 in a row are interpolated" in said


def test_times_that_do_not_rise_are_refused(tmp_path: Path) -> None:
    again = np.concatenate([TIME, TIME])
    path = written(tmp_path / "fit.mf4", (again, {name: [*values, *values] for name, values in SPEEDS.items()}))
    assert f"its time {TIME[0]:g} s at sample 4 does not come after {TIME[2]:g} s" in refused(path)


def test_a_channel_without_times_is_refused(tmp_path: Path) -> None:
    with asammdf.MDF(written(tmp_path / "fit.mf4", (TIME, SPEEDS | OUTPUTS))) as content:
        master = content.groups[0].channels[content.masters_db[0]]
        master.channel_type, master.sync_type = 0, 0
        content.save(tmp_path / "counted.mf4")
    assert "channel winch_speed_1: has no times" in refused(tmp_path / "counted.mf4")
