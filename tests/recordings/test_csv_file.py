"""Recordings: what is read, and what is refused with which file, line and column."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd  # type: ignore[import-untyped,unused-ignore]
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tautwire.errors import InputError, RecordingError
from tautwire.recordings.recording import Recording, read_recording, require_outputs

HEADER = "time,winch_speed_1,winch_speed_2,winch_speed_3,tension_1,tension_2,tension_3,x,y,z"
PLAIN = f"""{HEADER}
0,0.1,0.2,0.3,101,102,103,1.5,2.5,3.5
0.01,0.11,0.21,0.31,111,112,113,1.6,2.6,3.6
0.02,-0.12,0.22,0.32,121,122,123,1.7,2.7,3.7
"""


def read(folder: Path, text: str | bytes, cable_count: int = 3) -> Recording:
    """The recording in a text."""
    path = folder / "fit.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_recording(path, cable_count)


def refused(folder: Path, text: str | bytes, cable_count: int = 3) -> RecordingError:
    """The error about a recording, after checking what every such error has."""
    with pytest.raises(RecordingError) as caught:
        read(folder, text, cable_count)
    error = caught.value
    assert error.where.startswith(str(folder / "fit.csv"))
    assert error.problem and error.hint
    assert len(str(error).splitlines()) == 1
    assert "pandas" not in str(error)
    return error


def place_of(error: RecordingError) -> str:
    """The line and column that an error names."""
    return error.where.partition("fit.csv: ")[2]


def test_reads_every_column(tmp_path: Path) -> None:
    recording = read(tmp_path, PLAIN)
    assert recording.path == str(tmp_path / "fit.csv")
    assert recording.time.tolist() == [0.0, 0.01, 0.02]
    assert recording.winch_speed.tolist() == [[0.1, 0.2, 0.3], [0.11, 0.21, 0.31], [-0.12, 0.22, 0.32]]
    assert recording.tension[1].tolist() == [111.0, 112.0, 113.0]
    assert recording.position[2].tolist() == [1.7, 2.7, 3.7]
    assert recording.unknown_columns == ()
    assert (recording.sample_count, recording.cable_count, recording.duration) == (3, 3, 0.02)
    assert recording.has_tension and recording.has_position
    assert {a.dtype for a in (recording.time, recording.winch_speed, recording.tension)} == {np.dtype("float64")}


def test_measured_outputs_stand_in_the_order_of_their_names(tmp_path: Path) -> None:
    recording = read(tmp_path, PLAIN)
    assert recording.channel_names == ("x", "y", "z", "tension_1", "tension_2", "tension_3")
    assert recording.measured()[0].tolist() == [1.5, 2.5, 3.5, 101.0, 102.0, 103.0]


def test_columns_may_stand_in_any_order(tmp_path: Path) -> None:
    frame = pd.read_csv(Path(read(tmp_path, PLAIN).path))
    turned = read(tmp_path, frame[frame.columns[::-1]].to_csv(index=False))
    plain = read(tmp_path, PLAIN)
    assert np.array_equal(turned.measured(), plain.measured())
    assert np.array_equal(turned.winch_speed, plain.winch_speed)


@pytest.mark.parametrize(
    "text",
    [
        "\ufeff" + PLAIN,
        PLAIN.replace("\n", "\r\n"),
        PLAIN.replace("\n", "\r"),
        PLAIN.rstrip("\n"),
        PLAIN + "\n\r\n  \n",
        PLAIN.replace("\n0.02", "\n\n0.02"),
        PLAIN.replace(",", ", "),
        PLAIN.replace(",", " ,"),
        PLAIN.replace("time", '"time"').replace("0.01", '"0.01"'),
        PLAIN.replace("0.11", "1.1e-1"),
    ],
)
def test_harmless_differences_in_writing_do_not_matter(tmp_path: Path, text: str) -> None:
    plain = read(tmp_path, PLAIN)
    recording = read(tmp_path, text)
    assert np.array_equal(recording.time, plain.time)
    assert np.array_equal(recording.winch_speed, plain.winch_speed)
    assert np.array_equal(recording.measured(), plain.measured())


@pytest.mark.parametrize("missing", ["", " ", "NaN", "nan", "NA"])
def test_empty_cells_of_outputs_are_missing(tmp_path: Path, missing: str) -> None:
    recording = read(tmp_path, PLAIN.replace("112", missing).replace("3.7", missing))
    assert np.argwhere(np.isnan(recording.measured())).tolist() == [[1, 4], [2, 2]]


def test_absent_outputs_are_missing(tmp_path: Path) -> None:
    recording = read(tmp_path, "time,winch_speed_1,x,tension_2,winch_speed_2\n0,1,2,3,4\n1,1,2,3,4\n", 2)
    assert recording.winch_speed.tolist() == [[1.0, 4.0], [1.0, 4.0]]
    assert np.isnan(recording.position[:, 1:]).all()
    assert np.isnan(recording.tension[:, 0]).all()
    assert recording.tension[:, 1].tolist() == [3.0, 3.0]
    assert recording.has_tension and recording.has_position


def test_unknown_columns_are_kept_out_and_named(tmp_path: Path) -> None:
    lines = PLAIN.splitlines()
    notes = ["note,X,", "fine,1,0", '"all, too ""fine""",n/a,1', ",,2"]
    text = "\n".join(f"{line},{note}" for line, note in zip(lines, notes, strict=True))
    recording = read(tmp_path, text)
    assert recording.unknown_columns == ("note", "X", "(column 13)")
    assert np.array_equal(recording.measured(), read(tmp_path, PLAIN).measured())


def test_reads_what_pandas_writes_with_its_index(tmp_path: Path) -> None:
    frame = pd.read_csv(Path(read(tmp_path, PLAIN).path))
    recording = read(tmp_path, frame.to_csv())
    assert recording.unknown_columns == ("(column 1)",)
    assert recording.time.tolist() == [0.0, 0.01, 0.02]


def test_arrays_are_read_only(tmp_path: Path) -> None:
    recording = read(tmp_path, PLAIN)
    for array in (recording.time, recording.winch_speed, recording.tension, recording.position):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0


@pytest.mark.parametrize(
    ("old", "new", "place", "words"),
    [
        ("122", "abc", "line 4, column tension_2", ["'abc'", "not a number"]),
        ("122", "1_2", "line 4, column tension_2", ["'1_2'", "not a number"]),
        ("122", '"12,2"', "line 4, column tension_2", ["'12,2'", "decimal point"]),
        ("122", "12,2", "line 4", ["11 cells", "10", "decimal point"]),
        ("122,", "", "line 4", ["9 cells", "10"]),
        ("122", "inf", "line 4, column tension_2", ["'inf'", "finite"]),
        ("122", "1e999", "line 4, column tension_2", ["'1e999'", "finite"]),
        ("122", "-2e12", "line 4, column tension_2", ["'-2e12'", "1e+12"]),
        ("122", "0x10", "line 4, column tension_2", ["'0x10'", "not a number"]),
        ("122", '"', "line 4", ["quotation"]),
        ("0.22", "", "line 4, column winch_speed_2", ["empty", "number", "between numbers"]),
        ("0.22", "nan", "line 4, column winch_speed_2", ["'nan'", "number"]),
        (",0.2,", ",,", "line 2, column winch_speed_2", ["empty", "number"]),
        ("0.21", "-inf", "line 3, column winch_speed_2", ["'-inf'", "finite"]),
        ("\n0.01", "\n", "line 3, column time", ["empty", "number"]),
        ("\n0.01", "\n0", "line 3, column time", ["0.0 after 0.0", "rise"]),
        ("\n0.02", "\n0.005", "line 4, column time", ["0.005 after 0.01", "rise"]),
        ("\n0.02", "\n1700000000000", "line 4, column time", ["1700000000000", "as ms since 1970"]),
        ("\n0.02", "\n-1700000000000", "line 4, column time", ["-1700000000000", "1e+12"]),
        ("\n0.01", "\n\n\n0", "line 5, column time", ["rise"]),
        ("time,", "", "line 1", ["time", "missing"]),
        ("time,", "Time,", "line 1", ["time", "missing", "'Time'"]),
        ("winch_speed_2", "winch_speed2", "line 1", ["winch_speed_2", "missing", "'winch_speed2'"]),
        ("winch_speed_3", "winch_speed_0", "line 1", ["winch_speed_0", "1 to 3"]),
        ("winch_speed_3", "winch_speed_4", "line 1", ["winch_speed_4", "1 to 3", "robot file"]),
        ("tension_3", "tension_8", "line 1", ["tension_8", "1 to 3"]),
        ("y,z", "y,y", "line 1", ["'y'", "twice"]),
        (HEADER + "\n", "", "line 1", ["header", "numbers"]),
        (HEADER, "", "line 2", ["header", "numbers"]),
    ],
)
def test_refuses_a_wrong_cell_or_column(tmp_path: Path, old: str, new: str, place: str, words: list[str]) -> None:
    assert PLAIN.count(old) == 1
    error = refused(tmp_path, PLAIN.replace(old, new))
    assert place_of(error) == place
    assert not [word for word in words if word not in str(error)], str(error)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["empty"]),
        ("\ufeff\n \n", ["empty"]),
        (HEADER, ["no samples", "2"]),
        ("\n".join(PLAIN.splitlines()[:2]), ["1 sample,", "2"]),
        (PLAIN.replace(".", ","), ["line 2", "decimal point"]),
        (PLAIN.replace("\n0", ",\n0").replace(",\n", "\n", 1), ["line 2", "11 cells"]),
        (PLAIN.encode("utf-16")[:-1], ["UTF-16"]),
        (PLAIN.encode() + b"0.03\xe9,", ["line 5", "0xe9", "UTF-8"]),
        (PLAIN.encode() + b"\0\0", ["line 5", "zero byte"]),
        (b"PK\x03\x04" + bytes(50), ["zip"]),
        (b"\x1f\x8b\x08" + bytes(range(256)), ["gzip", "decompress it first"]),
        (bytes(range(1, 128)), ["line 1"]),
        (HEADER + "\n" + "0," * 200_000, ["line 2", "200001 cells"]),
        ("t" * 200_000 + PLAIN, ["line 1"]),
        ("winch_speed_99999999999999999999," + PLAIN, ["line 2"]),
    ],
)
def test_refuses_a_wrong_file(tmp_path: Path, text: str | bytes, words: list[str]) -> None:
    error = refused(tmp_path, text)
    assert not [word for word in words if word not in str(error)], str(error)


def test_refuses_a_recording_of_a_larger_robot(tmp_path: Path) -> None:
    assert "give the robot file that belongs" in str(refused(tmp_path, PLAIN, cable_count=2))


def test_refuses_a_recording_of_a_smaller_robot(tmp_path: Path) -> None:
    assert "winch_speed_4 is missing" in str(refused(tmp_path, PLAIN, cable_count=8))


@pytest.mark.parametrize(("name", "words"), [("absent.csv", "no such file"), (".", "folder")])
def test_refuses_a_path_that_is_no_file(tmp_path: Path, name: str, words: str) -> None:
    with pytest.raises(RecordingError, match=words):
        read_recording(tmp_path / name, 3)


def test_compressed_files_are_not_opened_by_their_name(tmp_path: Path) -> None:
    path = tmp_path / "fit.csv.gz"
    path.write_text(PLAIN)
    assert read_recording(path, 3).sample_count == 3


def test_only_whoever_needs_outputs_asks_for_them(tmp_path: Path) -> None:
    recording = read(tmp_path, "time,winch_speed_1,X,x\n0,1,2,\n1,1,2,\n", 1)
    assert not recording.has_position and not recording.has_tension
    with pytest.raises(RecordingError, match=r"no number in any of the outputs .*not read: 'X'") as caught:
        require_outputs(recording)
    assert caught.value.where == recording.path
    require_outputs(read(tmp_path, PLAIN))


@pytest.mark.validate
def test_long_recordings_are_read_whole(tmp_path: Path) -> None:
    count = 50_000
    values = np.column_stack([np.arange(count) * 0.01, np.random.default_rng(1).normal(size=(count, 9))])
    frame = pd.DataFrame(values, columns=HEADER.split(","))
    recording = read(tmp_path, frame.to_csv(index=False))
    assert np.allclose(recording.measured(), values[:, [7, 8, 9, 4, 5, 6]], rtol=1e-15, atol=0.0)
    frame.loc[count - 1, "x"] = np.inf
    assert place_of(refused(tmp_path, frame.to_csv(index=False))) == f"line {count + 1}, column x"


FIGURE = st.floats(-1e12, 1e12)


@settings(max_examples=60, deadline=None)
@given(
    steps=st.lists(st.floats(1e-3, 1e3), min_size=2, max_size=5),
    figures=st.lists(st.lists(FIGURE | st.none(), min_size=6, max_size=6), min_size=5, max_size=5),
)
def test_finite_numbers_are_read_to_the_last_bit_but_one(
    tmp_path_factory: pytest.TempPathFactory, steps: list[float], figures: list[list[float | None]]
) -> None:
    times = np.cumsum(steps)
    lines = [HEADER]
    for time, row in zip(times, figures, strict=False):
        cells = ",".join("" if figure is None else repr(figure) for figure in row)
        lines.append(f"{float(time)!r},{float(time)!r},0,1,{cells}")
    path = tmp_path_factory.getbasetemp() / "figures.csv"
    path.write_text("\n".join(lines))
    recording = read_recording(path, 3)
    wanted = np.array(figures[: len(times)], dtype=float)
    assert np.allclose(recording.time, times, rtol=1e-15, atol=0.0)
    read_back = np.hstack((recording.tension, recording.position))
    assert np.allclose(read_back, wanted, rtol=1e-15, atol=1e-300, equal_nan=True)


@settings(max_examples=200, deadline=None)
@given(
    place=st.integers(0, len(PLAIN)),
    length=st.integers(0, 30),
    patch=st.binary(max_size=30) | st.text(max_size=9),
)
def test_damaged_files_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, place: int, length: int, patch: bytes | str
) -> None:
    path = tmp_path_factory.getbasetemp() / "damaged.csv"
    put = patch if isinstance(patch, bytes) else patch.encode()
    path.write_bytes(PLAIN[:place].encode() + put + PLAIN[place + length :].encode())
    try:
        recording = read_recording(path, 3)
    except InputError as error:
        assert len(str(error).splitlines()) == 1
    else:
        assert np.isfinite(recording.winch_speed).all()
        assert (np.diff(recording.time) > 0.0).all()
        assert not np.isinf(recording.measured()).any()


LENGTHS = """time,rope_length_1,winch_speed_2,rope_length_2,winch_speed_3,x
0,5.0,0.1,2.00,0.3,1.5
0.1,4.9,0.1,2.02,0.3,1.6
0.2,4.7,0.1,2.06,0.3,1.7
"""


def test_the_rate_of_a_rope_length_goes_before_a_winch_speed(tmp_path: Path) -> None:
    recording = read(tmp_path, LENGTHS)
    assert recording.winch_speed[:, 0] == pytest.approx([1.0, 1.5, 2.0])
    assert recording.winch_speed[:, 1] == pytest.approx([-0.2, -0.3, -0.4])
    assert np.array_equal(recording.winch_speed[:, 2], [0.3, 0.3, 0.3])
    (note,) = recording.notes
    assert note.endswith(": winch speeds are the rates of the recorded rope lengths, of cables 1, 2")
    assert recording.unknown_columns == ()


def test_winch_speeds_from_lengths_do_not_drift_from_them(tmp_path: Path) -> None:
    time = np.arange(0.0, 20.0, 0.01)
    length = np.round(3.0 - 0.4 * np.sin(time), 4)
    frame = pd.DataFrame({"time": time, "rope_length_1": length, "winch_speed_2": 0.0, "winch_speed_3": 0.0, "x": 1.0})
    recording = read(tmp_path, frame.to_csv(index=False))
    speed = recording.winch_speed[:, 0]
    reeled_in = np.append(0.0, np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time)))
    assert np.max(np.abs(length[0] - reeled_in - length)) < 2e-4


def test_a_rope_length_must_be_there_at_the_first_sample(tmp_path: Path) -> None:
    error = refused(tmp_path, LENGTHS.replace("0,5.0", "0,"))
    assert place_of(error) == "line 2, column rope_length_1"
    assert "must be a number" in error.problem
