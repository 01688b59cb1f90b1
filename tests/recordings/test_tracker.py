from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from tautwire.errors import RecordingError, RobotFileError
from tautwire.recordings.recording import Recording, read_recording
from tautwire.recordings.tracker import samples_at_rows, with_tracker
from tautwire.robot.robot_file_reader import read_columns_file, read_tracker_file, robot_from_text
from tautwire.robot.robot_file_text import robot_text
from tautwire.robot.schema import RecordedColumn, Tracker
from tests.support.pose_recordings import rope_lengths, rotation_of, wandering_poses
from tests.support.rigid_robots import crane_robot
from tests.support.robots import EXAMPLES, example
from tests.support.trackers import split

Array = NDArray[np.float64]

ROBOT = example("three")
ROWS = np.arange(0.0, 10.0, 0.01)
TABLE = """
[recording.tracker]
clock_offset = 3.412
clock_rate = 1.00002

[recording.tracker.columns]
time = { name = "T", unit = "ms" }
x = { name = "RB X", unit = "mm" }
y = { name = "RB Y", unit = "mm" }
z = { name = "RB Z", unit = "mm" }
"""
COLUMNS = (
    RecordedColumn("time", "T", "ms"),
    *(RecordedColumn(axis, f"RB {axis.upper()}", "mm") for axis in "xyz"),
)


def swinging(time: Array) -> Array:
    return np.column_stack([0.5 * np.sin(6.0 * time), np.cos(2.0 * time), time])


def written(tracker: Recording, folder: Path) -> Path:
    """A tracker's file in ms and mm, with semicolons."""
    positions = {f"RB {axis.upper()}": 1e3 * tracker.position[:, i] for i, axis in enumerate("xyz")}
    frame = pd.DataFrame({"T": 1e3 * tracker.time, **positions})
    path = folder / "tracker.csv"
    frame.to_csv(path, index=False, sep=";")
    return path


def split_files(folder: Path, offset: float = 3.412, rate: float = 1.0) -> tuple[Recording, Recording, Path]:
    """A shipped recording, its log without positions, and its tracker's file."""
    recording = read_recording(EXAMPLES / "three" / "fit.csv", 3)
    log, tracker = split(recording, 120.0, offset, rate)
    return recording, log, written(tracker, folder)


@pytest.mark.validate(but=["3.412"])
@pytest.mark.parametrize(("offset", "rate"), [(3.412, 1.0), (250.0, 1.0003)])
def test_log_and_tracker_become_the_recording_that_was_split(offset: float, rate: float, tmp_path: Path) -> None:
    recording, log, path = split_files(tmp_path, offset, rate)
    joined = with_tracker(replace(ROBOT, tracker=Tracker(COLUMNS)), log, path)
    inside = slice(10, -10)
    errors = joined.position[inside] - recording.position[inside]
    # The noise of one sample is 0.3 mm, of which the splines through noisy samples keep the most.
    assert np.sqrt(np.mean(errors**2)) < 3e-4
    assert np.array_equal(joined.tension, recording.tension)
    assert f"from {path}, whose clock shows {offset:.2f}" in joined.notes[-1]
    assert ("times as fast" in joined.notes[-1]) == (rate != 1.0)


def test_a_stated_clock_is_taken(tmp_path: Path) -> None:
    recording, log, path = split_files(tmp_path)
    joined = with_tracker(replace(ROBOT, tracker=Tracker(COLUMNS, clock_offset=3.512)), log, path)
    # That is a tenth of a second, or ten rows, later than the tracker's clock was.
    errors = joined.position[10:-20] - recording.position[20:-10]
    assert np.sqrt(np.mean(errors**2)) < 3e-4
    assert "shows 3.5120 s at the first sample here, as stated in [recording.tracker]" in joined.notes[-1]
    with pytest.raises(RecordingError, match="has no samples during"):
        with_tracker(replace(ROBOT, tracker=Tracker(COLUMNS, clock_offset=900.0)), log, path)


def test_a_log_with_positions_is_refused(tmp_path: Path) -> None:
    recording, _, path = split_files(tmp_path)
    with pytest.raises(RecordingError, match="has positions of its own beside those of"):
        with_tracker(replace(ROBOT, tracker=Tracker(COLUMNS)), recording, path)


@pytest.mark.validate
def test_a_log_of_counts_is_refused_before_its_tracker_is(tmp_path: Path) -> None:
    _, log, path = split_files(tmp_path)
    counts = replace(log, winch_speed=1e4 * log.winch_speed, rope_length=-1e4 * log.wound_lengths())
    with pytest.raises(RecordingError, match=r"moves .* m of rope, and the robot is no larger than") as error:
        with_tracker(replace(ROBOT, tracker=Tracker(COLUMNS)), counts, path)
    assert "for counts add factor = 2 pi * drum radius / counts per turn" in error.value.hint


def test_a_file_without_positions_is_refused(tmp_path: Path) -> None:
    _, log, _ = split_files(tmp_path)
    path = tmp_path / "other.csv"
    path.write_text("time,tension_1\n0,1\n1,2\n", encoding="utf-8")
    with pytest.raises(RecordingError, match=r"has no positions; name the columns x, y, z in \[recording.tracker.col"):
        with_tracker(ROBOT, log, path)


@pytest.mark.parametrize("samples_per_second", [120.0, 100.0, 237.0])
def test_samples_are_moved_to_their_rows_without_error(samples_per_second: float) -> None:
    times = np.arange(-0.1, 10.1, 1.0 / samples_per_second) + 0.0021
    placed = samples_at_rows(ROWS, times, swinging(times))
    assert np.abs(placed - swinging(ROWS)).max() < 1e-5


def test_noise_stays_that_of_single_samples_and_white() -> None:
    times = np.arange(-0.1, 200.1, 1.0 / 120.0)
    rows = np.arange(0.0, 200.0, 0.01)
    noise = np.random.default_rng(2).normal(size=(len(times), 3))
    placed = samples_at_rows(rows, times, noise)
    # Linear interpolation leaves two thirds of the variance on average.
    assert np.mean(placed**2) == pytest.approx(1.0, abs=0.03)
    assert abs(np.mean(placed[1:] * placed[:-1])) < 0.03


def test_rows_without_a_sample_are_empty() -> None:
    times = np.arange(0.0, 10.0, 1.0 / 30.0)
    placed = samples_at_rows(ROWS, times, swinging(times))
    filled = np.isfinite(placed[:, 0])
    assert np.count_nonzero(filled) == len(times)
    assert np.abs(placed[filled] - swinging(ROWS[filled])).max() < 5e-4


def test_gaps_stay_empty_and_are_not_bridged() -> None:
    times = np.arange(0.0, 10.0, 1.0 / 120.0)
    positions = swinging(times)
    positions[(times > 3.0) & (times < 4.0), 1] = np.nan
    positions[(times > 6.0) & (times < 8.0) & (np.abs(times - 7.0) > 0.02)] = np.nan
    filled = np.isfinite(samples_at_rows(ROWS, times, positions)).all(axis=1)
    assert not filled[(ROWS > 3.01) & (ROWS < 3.99)].any()
    # Four samples between two gaps are too few to be moved.
    assert not filled[(ROWS > 6.01) & (ROWS < 7.99)].any()
    assert np.count_nonzero(~filled) < 310


def test_the_table_is_read_and_written(tmp_path: Path) -> None:
    path = tmp_path / "robot.toml"
    path.write_text((EXAMPLES / "three" / "robot.toml").read_text(encoding="utf-8") + TABLE, encoding="utf-8")
    tracker = read_tracker_file(path)
    assert tracker == Tracker(COLUMNS, 3.412, 1.00002)
    assert read_columns_file(path, 3) == ()
    robot = robot_from_text(path.read_text(encoding="utf-8"), path, "three")
    assert robot.tracker == tracker
    assert robot_from_text(robot_text(robot), path, "three").tracker == tracker


@pytest.mark.parametrize(
    ("line", "problem"),
    [
        ("[recording.tracker]\nclock_rate = 1.1\n", "recording.tracker.clock_rate: is stated without clock_offset"),
        ("[recording.tracker]\nclock_offset = 1\nclock_rate = 2\n", "clock_rate: is 2.0, must be"),
        ("[recording.tracker]\nclock = 1\n", "recording.tracker.clock: is not a known key"),
        ('[recording.tracker.columns]\nwinch_speed_1 = "v"\n', "winch_speed_1: is not a column of a tracker"),
        ('[recording.tracker.columns]\n"tension_{}" = "v{}"\n', "is not a column of a recording"),
        ("[recording.tracker.columns]\nx = { unit = 3 }\n", "recording.tracker.columns.x.unit"),
    ],
)
def test_a_table_that_is_not_valid_is_refused(line: str, problem: str, tmp_path: Path) -> None:
    path = tmp_path / "columns.toml"
    path.write_text(line, encoding="utf-8")
    with pytest.raises(RobotFileError) as caught:
        read_tracker_file(path)
    assert problem in str(caught.value)


CRANE = crane_robot()


def crane_log(duration: float = 20.0) -> Recording:
    """The log of a rigid platform's winches, from rest to rest, without poses."""
    time = np.arange(round(100.0 * duration) + 1) / 100.0
    lengths = rope_lengths(CRANE, *shaken(time, duration))
    nothing = np.full(lengths.shape, np.nan)
    return Recording("log.csv", time, -CubicSpline(time, lengths)(time, 1), nothing, nothing[:, :3])


def shaken(time: Array, duration: float) -> tuple[Array, Rotation]:
    """Poses from rest to rest."""
    window = np.sin(np.pi * np.clip(time / duration, 0.0, 1.0)) ** 2
    positions, rotations = wandering_poses(CRANE, time, 0.4, 0.25)
    start = np.array(CRANE.platform.start)
    turned = Rotation.from_rotvec(window[:, None] * rotations.as_rotvec())
    return start + window[:, None] * (positions - start), turned


@pytest.mark.parametrize("is_clock_stated", [True, False])
def test_poses_of_a_tracker_with_its_own_clock_are_put_onto_the_rows(is_clock_stated: bool, tmp_path: Path) -> None:
    log, times = crane_log(), np.arange(0.0037, 19.99, 1.0 / 120.0)
    positions, rotations = shaken(times, 20.0)
    signs = np.where(np.arange(len(times)) % 2, 1.0, -1.0)[:, None]
    quaternions = signs * rotations.as_quat()[:, [3, 0, 1, 2]]
    lost = slice(700, 712)
    quaternions[lost] = np.nan
    columns = np.column_stack([times + 3.412, positions, quaternions])
    frame = pd.DataFrame(columns, columns=["time", "x", "y", "z", "qw", "qx", "qy", "qz"])
    frame.to_csv(tmp_path / "tracker.csv", index=False)
    robot = replace(CRANE, tracker=Tracker(clock_offset=3.412)) if is_clock_stated else CRANE
    recording = with_tracker(robot, log, tmp_path / "tracker.csv")
    rows = np.isfinite(recording.orientation).all(axis=1)
    assert 1950 < np.sum(rows) < np.isfinite(recording.position).all(axis=1).sum() < 2001
    errors = rotation_of(recording.orientation[rows]) * shaken(log.time[rows], 20.0)[1].inv()
    assert errors.magnitude().max() < (1e-5 if is_clock_stated else 3e-4)
    assert np.abs(np.linalg.norm(recording.orientation[rows], axis=1) - 1.0).max() < 1e-12
