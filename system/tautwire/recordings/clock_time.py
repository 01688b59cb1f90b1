"""Clock times of a recording, with a date or without, in seconds from the first sample."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from datetime import date

# Milliseconds may stand behind a colon.
_FRACTION = r"(?:(?:[.,]|:(?=[0-9]{3}(?![0-9])))([0-9]{1,9}))?"
_CLOCK = rf"([0-9]{{1,3}}):([0-5][0-9]):([0-5][0-9]){_FRACTION}"
_ISO_DATE = r"([0-9]{4})[-/.]([0-9]{2})[-/.]([0-9]{2})[T ]"
_GERMAN_DATE = r"([0-9]{1,2})\.([0-9]{1,2})\.([0-9]{4}|[0-9]{2})[ T]"
_DATE_WITH_SLASHES = r"(?:[0-9]{1,2}/[0-9]{1,2}/[0-9]{4}|[0-9]{1,2}[- ][A-Za-z]{3}[- ][0-9]{4}),? "
_OFFSET = r"\s?(Z|[+-][0-9]{2}:?[0-5][0-9])"
_HALF_DAY = r"(?:\s?([AaPp][Mm]))?"

Parts = tuple[str | None, ...]

_HOUR, _DAY = 3600 * 10**9, 86_400 * 10**9  # ns


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
        period = _PERIODS.get(self.style, 0)
        if elapsed < -period // 2 and self.origin < period:
            elapsed += period
        return elapsed / 1e9


TIME_OF_DAY = "hh:mm:ss"
MINUTES = "mm:ss"
DATE_WITH_POINTS = "dd.mm.yyyy hh:mm:ss"
# Day and month stand in either order, so that only the time of day counts.
DATE_WITH_SLASHES = "the hh:mm:ss beside a date"
ISO_8601 = "ISO 8601"
ISO_8601_WITH_OFFSET = "ISO 8601 with an offset from UTC"
_PERIODS = {TIME_OF_DAY: _DAY, DATE_WITH_SLASHES: _DAY, MINUTES: _HOUR}


def clock_format(first_cell: str) -> ClockFormat | None:
    """The format of a column of clock times that begins with this cell; None where that is no clock time."""
    for style in _STYLES:
        origin = _nanoseconds(first_cell, style)
        if origin is not None:
            return ClockFormat(style, origin)
    return None


def _nanoseconds(cell: str, style: str) -> int | None:
    """Clock time in ns, of its day or hour or since year 1; whole numbers lose nothing of a long date."""
    pattern, nanoseconds = _STYLES[style]
    match = pattern.fullmatch(cell.strip())
    return None if match is None else nanoseconds(match.groups())


def _dated_nanoseconds(year_month_day: Parts, clock: Parts) -> int | None:
    """Time since year 1; None where there is no such day or hour."""
    if int(clock[0] or 0) > 23:
        return None
    try:
        year, month, day = (int(part or 0) for part in year_month_day)
        return date(year, month, day).toordinal() * _DAY + _clock_nanoseconds(clock)
    except ValueError:
        return None


def _with_offset_nanoseconds(parts: Parts) -> int | None:
    local = _dated_nanoseconds(parts[:3], parts[3:7])
    return None if local is None else local - _offset_nanoseconds(str(parts[7]))


def _half_day_nanoseconds(parts: Parts) -> int | None:
    """Time of day, of twelve hours where AM or PM is said; None where there is no such hour."""
    half, hours = (parts[4] or "").upper(), int(parts[0] or 0)
    if not (1 <= hours <= 12 if half else hours <= 23):
        return None
    if half:
        hours = hours % 12 + (12 if half == "PM" else 0)
    return _clock_nanoseconds((str(hours), *parts[1:4]))


def _clock_nanoseconds(parts: Parts) -> int:
    hours, minutes, seconds = (int(part or 0) for part in parts[:3])
    return (hours * 3600 + minutes * 60 + seconds) * 10**9 + int((parts[3] or "").ljust(9, "0"))


def _offset_nanoseconds(offset: str) -> int:
    if offset == "Z":
        return 0
    minutes = int(offset[1:3]) * 60 + int(offset[-2:])
    return (-minutes if offset[0] == "-" else minutes) * 60 * 10**9


# By style: the pattern of a cell, and the time in ns of its groups, None where there is no such time.
_STYLES: dict[str, tuple[re.Pattern[str], Callable[[Parts], int | None]]] = {
    TIME_OF_DAY: (re.compile(_CLOCK), _clock_nanoseconds),
    ISO_8601: (re.compile(_ISO_DATE + _CLOCK), lambda parts: _dated_nanoseconds(parts[:3], parts[3:])),
    ISO_8601_WITH_OFFSET: (re.compile(_ISO_DATE + _CLOCK + _OFFSET), _with_offset_nanoseconds),
    DATE_WITH_POINTS: (re.compile(_GERMAN_DATE + _CLOCK), lambda parts: _dated_nanoseconds(parts[2::-1], parts[3:])),
    DATE_WITH_SLASHES: (re.compile(_DATE_WITH_SLASHES + _CLOCK + _HALF_DAY), _half_day_nanoseconds),
    MINUTES: (
        re.compile(r"([0-5]?[0-9]):([0-5][0-9])[.,]([0-9]{1,9})"),
        lambda parts: _clock_nanoseconds(("0", *parts)),
    ),
}
