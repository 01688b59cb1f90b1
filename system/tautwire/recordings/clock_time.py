"""Clock times of a recording: ISO 8601 or hh:mm:ss, in seconds from the first sample."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from datetime import date

_FRACTION = r"(?:[.,]([0-9]{1,9}))?"
_CLOCK = rf"([0-9]{{1,3}}):([0-5][0-9]):([0-5][0-9]){_FRACTION}"
_TIME_OF_DAY = re.compile(_CLOCK)
_ISO_8601 = re.compile(rf"([0-9]{{4}})-([0-9]{{2}})-([0-9]{{2}})[T ]{_CLOCK}\s?(Z|[+-][0-9]{{2}}:?[0-5][0-9])?")

_DAY = 86_400 * 10**9  # ns


@dataclass(frozen=True)
class ClockFormat:
    """How a column of clock times is written: ``style`` in words, and ``origin`` in ns, the first sample's."""

    style: str
    origin: int = 0

    def seconds(self, cell: str) -> float:
        """Seconds from the first sample; NaN where the cell is written in another style."""
        nanoseconds = _nanoseconds(cell, self.style)
        if nanoseconds is None:
            return math.nan
        elapsed = nanoseconds - self.origin
        # A time of day that is half a day before the first sample's is that of the next day.
        if self.style == TIME_OF_DAY and elapsed < -_DAY // 2 and self.origin < _DAY:
            elapsed += _DAY
        return elapsed / 1e9


TIME_OF_DAY = "hh:mm:ss"
ISO_8601 = "ISO 8601"
ISO_8601_WITH_OFFSET = "ISO 8601 with an offset from UTC"


def clock_format(first_cell: str) -> ClockFormat | None:
    """The format of a column of clock times that begins with this cell; None where that is no clock time."""
    for style in (TIME_OF_DAY, ISO_8601, ISO_8601_WITH_OFFSET):
        origin = _nanoseconds(first_cell, style)
        if origin is not None:
            return ClockFormat(style, origin)
    return None


def _nanoseconds(cell: str, style: str) -> int | None:
    """Clock time in ns, of its day or since year 1; whole numbers lose nothing of a long date."""
    if style == TIME_OF_DAY:
        match = _TIME_OF_DAY.fullmatch(cell.strip())
        return None if match is None else _clock_nanoseconds(match.groups())
    match = _ISO_8601.fullmatch(cell.strip())
    if match is None or (match.group(8) is not None) != (style == ISO_8601_WITH_OFFSET) or int(match.group(4)) > 23:
        return None
    try:
        day = date(int(match.group(1)), int(match.group(2)), int(match.group(3))).toordinal()
    except ValueError:
        return None
    return day * _DAY + _clock_nanoseconds(match.groups()[3:7]) - _offset_nanoseconds(match.group(8))


def _clock_nanoseconds(parts: tuple[str | None, ...]) -> int:
    hours, minutes, seconds = (int(part or 0) for part in parts[:3])
    return (hours * 3600 + minutes * 60 + seconds) * 10**9 + int((parts[3] or "").ljust(9, "0"))


def _offset_nanoseconds(offset: str | None) -> int:
    if offset is None or offset == "Z":
        return 0
    minutes = int(offset[1:3]) * 60 + int(offset[-2:])
    return (-minutes if offset[0] == "-" else minutes) * 60 * 10**9
