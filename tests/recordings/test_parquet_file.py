"""Recordings in Parquet files: the same numbers, rules and errors as in CSV files."""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tautwire.errors import InputError, RecordingError
from tautwire.recordings.recording import Recording, read_recording

COLUMNS: dict[str, Any] = {
    "time": [0.0, 0.01, 0.02],
    "winch_speed_1": [0.1, 0.11, -0.12],
    "winch_speed_2": [0.2, 0.21, 0.22],
    "winch_speed_3": [0.3, 0.31, 0.32],
    "tension_1": [101.0, 111.0, 121.0],
    "tension_2": [102.0, 112.0, 122.0],
    "tension_3": [103.0, 113.0, 123.0],
    "x": [1.5, 1.6, 1.7],
    "y": [2.5, 2.6, 2.7],
    "z": [3.5, 3.6, 3.7],
}


def written(folder: Path, name: str = "fit.parquet", **changed: Any) -> Path:
    """A Parquet file of the plain recording with some columns changed, added, or removed where None."""
    columns = {key: value for key, value in (COLUMNS | changed).items() if value is not None}
    pq.write_table(pa.table(columns), folder / name)
    return folder / name


def refused(path: Path) -> RecordingError:
    """The error about a recording, after checking what every such error has."""
    with pytest.raises(RecordingError) as caught:
        read_recording(path, 3)
    error = caught.value
    assert error.where.startswith(str(path))
    assert error.problem and error.hint
    assert len(str(error).splitlines()) == 1
    return error


def same(first: Recording, second: Recording) -> bool:
    return all(
        np.array_equal(getattr(first, name), getattr(second, name), equal_nan=True)
        for name in ("time", "winch_speed", "tension", "position")
    )


def test_a_parquet_file_says_what_a_csv_file_says(tmp_path: Path) -> None:
    path = written(tmp_path)
    text = tmp_path / "fit.csv"
    pq.read_table(path).to_pandas().to_csv(text, index=False)
    recording = read_recording(path, 3)
    assert same(recording, read_recording(text, 3))
    assert recording.path == str(path)
    assert recording.unknown_columns == ()
    assert not recording.time.flags.writeable and not recording.position.flags.writeable


def test_it_is_known_by_its_name_or_its_content(tmp_path: Path) -> None:
    plain = read_recording(written(tmp_path), 3)
    assert same(plain, read_recording(written(tmp_path, "fit.PARQUET"), 3))
    assert same(plain, read_recording(written(tmp_path, "fit.dat"), 3))


def test_columns_may_stand_in_any_order_and_lack_outputs(tmp_path: Path) -> None:
    pq.write_table(pa.table(dict(reversed(COLUMNS.items()))).drop_columns(["y", "tension_2"]), tmp_path / "fit.parquet")
    recording = read_recording(tmp_path / "fit.parquet", 3)
    assert recording.winch_speed.tolist()[2] == [-0.12, 0.22, 0.32]
    assert np.isnan(recording.measured()).any(axis=0).tolist() == [False, True, False, False, True, False]


def test_nulls_and_nans_of_outputs_are_missing(tmp_path: Path) -> None:
    path = written(tmp_path, tension_2=[102.0, None, 122.0], z=[3.5, 3.6, float("nan")], x=[None] * 3)
    missing = np.argwhere(np.isnan(read_recording(path, 3).measured())).tolist()
    assert missing == [[0, 0], [1, 0], [1, 4], [2, 0], [2, 2]]


@pytest.mark.parametrize(
    "stored",
    [
        pa.array([101, 111, 121], pa.int16()),
        pa.array([101, 111, 121], pa.uint64()),
        pa.array([101.0, 111.0, 121.0], pa.float32()),
        pa.array([Decimal("101.00"), Decimal("111.00"), Decimal("121.00")], pa.decimal128(9, 2)),
    ],
)
def test_any_type_of_number_is_read(tmp_path: Path, stored: pa.Array) -> None:
    assert read_recording(written(tmp_path, tension_1=stored), 3).tension[:, 0].tolist() == [101.0, 111.0, 121.0]


def test_unknown_columns_of_any_type_are_kept_out_and_named(tmp_path: Path) -> None:
    path = written(tmp_path, note=["a", "b", "c"], place=[{"x": 1.0}] * 3, **{"": [1, 2, 3]})
    recording = read_recording(path, 3)
    assert recording.unknown_columns == ("note", "place", "(column 13)")
    assert same(recording, read_recording(written(tmp_path), 3))


def test_row_groups_are_read_on_end(tmp_path: Path) -> None:
    count = 10_000
    values = np.random.default_rng(1).normal(size=(count, 10))
    values[:, 0] = np.arange(count) * 0.01
    table = pa.table(dict(zip(COLUMNS, values.T, strict=True)))
    pq.write_table(table, tmp_path / "fit.parquet", row_group_size=999)
    recording = read_recording(tmp_path / "fit.parquet", 3)
    assert np.array_equal(recording.measured(), values[:, [7, 8, 9, 4, 5, 6]])
    values[count - 1, 7] = np.inf
    pq.write_table(pa.table(dict(zip(COLUMNS, values.T, strict=True))), tmp_path / "fit.parquet", row_group_size=999)
    assert refused(tmp_path / "fit.parquet").where.endswith(f": row {count}, column x")


@pytest.mark.parametrize(
    ("changed", "place", "words"),
    [
        ({"winch_speed_2": [0.2, 0.21, None]}, ": row 3, column winch_speed_2", ["'nan'", "number"]),
        ({"winch_speed_2": [0.2, 0.21, -np.inf]}, ": row 3, column winch_speed_2", ["'-inf'", "finite"]),
        ({"time": [None, 0.01, 0.02]}, ": row 1, column time", ["'nan'", "number"]),
        ({"time": [0.0, 0.02, 0.01]}, ": row 3, column time", ["0.01 after 0.02", "rise"]),
        ({"tension_1": [101.0, -2e12, 121.0]}, ": row 2, column tension_1", ["-2000000000000.0", "1e+12"]),
        ({"z": ["3.5", "3.6", "3.7"]}, ": column z", ["string", "float64"]),
        ({"time": np.array([1, 2, 3], "datetime64[s]")}, ": column time", ["timestamp", "float64"]),
        ({"x": [True, False, True]}, ": column x", ["bool", "float64"]),
        ({"y": [{"m": 1.0}] * 3}, ": column y", ["struct", "float64"]),
        ({"winch_speed_3": None}, "", ["winch_speed_3 is missing"]),
        ({"time": None, "Time": [0.0, 0.01, 0.02]}, "", ["time is missing", "rename 'Time'"]),
        ({"tension_4": [1.0, 2.0, 3.0]}, "", ["tension_4", "cables 1 to 3", "robot file"]),
        ({name: values[:1] for name, values in COLUMNS.items()}, "", ["1 sample", "2"]),
        ({name: pa.array([], pa.float64()) for name in COLUMNS}, "", ["no samples", "2"]),
    ],
)
def test_refuses_a_wrong_cell_or_column(tmp_path: Path, changed: dict[str, Any], place: str, words: list[str]) -> None:
    error = refused(written(tmp_path, **changed))
    assert error.where == str(tmp_path / "fit.parquet") + place
    assert not [word for word in words if word not in str(error)], str(error)


def test_refuses_a_column_that_is_there_twice(tmp_path: Path) -> None:
    arrays = [pa.array(values) for values in COLUMNS.values()]
    names = [*list(COLUMNS)[:-1], "y"]
    pq.write_table(pa.Table.from_arrays(arrays, names=names), tmp_path / "fit.parquet")
    assert "'y' appears twice" in str(refused(tmp_path / "fit.parquet"))


@pytest.mark.parametrize("content", [b"", b"PAR1", b"time,x\n0,1\n1,2\n", b"PAR1" + bytes(100) + b"PAR1"])
def test_refuses_what_is_no_parquet(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "fit.parquet").write_bytes(content)
    error = refused(tmp_path / "fit.parquet")
    assert "cannot be read as Parquet" in error.problem
    assert "export it again" in error.hint


@pytest.mark.parametrize(("name", "words"), [("absent.parquet", "no such file"), ("folder.parquet", "folder")])
def test_refuses_a_path_that_is_no_file(tmp_path: Path, name: str, words: str) -> None:
    (tmp_path / "folder.parquet").mkdir()
    with pytest.raises(RecordingError, match=words):
        read_recording(tmp_path / name, 3)


@settings(max_examples=200, deadline=None)
@given(place=st.floats(0.0, 1.0), length=st.integers(0, 30), patch=st.binary(max_size=30))
def test_damaged_files_are_read_or_refused(
    tmp_path_factory: pytest.TempPathFactory, place: float, length: int, patch: bytes
) -> None:
    path = written(tmp_path_factory.getbasetemp(), "damaged.parquet")
    content = path.read_bytes()
    begin = round(place * len(content))
    path.write_bytes(content[:begin] + patch + content[begin + length :])
    try:
        recording = read_recording(path, 3)
    except InputError as error:
        assert len(str(error).splitlines()) == 1
    else:
        assert np.isfinite(recording.winch_speed).all()
        assert (np.diff(recording.time) > 0.0).all()
        assert not np.isinf(recording.measured()).any()
