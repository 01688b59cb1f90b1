"""ROS bags for tests, written with the package rosbags: topics with their messages, times in s."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.LATEST)
JOINTS = ("winch_1", "winch_2", "winch_3")

# Each topic: its type, and its messages by the times of their receipt.
Topics = Mapping[str, tuple[str, Iterable[tuple[float, Any]]]]


def message(name: str, *values: Any) -> Any:
    """A message of this type, as in ``geometry_msgs/Point``."""
    package, _, kind = name.partition("/")
    return STORE.types[f"{package}/msg/{kind}"](*values)


def header(time: float) -> Any:
    """A header with this stamp in s; at zero as where nobody filled it in."""
    nanoseconds = round(time * 1e9)
    stamp = message("builtin_interfaces/Time", nanoseconds // 10**9, nanoseconds % 10**9)
    return message("std_msgs/Header", stamp, "map")


def joint_state(time: float, speeds: Sequence[float], efforts: Sequence[float] = (), names: Any = JOINTS) -> Any:
    """A JointState of winches."""
    return message(
        "sensor_msgs/JointState",
        header(time),
        list(names),
        np.empty(0),
        np.array(speeds),
        np.array(efforts, dtype=float),
    )


def pose(time: float, position: Sequence[float], quaternion: Sequence[float] = (1.0, 0.0, 0.0, 0.0)) -> Any:
    """A PoseStamped of a position, and of a quaternion w, x, y, z."""
    w, x, y, z = quaternion
    turned = message("geometry_msgs/Quaternion", x, y, z, w)
    where = message("geometry_msgs/Point", *position)
    return message("geometry_msgs/PoseStamped", header(time), message("geometry_msgs/Pose", where, turned))


def write_bag(folder: Path, topics: Topics, *, store: Any = STORE, is_sqlite: bool = False) -> Path:
    """A bag of these topics, as MCAP or SQLite."""
    plugin = StoragePlugin.SQLITE3 if is_sqlite else StoragePlugin.MCAP
    with Writer(folder, version=9, storage_plugin=plugin) as writer:
        for topic, (kind, messages) in topics.items():
            package, _, name = kind.partition("/")
            message_type = f"{package}/msg/{name}"
            connection = writer.add_connection(topic, message_type, typestore=store)
            for time, each in messages:
                writer.write(connection, round(time * 1e9), store.serialize_cdr(each, message_type))
    return folder
