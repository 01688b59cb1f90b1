"""Numbers in ROS messages, each by the path of its field, and the times at which they were measured."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Sequence
from typing import Any

import numpy as np

# Longer ones are images, scans and point clouds.
MAX_ARRAY_LENGTH = 1000

_NAME_FIELDS = ("name", "joint_names")
_UNREAD_FIELDS = ("header", "__msgtype__")
_NANOSECONDS = 10**9

# Path of a field, its time in ns since 1970 or None without a stamp, and its number.
Sample = tuple[str, int | None, float]


def numbers_in_message(message: Any, wanted: Container[str] | None = None) -> Iterator[Sample]:
    """Numbers of a message by their paths, as in ``pose.position.x`` or ``velocity[winch_1]``, with their times.

    An entry of an array is named by the list of names beside it (``name``, ``joint_names``) where that is as long, a
    transform by its ``child_frame_id``, any other by its index from 0. The time is that of the innermost header, in ns;
    None where there is none, or it was not filled in. Of ``wanted``, which has all prefixes too, no others are read.
    """
    yield from _numbers_in(message, "", None, (), wanted)


def path_prefixes(path: str) -> Iterator[str]:
    """A path of a field, and what each of its fields and entries is inside of."""
    yield path
    yield from (path[:index] for index, character in enumerate(path) if character in ".[")


def _numbers_in(
    message: Any, path: str, stamp: int | None, names: Sequence[str], wanted: Container[str] | None
) -> Iterator[Sample]:
    stamp = _stamp(message) or stamp
    names = next(filter(None, (_distinct_names(getattr(message, field, None)) for field in _NAME_FIELDS)), names)
    for field in message.__dataclass_fields__:
        if field in _UNREAD_FIELDS:
            continue
        field_path = f"{path}.{field}" if path else field
        if wanted is not None and field_path not in wanted:
            continue
        value = getattr(message, field)
        if not isinstance(value, list | np.ndarray):
            yield from _numbers_in_value(value, field_path, stamp, names, wanted)
        elif len(value) <= MAX_ARRAY_LENGTH:
            entries = value.tolist() if isinstance(value, np.ndarray) else value
            for label, entry in zip(_labels(value, names), entries, strict=True):
                entry_path = f"{field_path}[{label}]"
                if wanted is None or entry_path in wanted:
                    yield from _numbers_in_value(entry, entry_path, stamp, names, wanted)


def _numbers_in_value(
    value: Any, path: str, stamp: int | None, names: Sequence[str], wanted: Container[str] | None
) -> Iterable[Sample]:
    if isinstance(value, float | int):
        return ((path, stamp, float(value)),)
    return _numbers_in(value, path, stamp, names, wanted) if hasattr(value, "__dataclass_fields__") else ()


def _labels(entries: Any, names: Sequence[str]) -> Sequence[object]:
    """The names of an array's entries; their indices where they have none, or not each its own."""
    if len(entries) == len(names):
        return names
    return _distinct_names([getattr(entry, "child_frame_id", None) for entry in entries]) or range(len(entries))


def _distinct_names(value: object) -> Sequence[str]:
    """A list of names that differ; none where a field is anything else."""
    names = [each for each in value if isinstance(each, str) and each] if isinstance(value, list) else []
    return names if isinstance(value, list) and len(set(names)) == len(value) else ()


def _stamp(message: Any) -> int | None:
    """Time of a message's header in ns; None where it has none, or the sender left it at zero."""
    stamp: Any = getattr(getattr(message, "header", None), "stamp", None)
    if not hasattr(stamp, "nanosec"):
        return None
    return (int(stamp.sec) * _NANOSECONDS + int(stamp.nanosec)) or None
