"""Recordings in ROS bags: the same numbers as in CSV files, topics at their own times, damaged bags refused."""

from __future__ import annotations

import sqlite3
import sys
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tautwire.cli import run
from tautwire.errors import RecordingError
from tautwire.recordings.column_names import column_names
from tautwire.recordings.column_proposal import propose_columns
from tautwire.recordings.recording import Recording, read_recording
from tautwire.robot.schema import RecordedColumn
from tests.recordings.test_parquet_file import COLUMNS, same
from tests.support.robots import EXAMPLES

pytest.importorskip("rosbags")

from tests.support.ros_bags import JOINTS, Topics, header, joint_state, message, pose, write_bag

START = 1000.0  # s since 1970
SPEEDS = np.column_stack([COLUMNS[f"winch_speed_{cable}"] for cable in (1, 2, 3)])
TENSIONS = np.column_stack([COLUMNS[f"tension_{cable}"] for cable in (1, 2, 3)])
POSITIONS = np.column_stack([COLUMNS[axis] for axis in "xyz"])
TIMES = [START + time for time in COLUMNS["time"]]
STATES = (
    "sensor_msgs/JointState",
    [(t, joint_state(t, *each)) for t, *each in zip(TIMES, SPEEDS, TENSIONS, strict=True)],
)
POSES = ("geometry_msgs/PoseStamped", [(t, pose(t, position)) for t, position in zip(TIMES, POSITIONS, strict=True)])
TABLE = (
    RecordedColumn("winch_speed_{}", "/joint_states/velocity[winch_{}]"),
    RecordedColumn("tension_{}", "/joint_states/effort[winch_{}]"),
    *(RecordedColumn(axis, f"/pose/pose.position.{axis}") for axis in "xyz"),
)
SPEED_TABLE = TABLE[:1]


def bag(folder: Path, topics: Topics | None = None, is_sqlite: bool = False) -> Path:
    return write_bag(folder / "run", topics or {"/joint_states": STATES, "/pose": POSES}, is_sqlite=is_sqlite)


def scalars(samples: Any) -> Any:
    """A topic of Float64, by times after the start."""
    return "std_msgs/Float64", [(START + time, message("std_msgs/Float64", value)) for time, value in samples]


def states_at(times: Any) -> Any:
    return "sensor_msgs/JointState", [(START + t, joint_state(START + t, [0.1, 0.2, 0.3])) for t in times]


def read(path: Path, *columns: RecordedColumn) -> Recording:
    return read_recording(path, 3, columns or TABLE)


def refused(path: Path, *columns: RecordedColumn) -> str:
    with pytest.raises(RecordingError) as caught:
        read(path, *columns)
    assert str(caught.value).startswith(str(path))
    assert len(str(caught.value).splitlines()) == 1
    return str(caught.value)


@pytest.mark.parametrize("is_sqlite", [False, True])
def test_a_bag_says_what_a_csv_file_says(is_sqlite: bool, tmp_path: Path) -> None:
    path = bag(tmp_path, is_sqlite=is_sqlite)
    text = tmp_path / "fit.csv"
    rows = zip(*COLUMNS.values(), strict=True)
    text.write_text("\n".join([",".join(COLUMNS), *(",".join(map(repr, row)) for row in rows)]))
    expected = read_recording(text, 3)
    assert same(read(path), expected)
    (data,) = [file for file in path.iterdir() if file.suffix in (".mcap", ".db3")]
    assert same(read(data), expected)


def test_columns_are_scaled_as_the_table_says(tmp_path: Path) -> None:
    speeds = RecordedColumn("winch_speed_{}", "/joint_states/velocity[winch_{}]", factor=0.05, sign=-1.0)
    lengths = RecordedColumn("x", "/pose/pose.position.x", unit="mm")
    recording = read(bag(tmp_path), speeds, lengths)
    np.testing.assert_allclose(recording.winch_speed, -0.05 * SPEEDS, rtol=1e-15)
    np.testing.assert_allclose(recording.position[:, 0], POSITIONS[:, 0] / 1e3, rtol=1e-15)
    assert recording.columns["x"].unit == "mm" and not recording.has_time_column


def test_joints_are_found_by_name_in_any_order_and_message(tmp_path: Path) -> None:
    messages = []
    for time, speeds in zip(TIMES, SPEEDS, strict=True):
        messages.append((time, joint_state(time, speeds[[2, 0]], names=[JOINTS[2], JOINTS[0]])))
        messages.append((time + 1e-4, joint_state(time, speeds[[1]], names=[JOINTS[1]])))
    recording = read(bag(tmp_path, {"/joint_states": ("sensor_msgs/JointState", messages)}), *SPEED_TABLE)
    assert np.array_equal(recording.winch_speed, SPEEDS)


def test_times_are_of_the_header_and_else_of_receipt(tmp_path: Path) -> None:
    late = [(time + delay, each) for (time, each), delay in zip(STATES[1], (0.0, 0.003, 0.001), strict=True)]
    recording = read(write_bag(tmp_path / "late", {"/joint_states": (STATES[0], late)}), *SPEED_TABLE)
    assert recording.time.tolist() == COLUMNS["time"]
    assert "by its header.stamp" in recording.notes[-1]
    blank = [(time, joint_state(0.0, speeds)) for (time, _), speeds in zip(late, SPEEDS, strict=True)]
    recording = read(write_bag(tmp_path / "blank", {"/joint_states": (STATES[0], blank)}), *SPEED_TABLE)
    np.testing.assert_allclose(recording.time, [0.0, 0.013, 0.021], rtol=1e-12)
    assert "by its receive time" in recording.notes[-1]


def test_samples_are_put_in_order_and_repeated_ones_read_once(tmp_path: Path) -> None:
    shuffled = [STATES[1][index] for index in (1, 0, 2, 1)]
    recording = read(bag(tmp_path, {"/joint_states": (STATES[0], shuffled)}), *SPEED_TABLE)
    assert recording.time.tolist() == COLUMNS["time"]
    assert np.array_equal(recording.winch_speed, SPEEDS)
    assert "without 3 numbers at a time that another has" in recording.notes[-1]


def test_a_sample_goes_to_the_nearest_row_on_the_line_to_the_next(tmp_path: Path) -> None:
    """A slow tracker that is 4 ms late, and a fast load cell, of quantities that rise with time."""
    slow, fast = np.arange(0.004, 1.0, 0.05), np.arange(0.0, 1.0, 0.001)
    topics = {
        "/joint_states": states_at(np.arange(0.0, 0.9, 0.01)),
        "/x": scalars((t, 10.0 * t) for t in slow),
        "/tension_1": scalars((t, 500.0 * t) for t in fast),
    }
    table = (*SPEED_TABLE, RecordedColumn("x", "/x/data"), RecordedColumn("tension_1", "/tension_1/data"))
    recording = read(bag(tmp_path, topics), *table)
    assert recording.sample_count == 90
    np.testing.assert_allclose(recording.tension[:, 0], 500.0 * recording.time, atol=1e-9)
    measured = np.flatnonzero(np.isfinite(recording.position[:, 0]))
    assert measured.tolist() == list(range(0, 90, 5))
    np.testing.assert_allclose(recording.position[measured[1:], 0], 10.0 * recording.time[measured[1:]], atol=1e-9)
    assert "; x in 18 of 90 rows" in recording.notes[-1]


def test_winch_speeds_of_several_topics_are_interpolated_where_all_have_them(tmp_path: Path) -> None:
    times = np.arange(0.0, 1.0, 0.01)
    starts = {1: 0.0, 2: 0.105, 3: 0.003}
    topics = {f"/winch_{n}/speed": scalars((t, n * t) for t in times + start) for n, start in starts.items()}
    recording = read(bag(tmp_path, topics), RecordedColumn("winch_speed_{}", "/winch_{}/speed/data"))
    assert recording.time[0] == 0.0
    np.testing.assert_allclose(recording.time[-1], 0.88, rtol=1e-12)
    np.testing.assert_allclose(recording.winch_speed, (recording.time[:, None] + 0.11) * [1.0, 2.0, 3.0], rtol=1e-9)


def test_a_winch_speed_is_not_interpolated_over_a_long_gap(tmp_path: Path) -> None:
    times = np.arange(0.0, 1.0, 0.01)
    with_gap = np.concatenate((times[:30], times[50:])) + 0.002
    topics = {f"/winch_{n}/speed": scalars((t, 0.1) for t in (with_gap if n == 2 else times)) for n in (1, 2, 3)}
    column = RecordedColumn("winch_speed_{}", "/winch_{}/speed/data")
    problem = refused(bag(tmp_path, topics), column)
    assert "row 30, column winch_speed_2: is 'nan', must be a number" in problem
    assert "at most 5 in a row are interpolated" in problem
    topics["/winch_2/speed"] = scalars((t, 0.1) for t in np.delete(times, slice(40, 45)) + 0.002)
    recording = read(write_bag(tmp_path / "short", topics), column)
    np.testing.assert_allclose(recording.winch_speed, 0.1, rtol=1e-12)


def test_a_transform_is_found_by_its_frame_and_has_its_own_time(tmp_path: Path) -> None:
    def transform(time: float, frame: str, x: float) -> Any:
        moved = message("geometry_msgs/Vector3", x, 0.0, 0.0)
        turned = message("geometry_msgs/Quaternion", 0.0, 0.0, 0.0, 1.0)
        both = message("geometry_msgs/Transform", moved, turned)
        return message("geometry_msgs/TransformStamped", header(time), frame, both)

    messages = [
        (time + 0.2, message("tf2_msgs/TFMessage", [transform(time, "camera", 9.0), transform(time, "platform", x)]))
        for time, x in zip(TIMES, POSITIONS[:, 0], strict=True)
    ]
    path = bag(tmp_path, {"/joint_states": STATES, "/tf": ("tf2_msgs/TFMessage", messages)})
    column = RecordedColumn("x", "/tf/transforms[platform].transform.translation.x")
    assert np.array_equal(read(path, *SPEED_TABLE, column).position[:, 0], POSITIONS[:, 0])


def test_topics_that_are_not_read_are_named(tmp_path: Path) -> None:
    assert read(bag(tmp_path), *SPEED_TABLE).unknown_columns == ("/pose/*",)


def test_what_cannot_be_right_is_refused(tmp_path: Path) -> None:
    path = bag(tmp_path)
    with pytest.raises(RecordingError, match="no columns are declared for it; propose them with tautwire columns"):
        read_recording(path, 3)
    wrong = RecordedColumn("x", "/pose/pose.position.X")
    assert "has no column '/pose/pose.position.X'" in refused(path, *SPEED_TABLE, wrong)
    assert "write '/pose/pose.position.x'" in refused(path, *SPEED_TABLE, wrong)
    assert "the column winch_speed_2 is missing" in refused(
        path, RecordedColumn("winch_speed_1", "/joint_states/velocity[winch_1]")
    )
    other_clock = {"/joint_states": STATES, "/x": scalars([(100.0, 1.0), (100.1, 2.0)])}
    apart = refused(write_bag(tmp_path / "apart", other_clock), *SPEED_TABLE, RecordedColumn("x", "/x/data"))
    assert "'/x/data': has no sample near those of '/joint_states/velocity[winch_1]', and begins 100 s after" in apart
    winches = {f"/winch_{n}": scalars([(5.0 * n, 0.1), (5.0 * n + 1.0, 0.1)]) for n in (1, 2, 3)}
    apart = refused(write_bag(tmp_path / "winches", winches), RecordedColumn("winch_speed_{}", "/winch_{}/data"))
    assert "'/winch_3/data': has no sample near those of '/winch_1/data', and begins 10 s after" in apart


def test_damaged_bags_are_refused(tmp_path: Path) -> None:
    path = bag(tmp_path)
    content = (path / "run.mcap").read_bytes()
    for size in (0, 5, 200, len(content) // 2, len(content) - 10):
        (path / "run.mcap").write_bytes(content[:size])
        assert "cannot be read as a ROS bag (" in refused(path)
    (path / "run.mcap").unlink()
    assert "cannot be read as a ROS bag (" in refused(path)
    (path / "metadata.yaml").write_text("]{")
    assert "cannot be read as a ROS bag (" in refused(path)
    (path / "metadata.yaml").unlink()
    with pytest.raises(RecordingError, match="is a folder, not a file"):
        read(path)
    (path / "run.mcap").write_bytes(content)
    assert "without metadata.yaml; run ros2 bag reindex" in refused(path)
    database = bag(tmp_path / "other", is_sqlite=True) / "run.db3"
    database.write_bytes(database.read_bytes()[:3000])
    assert "cannot be read as a ROS bag (" in refused(database)


def test_a_bag_that_is_compressed_as_a_whole_is_refused(tmp_path: Path) -> None:
    path = bag(tmp_path)
    (path / "run.mcap").rename(path / "run.mcap.zstd")
    assert "compressed as a whole; convert the bag" in refused(path)


def test_types_that_the_bag_does_not_define_are_named(tmp_path: Path) -> None:
    path = bag(tmp_path, is_sqlite=True)
    with closing(sqlite3.connect(path / "run.db3")) as content, content:
        content.execute("UPDATE topics SET type = 'lab_msgs/msg/Winches' WHERE name = '/joint_states'")
    text = (path / "metadata.yaml").read_text()
    (path / "metadata.yaml").write_text(text.replace("sensor_msgs/msg/JointState", "lab_msgs/msg/Winches"))
    assert "'/joint_states': has the type 'lab_msgs/msg/Winches', which the bag does not define" in refused(path)


def test_a_file_is_known_by_its_first_bytes(tmp_path: Path) -> None:
    path = (bag(tmp_path) / "run.mcap").rename(tmp_path / "fit.dat")
    assert "is MCAP by its first bytes, and not by its name; rename it to end in .mcap" in refused(path)


def test_a_suffix_in_capitals_is_to_be_written_small(tmp_path: Path) -> None:
    path = (bag(tmp_path, is_sqlite=True) / "run.db3").rename(tmp_path / "log.DB3")
    assert "ends in '.DB3', which rosbags does not know; rename it to end in .db3" in refused(path)


def test_a_bag_of_ros_1_is_refused_with_the_command_that_converts_it(tmp_path: Path) -> None:
    path = tmp_path / "run.bag"
    path.write_bytes(b"#ROSBAG V2.0\nE\0\0\0")
    assert "is a bag of ROS 1; make one of ROS 2 of it: rosbags-convert --src" in refused(path)


def test_the_missing_package_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = bag(tmp_path)
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    assert "needs the package rosbags, which is not installed; run pip install rosbags" in refused(path)


def wrench(time: float, force: float) -> Any:
    zero = message("geometry_msgs/Vector3", 0.0, 0.0, 0.0)
    both = message("geometry_msgs/Wrench", message("geometry_msgs/Vector3", 0.0, 0.0, force), zero)
    return message("geometry_msgs/WrenchStamped", header(time), both)


def array_of(values: Any) -> Any:
    layout = message("std_msgs/MultiArrayLayout", [], 0)
    return message("std_msgs/Float64MultiArray", layout, np.array(values))


def point(time: float) -> Any:
    return message("geometry_msgs/PointStamped", header(time), message("geometry_msgs/Point", 1.0, 2.0, 3.0))


PROPOSALS: dict[str, tuple[Topics, dict[str, str]]] = {
    "joints and a pose": (
        {"/joint_states": STATES, "/tracker/pose": POSES},
        {f"winch_speed_{n}": f"/joint_states/velocity[winch_{n}]" for n in (1, 2, 3)}
        | {f"tension_{n}": f"/joint_states/effort[winch_{n}]" for n in (1, 2, 3)}
        | {axis: f"/tracker/pose/pose.position.{axis}" for axis in "xyz"}
        | {f"q{part}": f"/tracker/pose/pose.orientation.{part}" for part in "wxyz"},
    ),
    "wrenches along one axis": (
        {f"/load_cell_{n}": ("geometry_msgs/WrenchStamped", [(1.0, wrench(1.0, 5.0))]) for n in (1, 2, 3)},
        {f"tension_{n}": f"/load_cell_{n}/wrench.force.z" for n in (1, 2, 3)},
    ),
    "numbers and a point": (
        {f"/winch_{n}/tension": scalars([(1.0, 5.0)]) for n in (1, 2, 3)}
        | {"/target": ("geometry_msgs/PointStamped", [(1.0, point(1.0))])},
        {f"tension_{n}": f"/winch_{n}/tension/data" for n in (1, 2, 3)} | {a: f"/target/point.{a}" for a in "xyz"},
    ),
    "arrays from 0": (
        {"/robot1/rope_lengths": ("std_msgs/Float64MultiArray", [(1.0, array_of([1.0, 2.0, 3.0]))])},
        {f"rope_length_{n}": f"/robot1/rope_lengths/data[{n - 1}]" for n in (1, 2, 3)},
    ),
}


@pytest.mark.parametrize("name", PROPOSALS)
def test_columns_are_proposed_by_type_and_name(name: str, tmp_path: Path) -> None:
    topics, expected = PROPOSALS[name]
    proposal = propose_columns(column_names(bag(tmp_path, topics)), 3)
    assert {each.column: each.name for each in proposal.columns} == expected | {"time": "time"}
    if name == "joints and a pose":
        doubts = {each.column: each.doubt for each in proposal.columns}
        assert "the drum's radius for rad/s" in doubts["winch_speed_1"]
        assert "1 / the drum's radius where it is a torque" in doubts["tension_1"]


def test_check_takes_the_folder_with_a_proposed_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rows = np.genfromtxt(EXAMPLES / "three" / "fit.csv", delimiter=",", names=True, max_rows=60)
    speeds, tensions = (
        np.column_stack([rows[f"{kind}_{n}"] for n in (1, 2, 3)]) for kind in ("winch_speed", "tension")
    )
    times = START + rows["time"]
    samples = [(t, joint_state(t, *each)) for t, *each in zip(times, speeds, tensions, strict=True)]
    path = bag(tmp_path, {"/joint_states": ("sensor_msgs/JointState", samples)})
    robot, table, page = (EXAMPLES / "three" / "robot.toml", tmp_path / "columns.toml", tmp_path / "check.html")
    assert run(["columns", str(path), str(robot), "--out", str(table)]) == 0
    assert run(["check", str(robot), str(path), "--columns", str(table), "--report", str(page)]) == 0
    assert f"{path}: no problems found" in capsys.readouterr().out
    assert f"{path}/run.mcap" in page.read_text(encoding="utf-8")


def test_a_quaternion_between_rows_is_interpolated_as_one_rotation_whatever_its_signs(tmp_path: Path) -> None:
    times = np.arange(20) / 20.0
    angles = np.linspace(0.0, 6.0, 20)
    signs = np.where(np.arange(20) % 2, -1.0, 1.0)
    late = 0.02
    turned = [
        (
            START + t + late,
            pose(START + t + late, [0.0, 0.0, 1.0], sign * np.array([np.cos(a / 2), 0.0, 0.0, np.sin(a / 2)])),
        )
        for t, a, sign in zip(times, angles, signs, strict=True)
    ]
    path = bag(tmp_path, {"/joint_states": states_at(times), "/pose": ("geometry_msgs/PoseStamped", turned)})
    names = [RecordedColumn(f"q{part}", f"/pose/pose.orientation.{part}") for part in "wxyz"]
    recording = read(path, *SPEED_TABLE, *names)
    w, x, y, z = recording.orientation[1:].T
    assert np.abs(x).max() == np.abs(y).max() == 0.0
    expected = np.interp(times[1:], times + late, angles)
    assert np.abs(np.unwrap(2.0 * np.arctan2(z, w)) - expected).max() < 1e-3
