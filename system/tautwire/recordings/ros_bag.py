"""Recordings in ROS bags: folders of rosbag2, MCAP and SQLite files, whose messages have a column for each number."""

from __future__ import annotations

import os
from array import array
from collections import defaultdict
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import RecordingError, format_value, raise_error
from ..input_files import read_bytes, readable_file
from ..robot.recorded_columns import recorded_name
from .column_map import ColumnMap
from .recording_table import MAX_COLUMNS, ColumnTable, ErrorSink, parse_header, require_samples
from .ros_message import numbers_in_message, path_prefixes
from .ros_rows import SampledNumber, align_on_winch_rows

METADATA_FILE = "metadata.yaml"
BAG_SUFFIXES = (".mcap", ".db3")
MAX_METADATA_SIZE = 2_000_000  # bytes, which take 11 s
# Three numbers of eight bytes for each sample, 3 GiB.
MAX_NUMBERS = 2**27

_MCAP_MAGIC = b"\x89MCAP0\r\n"
_ROS_1_MAGIC = b"#ROSBAG V"
_COMPRESSED_SUFFIX = ".zstd"
_DATA_SUFFIXES = (*BAG_SUFFIXES, _COMPRESSED_SUFFIX)
# Several nodes may publish parts of one topic, such as /tf, in turn.
_LISTED_MESSAGES = 50
_REPAIR_HINT = "repair it with ros2 bag reindex or mcap recover, or export it as CSV or Parquet"


@dataclass(frozen=True)
class BagColumn:
    """A column of a bag: the number at a ``path`` in the messages of a ``topic``, which have the type ``message_type``.

    ``is_zero`` says whether the first messages had nothing but zeros there.
    """

    topic: str
    message_type: str
    path: str
    is_zero: bool = False

    @property
    def name(self) -> str:
        """The name, as in ``/joint_states/velocity[winch_1]``."""
        return f"{self.topic}/{self.path}"


@dataclass(frozen=True)
class _Samples:
    """What is read of one column, message by message; both times are in ns, of the header and of receipt."""

    stamps: array[int] = field(default_factory=lambda: array("q"))
    receipts: array[int] = field(default_factory=lambda: array("q"))
    values: array[float] = field(default_factory=lambda: array("d"))

    def add(self, stamp: int | None, receipt: int, number: float) -> None:
        """Add a sample."""
        if stamp is not None:
            self.stamps.append(stamp)
        self.receipts.append(receipt)
        self.values.append(number)

    def sampled(self, name: str) -> SampledNumber:
        """The samples by the times of their headers, or by those of receipt where a message has none."""
        is_stamped = len(self.stamps) == len(self.values)
        times = np.array(self.stamps if is_stamped else self.receipts, dtype=np.int64)
        clock = "header.stamp" if is_stamped else "receive time"
        return SampledNumber(name, clock, times, np.array(self.values, dtype=np.float64))


def is_bag(path: str | Path) -> bool:
    """Whether this is a folder with the files of a bag, or one of these files by its name or its first bytes.

    Raises RecordingError where it cannot be read.
    """
    if os.path.isdir(path):
        return any(file.name == METADATA_FILE or file.suffix in _DATA_SUFFIXES for file in _files_in(Path(path)))
    with readable_file(path, RecordingError) as file, file.open("rb") as content:
        return file.suffix.lower() in BAG_SUFFIXES or content.read(16).startswith((_MCAP_MAGIC, _ROS_1_MAGIC))


def open_bag(path: str | Path, columns: ColumnMap, sink: ErrorSink = raise_error) -> ColumnTable:
    """Open the bag of a recording, as a table with a row for each winch speed; needs the package rosbags.

    Raises RecordingError where it is no bag, a column is missing, or its samples are near none of the winch speeds'.
    Errors in the names of columns go to the ``sink``.
    """
    file, wanted = str(path), columns.without_time()
    if not wanted.declared:
        hint = "propose them with tautwire columns, then give the table with --columns"
        raise RecordingError(file, "is a ROS bag, and no columns are declared for it", hint)
    recorded_names = {recorded_name(name, column) for name, column in wanted.scales.items()}
    with _open_reader(Path(path)) as reader:
        samples = _read_samples(reader, recorded_names, file)
        others = [
            f"{topic}/*" for topic in _topics(reader) if not any(name.startswith(f"{topic}/") for name in samples)
        ]
        if len(samples) < len(recorded_names):
            others = [column.name for column in _list_columns(reader, file) if column.name not in samples]
    standard_names = wanted.renamed(["time", *samples, *others], file)
    header = parse_header(standard_names, file, columns.cable_count, sink)
    scaled = replace(header, units=wanted.declared_units(), scales=wanted.scales)
    stored = dict(zip(standard_names[1:], samples, strict=False))
    rows = align_on_winch_rows({name: samples[own].sampled(own) for name, own in stored.items()}, file)
    numbers = {name: scaled.to_si(name, column) for name, column in rows.columns.items()}
    header = replace(header, dialect=rows.summary, has_time_column=False)
    return ColumnTable(file, header.with_recorded_columns(scaled), numbers)


def bag_columns(path: str | Path) -> list[BagColumn]:
    """Columns of a bag by the first messages of each topic; raises RecordingError as open_bag does."""
    with _open_reader(Path(path)) as reader:
        return _list_columns(reader, str(path))


@contextmanager
def _open_reader(path: Path) -> Iterator[Any]:
    """Context manager for rosbags' reader of a bag; raises RecordingError for what it raises on a damaged one."""
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as problem:
        message = "reading ROS bags needs the package rosbags, which is not installed"
        hint = "run pip install rosbags, or give the recording as CSV or Parquet"
        raise RecordingError(str(path), message, hint) from problem
    _require_plain_files(path)
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.LATEST)) as reader:
            yield reader
    except RecordingError:
        raise
    # rosbags may raise anything on a damaged bag.
    except Exception as problem:
        reason = format_value(str(problem) or type(problem).__name__, 200)
        raise RecordingError(str(path), f"cannot be read as a ROS bag ({reason})", _REPAIR_HINT) from problem


def _files_in(folder: Path) -> list[Path]:
    try:
        return sorted(folder.iterdir())
    except OSError as problem:
        hint = "check the path and its permissions"
        raise RecordingError(str(folder), f"cannot be read ({problem.strerror})", hint) from problem


def _require_plain_files(path: Path) -> None:
    """Raises RecordingError where a bag lacks its metadata, or has files that rosbags would not read safely."""
    if not path.is_dir():
        with readable_file(path, RecordingError), path.open("rb") as content:
            if content.read(len(_ROS_1_MAGIC)) == _ROS_1_MAGIC:
                hint = "make one of ROS 2 of it: rosbags-convert --src FILE.bag --dst FOLDER --dst-typestore latest"
                raise RecordingError(str(path), "is a bag of ROS 1", hint)
        if path.suffix not in BAG_SUFFIXES:
            suffix, problem = BAG_SUFFIXES[0], "is MCAP by its first bytes, and not by its name"
            if path.suffix.lower() in BAG_SUFFIXES:
                suffix, problem = path.suffix.lower(), f"ends in {path.suffix!r}, which rosbags does not know"
            raise RecordingError(str(path), problem, f"rename it to end in {suffix}")
        return
    if not (path / METADATA_FILE).exists():
        hint = "run ros2 bag reindex on it, or name a data file inside it"
        raise RecordingError(str(path), f"is a folder of a ROS bag without {METADATA_FILE}", hint)
    read_bytes(path / METADATA_FILE, RecordingError, MAX_METADATA_SIZE)
    for file in _files_in(path):
        if file.suffix == _COMPRESSED_SUFFIX:
            hint = "convert the bag with ros2 bag convert, without compression or with compression_mode: message"
            raise RecordingError(str(file), "is a data file that is compressed as a whole", hint)
        if file.suffix in BAG_SUFFIXES:
            with readable_file(file, RecordingError):
                pass


def _topics(reader: Any) -> list[str]:
    return sorted({connection.topic for connection in reader.connections})


def _read_samples(reader: Any, names: Collection[str], file: str) -> dict[str, _Samples]:
    """Samples of the columns with these names, in the order of the first."""
    wanted: dict[str, set[str]] = {}
    for connection in reader.connections:
        topic = connection.topic
        paths = [name.removeprefix(f"{topic}/") for name in names if name.startswith(f"{topic}/")]
        if paths and connection.msgtype not in reader.typestore.fielddefs:
            hint = "record it as MCAP, which stores the definitions, or export the recording as CSV"
            problem = f"has the type {format_value(connection.msgtype)}, which the bag does not define"
            raise RecordingError(f"{file}: {format_value(topic)}", problem, hint)
        if paths:
            require_samples(connection.msgcount, f"{file}: {format_value(topic)}")
            wanted[topic] = {prefix for path in paths for prefix in path_prefixes(path)}
    samples: defaultdict[str, _Samples] = defaultdict(_Samples)
    count = 0
    connections = [connection for connection in reader.connections if connection.topic in wanted]
    # Without any, rosbags would read all.
    for connection, receipt, content in reader.messages(connections) if connections else ():
        message = reader.deserialize(content, connection.msgtype)
        for path, stamp, number in numbers_in_message(message, wanted[connection.topic]):
            samples[f"{connection.topic}/{path}"].add(stamp, receipt, number)
            count += 1
        if count > MAX_NUMBERS:
            raise RecordingError(file, f"has more than {MAX_NUMBERS} numbers to read", "cut it into several recordings")
    return {name: each for name, each in samples.items() if name in names}


def _list_columns(reader: Any, file: str) -> list[BagColumn]:
    """Columns of the first messages of each topic whose type the bag defines."""
    zeros: dict[tuple[str, str, str], bool] = {}
    for connection in reader.connections:
        if connection.msgtype not in reader.typestore.fielddefs:
            continue
        for _, _, content in islice(reader.messages([connection]), _LISTED_MESSAGES):
            message = reader.deserialize(content, connection.msgtype)
            for path, _, number in numbers_in_message(message):
                column = (connection.topic, connection.msgtype, path)
                zeros[column] = zeros.get(column, True) and number == 0.0
                if len(zeros) > MAX_COLUMNS:
                    raise RecordingError(file, f"has more than {MAX_COLUMNS} columns", "keep the robot's topics")
    return [BagColumn(*column, is_zero) for column, is_zero in zeros.items()]
