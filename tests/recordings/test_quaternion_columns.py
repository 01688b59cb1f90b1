"""Recorded orientations: read from every format as one unit quaternion, refused where they are none."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd  # type: ignore[import-untyped,unused-ignore]
import pytest
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from tautwire.errors import RecordingError
from tautwire.recordings.quaternion_columns import rotation_vectors, with_continuous_signs
from tautwire.recordings.recording import (
    Recording,
    read_recording,
    read_tracker,
    recording_errors,
    recording_from_frame,
)
from tautwire.robot.schema import QUATERNION_COLUMNS, RecordedColumn

SAMPLES = 40
TIME = np.arange(SAMPLES) / 100.0
# Two and a half turns about an axis that moves, of which scipy writes every quaternion with a sign of its own choice.
TURNING = Rotation.from_rotvec(np.outer(np.linspace(0.1, 16.0, SAMPLES), [0.6, 0.0, 0.8])) * Rotation.from_rotvec(
    np.outer(np.sin(9.0 * TIME), [0.0, 0.4, 0.0])
)
RECORDED = TURNING.as_quat()[:, [3, 0, 1, 2]] * np.where(np.arange(SAMPLES) % 3 == 1, -1.0, 1.0)[:, None]


def frame(quaternions: Any = RECORDED) -> pd.DataFrame:
    """A recording of three cables with these orientations."""
    outputs = {name: np.cos(TIME + index) for index, name in enumerate(("x", "y", "z"))}
    speeds = {f"winch_speed_{cable}": np.sin(TIME + cable) for cable in (1, 2, 3)}
    return pd.DataFrame(
        {"time": TIME, **speeds, **outputs, **dict(zip(QUATERNION_COLUMNS, quaternions.T, strict=True))}
    )


def shows_the_turning(recording: Recording, rows: slice = slice(None)) -> None:
    """Checks norms, continuity, and the rotations."""
    quaternions = recording.orientation[rows]
    assert recording.has_orientation and quaternions.shape == (len(TIME[rows]), 4)
    assert np.abs(np.linalg.norm(quaternions, axis=1) - 1.0).max() < 1e-15
    assert np.all(np.sum(quaternions[1:] * quaternions[:-1], axis=1) > 0.0)
    errors = Rotation.from_quat(quaternions[:, [1, 2, 3, 0]]) * TURNING[rows].inv()
    assert errors.magnitude().max() < 1e-12


def refused(table: pd.DataFrame, folder: Path) -> RecordingError:
    """The one error of a recording, the same when read and when all errors are listed."""
    path = folder / "fit.csv"
    table.to_csv(path, index=False)
    with pytest.raises(RecordingError) as caught:
        read_recording(path, 3)
    (listed,) = recording_errors(path, 3)
    assert str(listed) == str(caught.value) and len(str(listed).splitlines()) == 1
    return caught.value


def test_every_format_shows_one_turning_platform(tmp_path: Path) -> None:
    frame().to_csv(tmp_path / "fit.csv", index=False)
    frame().to_parquet(tmp_path / "fit.parquet")
    savemat(tmp_path / "fit.mat", {name: column.to_numpy() for name, column in frame().items()})
    matrix = {name: frame()[name].to_numpy() for name in ("time", "winch_speed_1", "winch_speed_2", "winch_speed_3")}
    savemat(tmp_path / "matrix.mat", matrix | {"log": {"orientation": RECORDED}})
    for name in ("fit.csv", "fit.parquet", "fit.mat", "matrix.mat"):
        shows_the_turning(read_recording(tmp_path / name, 3))
    shows_the_turning(recording_from_frame(frame(), 3))


def test_mdf_channels_without_a_unit_show_it_too(tmp_path: Path) -> None:
    asammdf = pytest.importorskip("asammdf")
    content = asammdf.MDF(version="4.10")
    units = {"winch": "m/s", "x": "m", "y": "m", "z": "m", "qw": "1", "qx": "-"}
    columns = {name: values.to_numpy() for name, values in frame().items() if name != "time"}
    content.append(
        [asammdf.Signal(values, TIME, units.get(name.partition("_")[0], ""), name) for name, values in columns.items()]
    )
    content.save(tmp_path / "fit.mf4", overwrite=True)
    content.close()
    shows_the_turning(read_recording(tmp_path / "fit.mf4", 3))


def test_declared_names_order_and_signs_are_read(tmp_path: Path) -> None:
    own = dict(zip(QUATERNION_COLUMNS, ("Rot W", "Rot X", "Rot Y", "Rot Z"), strict=True))
    conjugate = frame(RECORDED * [1.0, -1.0, -1.0, -1.0]).rename(columns=own)
    conjugate.to_csv(tmp_path / "fit.csv", index=False)
    declared = [RecordedColumn(name, own[name], sign=1.0 if name == "qw" else -1.0) for name in QUATERNION_COLUMNS]
    shows_the_turning(read_recording(tmp_path / "fit.csv", 3, declared))


@pytest.mark.parametrize("units", ["s;m/s;m/s;m/s;mm;mm;mm;-;-;-;-", "s;m/s;m/s;m/s;mm;mm;mm;;;;"])
def test_a_line_of_units_leaves_quaternions_without_one(units: str, tmp_path: Path) -> None:
    lines = frame().to_csv(index=False, sep=";").splitlines()
    (tmp_path / "fit.csv").write_text("\n".join([lines[0], units, *lines[1:]]))
    recording = read_recording(tmp_path / "fit.csv", 3)
    shows_the_turning(recording)
    assert recording.position[0, 0] == 0.001


def test_a_lost_platform_has_no_orientation_and_the_sign_goes_on_behind_it(tmp_path: Path) -> None:
    table = frame()
    table.loc[10:14, list(QUATERNION_COLUMNS)] = np.nan
    table.to_csv(tmp_path / "fit.csv", index=False)
    recording = read_recording(tmp_path / "fit.csv", 3)
    assert np.isnan(recording.orientation[10:15]).all() and np.isfinite(recording.orientation).sum() == 4 * 35
    shows_the_turning(recording, slice(0, 10))
    shows_the_turning(recording, slice(15, None))
    assert recording.orientation[9] @ recording.orientation[15] > 0.0
    assert recording.part(9, 16).orientation.shape == (7, 4)


def test_a_tracker_file_has_orientations(tmp_path: Path) -> None:
    frame().drop(columns=["winch_speed_1", "winch_speed_2", "winch_speed_3"]).to_csv(tmp_path / "t.csv", index=False)
    shows_the_turning(read_tracker(tmp_path / "t.csv"))


def test_a_recording_without_orientation_says_so() -> None:
    recording = recording_from_frame(frame().drop(columns=list(QUATERNION_COLUMNS)), 3)
    assert not recording.has_orientation and np.isnan(recording.orientation).all()
    assert recording.orientation.shape == (SAMPLES, 4)
    assert set(QUATERNION_COLUMNS).isdisjoint(recording.frame().columns)


def test_a_recording_as_a_table_is_read_as_the_same_recording() -> None:
    recording = recording_from_frame(frame(), 3)
    again = recording_from_frame(recording.frame(), 3)
    assert np.abs(again.orientation - recording.orientation).max() < 1e-15


@pytest.mark.parametrize("lacking", [("qw",), ("qx", "qz"), ("qw", "qx", "qy")])
def test_a_part_of_the_quaternion_is_refused(lacking: tuple[str, ...], tmp_path: Path) -> None:
    error = refused(frame().drop(columns=list(lacking)), tmp_path)
    assert error.where.endswith("fit.csv: line 1")
    assert error.problem == f"the orientation has no column {', '.join(lacking)}, of qw, qx, qy, qz"
    assert "declare" in error.hint


def test_a_norm_that_is_not_1_is_refused_with_its_line_and_the_bound(tmp_path: Path) -> None:
    table = frame()
    table.loc[7, list(QUATERNION_COLUMNS)] *= 1.011
    error = refused(table, tmp_path)
    assert error.where.endswith("fit.csv: line 9")
    assert error.problem == "has the norm 1.011 in qw, qx, qy, qz, must be within 1% of 1"
    assert "empty where the tracker lost" in error.hint
    table.loc[7, list(QUATERNION_COLUMNS)] *= 1.009 / 1.011
    shows_the_turning(recording_from_frame(table, 3))


def test_zeros_are_where_the_tracker_had_lost_the_platform(tmp_path: Path) -> None:
    table = frame()
    table.loc[3:5, list(QUATERNION_COLUMNS)] = 0.0
    path = tmp_path / "fit.csv"
    table.to_csv(path, index=False)
    recording = read_recording(path, 3)
    assert list(recording_errors(path, 3)) == []
    assert np.flatnonzero(np.isnan(recording.orientation).all(axis=1)).tolist() == [3, 4, 5]
    shows_the_turning(recording, slice(6, None))
    assert recording.notes == (f"{path}: qw, qx, qy, qz: 3 samples of zeros are no orientation: not used",)


def test_a_quaternion_with_empty_cells_is_refused(tmp_path: Path) -> None:
    table = frame()
    table.loc[3, "qy"] = np.nan
    assert "has no number in qy, and has in the others" in refused(table, tmp_path).problem


def test_signs_go_on_behind_samples_without_orientation() -> None:
    lost = np.full(4, np.nan)
    quaternions = np.array([[1.0, 0.0, 0.0, 0.0], lost, [-1.0, 0.0, 0.0, 0.0], [0.8, 0.6, 0.0, 0.0]])
    expected = np.array([[1.0, 0.0, 0.0, 0.0], lost, [1.0, 0.0, 0.0, 0.0], [0.8, 0.6, 0.0, 0.0]])
    assert np.array_equal(with_continuous_signs(quaternions), expected, equal_nan=True)
    assert with_continuous_signs(np.empty((0, 4))).shape == (0, 4)


def test_rotation_vectors_count_from_the_first_orientation_that_was_measured() -> None:
    small = Rotation.from_rotvec(np.outer(np.arange(4.0), [0.1, -0.2, 0.05]))
    start = Rotation.from_rotvec([0.4, 0.9, -1.3])
    quaternions = (small * start).as_quat()[:, [3, 0, 1, 2]]
    lost = np.full((1, 4), np.nan)
    vectors = rotation_vectors(np.vstack([lost, quaternions[:2], lost, -quaternions[2:]]))
    assert np.isnan(vectors[[0, 3]]).all()
    assert vectors[[1, 2, 4, 5]] == pytest.approx(small.as_rotvec(), abs=1e-12)
    assert np.isnan(rotation_vectors(lost)).all()
