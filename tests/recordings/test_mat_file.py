"""Recordings in MATLAB files of levels 4, 5 and 7.3: the same numbers as in CSV files, from vectors and matrices."""

from __future__ import annotations

import struct
import sys
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from tautwire.errors import RecordingError
from tautwire.recordings.column_names import column_names
from tautwire.recordings.recording import Recording, read_recording, recording_errors
from tests.recordings.test_parquet_file import COLUMNS, same

try:
    import h5py
except ImportError:
    h5py = None

SAMPLES = 7
TABLE: dict[str, Any] = {
    name: values[0] + np.array([0.0, 0.1, 0.3, 0.2, 1 / 3, 0.7, 1e-3]) for name, values in COLUMNS.items()
} | {"time": np.array([0.0, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06])}
MATRICES = {
    "time": TABLE["time"],
    "winch_speed": np.column_stack([TABLE[f"winch_speed_{cable}"] for cable in (1, 2, 3)]),
    "tension": np.column_stack([TABLE[f"tension_{cable}"] for cable in (1, 2, 3)]),
    "position": np.column_stack([TABLE[axis] for axis in "xyz"]),
}
needs_h5py = pytest.mark.skipif(h5py is None, reason="h5py is not installed")
LEVELS = ["4", "5", "5 compressed", pytest.param("7.3", marks=needs_h5py)]
DEEP_LEVELS = LEVELS[1:]


def written(path: Path, content: Mapping[str, Any], level: str = "5") -> Path:
    """A MATLAB file of a level; nested mappings are structs."""
    if level == "7.3":
        with h5py.File(path, "w", userblock_size=512) as file:
            add_to_group(file, content)
        with path.open("r+b") as file:
            file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    else:
        savemat(path, dict(content), appendmat=False, format=level[0], do_compression=level != "5", oned_as="column")
    return path


def add_to_group(group: Any, content: Mapping[str, Any]) -> None:
    """Add variables as MATLAB stores them in HDF5, the last index first."""
    for name, value in content.items():
        if isinstance(value, Mapping):
            member = group.create_group(name)
            member.attrs["MATLAB_class"] = np.bytes_("struct")
            add_to_group(member, value)
            continue
        if isinstance(value, str):
            stored, matlab_class = np.array([[ord(letter)] for letter in value], dtype=np.uint16), "char"
        else:
            stored, matlab_class = np.asarray(value), "logical" if np.asarray(value).dtype == bool else "double"
            stored = stored.astype(np.uint8) if matlab_class == "logical" else stored
            stored = stored[None, :] if stored.ndim == 1 else stored.T
        dataset = group.create_dataset(name, data=stored)
        dataset.attrs["MATLAB_class"] = np.bytes_(matlab_class)


def as_csv(path: Path) -> Recording:
    rows = zip(*TABLE.values(), strict=True)
    path.write_text("\n".join([",".join(TABLE), *(",".join(repr(float(cell)) for cell in row) for row in rows)]))
    return read_recording(path, 3)


def refused(path: Path) -> str:
    with pytest.raises(RecordingError) as caught:
        read_recording(path, 3)
    assert str(caught.value).startswith(str(path))
    assert len(str(caught.value).splitlines()) == 1
    return str(caught.value)


@pytest.mark.parametrize("level", LEVELS)
def test_vectors_say_what_a_csv_file_says(tmp_path: Path, level: str) -> None:
    plain = as_csv(tmp_path / "fit.csv")
    path = written(tmp_path / "fit.mat", TABLE, level)
    assert same(read_recording(path, 3), plain)
    assert not list(recording_errors(path, 3))
    rows = {name: values[None, :] for name, values in TABLE.items()}
    assert same(read_recording(written(tmp_path / "rows.mat", rows, level), 3), plain)


@pytest.mark.parametrize("level", LEVELS)
def test_matrices_are_columns_whichever_dimension_is_as_long_as_time(tmp_path: Path, level: str) -> None:
    plain = as_csv(tmp_path / "fit.csv")
    assert same(read_recording(written(tmp_path / "fit.mat", MATRICES, level), 3), plain)
    transposed = {name: np.atleast_2d(values.T) for name, values in MATRICES.items()}
    assert same(read_recording(written(tmp_path / "rows.mat", transposed, level), 3), plain)


@pytest.mark.parametrize("level", DEEP_LEVELS)
def test_members_of_nested_structs_are_columns(tmp_path: Path, level: str) -> None:
    plain = as_csv(tmp_path / "fit.csv")
    log = {"time": TABLE["time"], "winch": {"winch_speed": MATRICES["winch_speed"]}, "note": "a run"}
    log |= {"tension": MATRICES["tension"], "tracker": {axis: TABLE[axis] for axis in "xyz"}}
    path = written(tmp_path / "fit.mat", {"log": log, "gain": 2.0, "voltage": TABLE["x"]}, level)
    recording = read_recording(path, 3)
    assert same(recording, plain)
    assert set(recording.unknown_columns) == {"log.note", "gain", "voltage"}


def test_cells_and_arrays_of_structs_are_named_and_not_read(tmp_path: Path) -> None:
    cell = np.array(["a", np.arange(3.0)], dtype=object)
    structs = np.zeros(2, dtype=[("time", object)])
    path = written(tmp_path / "fit.mat", TABLE | {"cell": cell, "runs": structs, "force": np.zeros((7, 2))})
    assert read_recording(path, 3).unknown_columns == ("force_1", "force_2", "cell", "runs")


@pytest.mark.parametrize("level", DEEP_LEVELS)
def test_integers_and_logicals_are_exact(tmp_path: Path, level: str) -> None:
    counts = {
        "x": np.array([2**53, -(2**53), 0, 1, 2, 3, 4]),
        "y": np.arange(7, dtype=np.uint8),
        "z": np.arange(7) % 2 == 0,
        "tension_1": np.linspace(0.0, 1.0, 7, dtype=np.float32),
    }
    if level == "7.3":
        counts["x"] //= 2**20
    path = written(tmp_path / "fit.mat", TABLE | counts | {"x": counts["x"] // 2**20}, level)
    recording = read_recording(path, 3)
    assert np.array_equal(recording.position[:, 0], (counts["x"] // 2**20).astype(float))
    assert recording.position[:, 1].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert recording.position[:, 2].tolist() == [1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0]
    assert np.array_equal(recording.tension[:, 0], counts["tension_1"].astype(float))
    beyond = written(tmp_path / "beyond.mat", TABLE | {"x": np.full(7, 2**53 + 1)}, level)
    assert ": 'x': has integers beyond 2^53" in refused(beyond)


def test_it_is_known_by_its_first_bytes(tmp_path: Path) -> None:
    path = written(tmp_path / "fit.mat", TABLE).rename(tmp_path / "fit.dat")
    assert read_recording(path, 3).sample_count == SAMPLES


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"winch_speed_2": None}, "the column winch_speed_2 is missing"),
        ({"tension_4": TABLE["x"]}, "the column tension_4 belongs to no cable"),
        ({"x": np.zeros(6)}, "'x': is 6 x 1, there are 7 samples; save one number per sample"),
        ({"x": np.zeros((7, 2))}, "'x': is 7 x 2, must have 1 columns"),
        ({"position": np.zeros((7, 2))}, "'position': is 7 x 2, must have 3 columns"),
        ({"tension": np.zeros((7, 7))}, "'tension': is 7 x 7, its rows or its columns could be the samples"),
        ({"tension": MATRICES["tension"]}, "are both the column tension_1; keep one"),
        ({"y": TABLE["y"] + 1j}, "'y': is complex"),
        ({"y": "a text"}, "'y': contains no numbers"),
    ],
)
def test_what_cannot_be_right_is_refused(tmp_path: Path, level: str, changed: dict[str, Any], words: str) -> None:
    content = {name: value for name, value in (TABLE | changed).items() if value is not None}
    assert words in refused(written(tmp_path / "fit.mat", content, level))


@pytest.mark.parametrize("level", [level for level in LEVELS if "4" not in str(level)])
@pytest.mark.parametrize("shape", [(1, 1, 7), (7, 2, 3)])
def test_a_time_of_three_dimensions_is_refused_with_how_to_save_it(
    tmp_path: Path, level: str, shape: tuple[int, ...]
) -> None:
    said = refused(written(tmp_path / "fit.mat", TABLE | {"time": np.zeros(shape)}, level))
    assert f"'time': is {' x '.join(map(str, shape))}, must be a vector with one number per sample" in said
    assert "save squeeze(time)" in said


def element(kind: int, content: bytes) -> bytes:
    return struct.pack("<2I", kind, len(content)) + content + bytes(-len(content) % 8)


def array(array_class: int, shape: tuple[int, ...], name: str, *elements: bytes) -> bytes:
    """An array of level 5, whatever its header claims."""
    flags = element(6, struct.pack("<2I", array_class, 0))
    shape_element = element(5, struct.pack(f"<{len(shape)}i", *shape))
    return element(14, b"".join([flags, shape_element, element(1, name.encode()), *elements]))


def level_5(*elements: bytes) -> bytes:
    return b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + b"".join(elements)


def compressed(content: bytes) -> bytes:
    packed = zlib.compress(content)
    return struct.pack("<2I", 15, len(packed)) + packed


def test_a_matlab_table_is_refused_with_how_to_save_it(tmp_path: Path) -> None:
    path = tmp_path / "fit.mat"
    flags = element(6, struct.pack("<2I", 17, 0))
    for class_name in ("timetable", "timeseries", "Simulink.SimulationData.Dataset"):
        names = [element(1, text.encode()) for text in ("run", "MCOS", class_name)]
        opaque = element(14, b"".join([flags, *names, array(6, (1, 1), "", element(9, bytes(8)))]))
        path.write_bytes(level_5(compressed(opaque)))
        said = refused(path)
        assert f"'run': is a '{class_name}', an object that only MATLAB reads" in said
        assert "save('fit.mat', '-struct', 's')" in said


@needs_h5py
def test_objects_and_links_in_hdf5_are_not_followed(tmp_path: Path) -> None:
    path = written(tmp_path / "fit.mat", TABLE, "7.3")
    with h5py.File(path, "r+") as file:
        file["elsewhere"] = h5py.ExternalLink("/etc/passwd", "/x")
        file["loop"] = h5py.SoftLink("/")
    assert read_recording(path, 3).unknown_columns == ("elsewhere", "loop")
    with h5py.File(path, "r+") as file:
        file["run"] = np.zeros((1, 6), dtype=np.uint32)
        file["run"].attrs["MATLAB_class"] = np.bytes_("timetable")
        file["run"].attrs["MATLAB_object_decode"] = 3
    assert "'run': is a 'timetable'" in refused(path)
    with h5py.File(path, "r+") as file:
        del file["run"]
        file["run"] = file["/"]
    assert "holds more than" in refused(path)


MANY = 50_000_000
BOMBS = {
    "numbers": (level_5(compressed(array(6, (MANY, 1), "time", element(2, bytes(MANY))))), "at most 20000000 are read"),
    "claimed numbers": (level_5(array(6, (MANY, 1), "time")), "it ends within an array"),
    "cells": (level_5(array(1, (MANY, 1), "time")), "more than 100000 arrays"),
    "product": (level_5(array(1, (2**31 - 1, 2**31 - 1), "time")), "more than 100000 arrays"),
    "type": (level_5(array(6, (3, 1), "time", element(200, bytes(24)))), "are of type 200"),
    "negative": (level_5(array(6, (-1, 1), "time")), "has the shape (-1, 1)"),
    "backward": (struct.pack("<5I", 0, 2**32 - 1, 25, 0, 5) + b"time\0", "the shape -1 x 25"),
    "level 4": (struct.pack("<5I", 0, MANY, 1, 0, 5) + b"time\0", "it ends within an array"),
    "zeros": (level_5(compressed(element(14, bytes(MANY)))), "cannot be read"),
}


@pytest.mark.parametrize("name", BOMBS)
def test_a_bomb_is_refused_by_its_header(tmp_path: Path, name: str) -> None:
    content, words = BOMBS[name]
    path = tmp_path / "fit.mat"
    path.write_bytes(content)
    assert words in refused(path)


@needs_h5py
def test_an_hdf5_bomb_is_refused_by_its_header(tmp_path: Path) -> None:
    path = written(tmp_path / "fit.mat", {name: value for name, value in TABLE.items() if name != "time"}, "7.3")
    with h5py.File(path, "r+") as file:
        file.create_dataset("time", (1, MANY), "f8", chunks=(1, 2**16), compression="gzip")
    assert "has 50000000 samples, at most 20000000 are read" in refused(path)


@pytest.mark.parametrize("level", LEVELS)
def test_a_file_that_is_cut_anywhere_is_refused(tmp_path: Path, level: str) -> None:
    whole = written(tmp_path / "fit.mat", {"log": TABLE} if level != "4" else TABLE, level).read_bytes()
    path = tmp_path / "cut.mat"
    for size in (0, 3, 19, 100, 127, 130, 140, len(whole) // 2, len(whole) - 9):
        path.write_bytes(whole[:size])
        refused(path)
    path.write_text("time,x\n0,1\n")
    assert "cannot be read as a MATLAB file" in refused(path)


@settings(max_examples=60, deadline=None)
@given(places=st.lists(st.tuples(st.integers(0, 3_000), st.integers(0, 255)), min_size=1, max_size=4))
def test_a_damaged_file_is_read_or_refused_in_one_line(
    places: list[tuple[int, int]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.getbasetemp() / "damaged.mat"
    for level in ("4", "5", "5 compressed"):
        content = bytearray(written(path, {"log": TABLE} if level != "4" else TABLE, level).read_bytes())
        for place, byte in places:
            content[place % len(content)] = byte
        path.write_bytes(content)
        try:
            read_recording(path, 3)
        except RecordingError as error:
            assert len(str(error).splitlines()) == 1


@pytest.mark.parametrize("level", DEEP_LEVELS)
def test_members_of_structs_and_matrices_are_read_by_the_laboratorys_names(tmp_path: Path, level: str) -> None:
    drives = {f"drive{cable}": -TABLE[f"winch_speed_{cable}"] * 1e3 for cable in (1, 2, 3)}
    log = {"t": TABLE["time"], "F": MATRICES["tension"], "x": TABLE["x"], "y": TABLE["y"], "z": TABLE["z"]}
    path = written(tmp_path / "fit.mat", {"log": log | drives}, level)
    assert {"log.t", "log.F_1", "log.F_2", "log.F_3"} <= {column.name for column in column_names(path)}
    table = tmp_path / "columns.toml"
    table.write_text(
        """[recording.columns]
time = "log.t"
"tension_{}" = "log.F_{}"
"winch_speed_{}" = { name = "log.drive{}", unit = "mm/s", sign = -1 }
"""
    )
    recording = read_recording(path, 3, table)
    expected = read_recording(written(tmp_path / "standard.mat", TABLE), 3)
    np.testing.assert_array_equal(recording.measured(), expected.measured())
    np.testing.assert_allclose(recording.winch_speed, expected.winch_speed, rtol=1e-15)


@needs_h5py
def test_the_missing_package_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path / "fit.mat", TABLE, "7.3")
    monkeypatch.setitem(sys.modules, "h5py", None)
    assert "needs the package h5py, which is not installed; run pip install h5py" in refused(path)
