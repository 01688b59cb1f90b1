"""The header of a recording: its columns, and which are missing."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..errors import RecordingError, format_value, raise_error
from ..robots.checked_table import closest_name

AXES = ("x", "y", "z")

# A larger file is no recording of a cable robot, or does not fit into memory.
MAX_COLUMNS = 10_000
MAX_SAMPLES = 20_000_000

ErrorSink = Callable[[RecordingError], None]

_CABLE_COLUMN = re.compile(r"(?:winch_speed|tension)_(0|[1-9][0-9]{0,5})")


@dataclass(frozen=True)
class Header:
    """Columns of a recording: ``names`` are all in the file's order, each once; ``unknown_names`` are not read."""

    names: tuple[str, ...]
    unknown_names: tuple[str, ...]

    @property
    def known_names(self) -> tuple[str, ...]:
        """The columns that are read, in the file's order."""
        return tuple(name for name in self.names if name not in self.unknown_names)


def parse_header(
    cells: Sequence[str], where: str, cable_count: int, sink: ErrorSink = raise_error, line: int | None = None
) -> Header:
    """Parse the header in these cells; raises RecordingError unless time and every winch speed have a column.

    Errors go to the ``sink``; where it does not raise, so do those that follow.
    """
    if len(cells) > MAX_COLUMNS:
        problem = f"has {len(cells)} columns, at most {MAX_COLUMNS} are read"
        raise RecordingError(where, problem, "keep those of the robot", line)
    allowed_names = known_columns(cable_count)
    names = tuple(cell or f"(column {index})" for index, cell in enumerate(cells, 1))
    for place, name in enumerate(names):
        if name in names[:place]:
            sink(RecordingError(where, f"the column {format_value(name)} is there twice", "keep one of the two", line))
        cable_match = _CABLE_COLUMN.fullmatch(name)
        if cable_match and not 1 <= int(cable_match.group(1)) <= cable_count:
            problem = f"the column {name} is of no cable, the robot has cables 1 to {cable_count}"
            sink(RecordingError(where, problem, "give the robot file that belongs to this recording", line))
    unknown_names = tuple(name for name in names if name not in allowed_names)
    for required in ("time", *(f"winch_speed_{cable}" for cable in range(1, cable_count + 1))):
        if required not in names:
            similar = closest_name(required, unknown_names)
            hint = "add it" if similar is None else f"add it, or rename {format_value(similar)}"
            sink(RecordingError(where, f"the column {required} is missing", hint, line))
    return Header(names, unknown_names)


def require_samples(count: int, where: str) -> None:
    """Raises RecordingError where a file has, or claims to have, more samples than are read."""
    if count > MAX_SAMPLES:
        problem = f"has {count} samples, at most {MAX_SAMPLES} are read"
        raise RecordingError(where, problem, "cut it into several recordings")


def known_columns(cable_count: int) -> frozenset[str]:
    """Names of all columns that a recording may have."""
    cables = range(1, cable_count + 1)
    cable_columns = (f"{kind}_{cable}" for kind in ("winch_speed", "tension") for cable in cables)
    return frozenset(("time", *AXES, *cable_columns))
