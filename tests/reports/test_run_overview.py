"""The overview of a run: peaks stay, memory does not grow, ends are right."""

from __future__ import annotations

import numpy as np
import pytest

from tautwire.cosimulation import MemoryRecorder
from tautwire.reports.run_overview import RecorderPair, RunOverview


def filled(values: np.ndarray, groups: int) -> RunOverview:
    """An overview of rows at every 10 ms."""
    overview = RunOverview(groups)
    for place, row in enumerate(values):
        overview.add(0.01 * place, row)
    return overview


def test_short_run_is_kept_as_it_is() -> None:
    values = np.random.default_rng(1).normal(size=(150, 3))
    overview = filled(values, 100)
    assert (overview.group_size, overview.row_count) == (1, 150)
    assert np.array_equal(overview.rows, values)
    time, line = overview.curve(2)
    assert np.array_equal(line, values[:, 2]) and time[-1] == pytest.approx(1.49)


@pytest.mark.parametrize("count", [200, 1999, 2000, 2001, 12_345])
def test_long_run_stays_small_with_its_extremes_and_ends(count: int) -> None:
    values = np.random.default_rng(2).normal(size=(count, 2))
    values[count // 3, 0], values[count // 2, 1] = 40.0, -50.0
    overview = filled(values, 100)
    assert len(overview.rows) <= 200
    low, high = overview.extremes()
    assert np.array_equal(low, values.min(axis=0)) and np.array_equal(high, values.max(axis=0))
    assert np.array_equal(overview.rows, values[:: overview.group_size])
    assert np.array_equal(overview.last_row, values[-1])
    for output in (0, 1):
        time, line = overview.curve(output)
        assert (np.diff(time) >= 0.0).all()
        assert np.array_equal(line, values[np.round(100.0 * time).astype(int), output])


def test_what_is_not_finite_is_no_extreme() -> None:
    values = np.sin(np.arange(900.0))[:, None].repeat(2, axis=1)
    values[100:110, 0], values[5, 0], values[:, 1] = np.nan, np.inf, np.nan
    low, high = filled(values, 50).extremes()
    assert low[0] == pytest.approx(-1.0, abs=1e-4) and high[0] == pytest.approx(1.0, abs=1e-4)
    assert np.isnan(low[1]) and np.isnan(high[1])


def test_rows_go_to_both_recorders() -> None:
    kept, overview = MemoryRecorder(5, 1), RunOverview()
    both = RecorderPair(kept, overview)
    row = np.zeros(1)
    for place in range(5):
        row[0] = place
        both.add(float(place), row)
    assert np.array_equal(kept.rows, overview.rows)
