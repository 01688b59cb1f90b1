"""Clock times in seconds from the first sample."""

from __future__ import annotations

import math
from datetime import datetime, timedelta, timezone

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tautwire.recordings.clock_time import clock_format

ZONES = st.integers(-840, 840).map(lambda minutes: timezone(timedelta(minutes=minutes)))
TIMES = st.datetimes(datetime(1900, 1, 1), datetime(2200, 1, 1), timezones=ZONES)


@given(first=TIMES, second=TIMES)
def test_differences_are_those_of_the_standard_library(first: datetime, second: datetime) -> None:
    clock = clock_format(first.isoformat())
    assert clock is not None
    assert clock.seconds(second.isoformat(" ")) == pytest.approx((second - first).total_seconds(), rel=1e-15)


@pytest.mark.parametrize(
    ("first", "cell", "seconds"),
    [
        ("0:00:00", "0:00:00.000000001", 1e-9),
        ("23:59:59,5", "100:00:00", 76 * 3600 + 0.5),
        ("23:59:59.5", "00:00:00.25", 0.75),
        ("23:59:59.5", "0:30:00", 1800.5),
        ("13:00:00", "12:59:59", -1.0),
        ("30:00:00", "10:00:00", -72000.0),
        ("2024-02-29 00:00:00", "2024-03-01 00:00:00.25", 86400.25),
        ("2024-05-31T12:00:00Z", "2024-05-31T10:00:00-0200", 0.0),
        ("29.2.2024 23:59:59,5", "01.03.2024 00:00:00,25", 0.75),
        ("11/27/2026 11:59:59.5 AM", "11/27/2026 12:00:00.25 PM", 0.75),
        ("11/27/2026 11:59:59.5 PM", "11/28/2026 12:00:00.25 AM", 0.75),
        ("27/11/2026 23:59:59.5", "28/11/2026 00:00:00.25", 0.75),
        ("59:59.5", "00:00.25", 0.75),
        ("00:00.000", "01:02.010", 62.01),
    ],
)
def test_times_differ_by(first: str, cell: str, seconds: float) -> None:
    clock = clock_format(first)
    assert clock is not None and clock.seconds(cell) == seconds


@pytest.mark.parametrize(
    "cell",
    [
        "12:00",
        "1/2/2026 13:00:00 PM",
        "1/2/2026 24:00:00",
        "31.05.2024",
        "1.5",
        "",
        "12:61:00",
        "31.06.2024 12:00:00",
        "2023-02-29T00:00:00",
        "٣:00:00",
    ],
)
def test_other_texts_are_no_clock_times(cell: str) -> None:
    assert clock_format(cell) is None
    clock = clock_format("0:00:00")
    assert clock is not None and math.isnan(clock.seconds(cell))
