"""The columns of a recording: which there are and which are missing."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..errors import RecordingError, at_once, shown
from ..robots.checked_table import likely

AXES = ("x", "y", "z")

# Beyond these a file is none of a cable robot, or does not fit into memory.
MOST_COLUMNS = 10_000
MOST_SAMPLES = 20_000_000

Refuse = Callable[[RecordingError], None]

_OF_A_CABLE = re.compile(r"(?:winch_speed|tension)_(0|[1-9][0-9]{0,5})")


@dataclass(frozen=True)
class Header:
    """Columns of a recording: ``names`` are all in the file's order, each once; ``unknown`` are not read."""

    names: tuple[str, ...]
    unknown: tuple[str, ...]

    @property
    def known(self) -> tuple[str, ...]:
        """The columns that are read, in the file's order."""
        return tuple(name for name in self.names if name not in self.unknown)


def header_of(
    cells: Sequence[str], where: str, cable_count: int, sink: Refuse = at_once, line: int | None = None
) -> Header:
    """The header in these cells; raises RecordingError unless time and every winch speed have a column.

    With a ``sink`` each error goes there, and those that follow too where it does not raise.
    """
    if len(cells) > MOST_COLUMNS:
        problem = f"has {len(cells)} columns, at most {MOST_COLUMNS} are read"
        raise RecordingError(where, problem, "keep those of the robot", line)
    known = known_columns(cable_count)
    names = tuple(cell or f"(column {place})" for place, cell in enumerate(cells, 1))
    for place, name in enumerate(names):
        if name in names[:place]:
            sink(RecordingError(where, f"the column {shown(name)} is there twice", "keep one of the two", line))
        of_a_cable = _OF_A_CABLE.fullmatch(name)
        if of_a_cable and not 1 <= int(of_a_cable.group(1)) <= cable_count:
            problem = f"the column {name} is of no cable, the robot has cables 1 to {cable_count}"
            sink(RecordingError(where, problem, "give the robot file that belongs to this recording", line))
    unknown = tuple(name for name in names if name not in known)
    for needed in ("time", *(f"winch_speed_{cable}" for cable in range(1, cable_count + 1))):
        if needed not in names:
            near = likely(needed, unknown)
            mend = "add it" if near is None else f"add it, or rename {shown(near)}"
            sink(RecordingError(where, f"the column {needed} is missing", mend, line))
    return Header(names, unknown)


def require_samples(count: int, where: str) -> None:
    """Raises RecordingError where a file has, or claims to have, more samples than are read."""
    if count > MOST_SAMPLES:
        problem = f"has {count} samples, at most {MOST_SAMPLES} are read"
        raise RecordingError(where, problem, "cut it into several recordings")


def known_columns(cable_count: int) -> frozenset[str]:
    """Names of all columns that a recording may have."""
    cables = range(1, cable_count + 1)
    of_cables = (f"{kind}_{cable}" for kind in ("winch_speed", "tension") for cable in cables)
    return frozenset(("time", *AXES, *of_cables))
