"""Samples of sensors slower than the log are joined by lines; gaps of the sensor stay gaps."""

from __future__ import annotations

import numpy as np
import pytest

from tautwire.recordings.sensor_gaps import bridge_short_gaps, slower_rate

TIME = np.cumsum(np.where(np.arange(60) % 2, 0.01, 0.03))


def measured(*rows: int) -> np.ndarray:
    values = np.full(60, np.nan)
    values[list(rows)] = 2.0 * TIME[list(rows)]
    return values


def test_rows_between_samples_are_on_the_line_through_them_in_time() -> None:
    drawn = bridge_short_gaps(TIME, measured(4, 8, 12, 16, 30))
    assert np.isnan(drawn[:4]).all() and np.isnan(drawn[31:]).all()
    np.testing.assert_allclose(drawn[4:31], 2.0 * TIME[4:31], rtol=1e-12)


def test_a_gap_of_more_than_five_intervals_of_the_sensor_stays() -> None:
    drawn = bridge_short_gaps(TIME, measured(4, 8, 12, 16, 38, 42))
    assert np.isfinite(drawn[4:17]).all() and np.isfinite(drawn[38:43]).all() and np.isnan(drawn[17:38]).all()


def test_columns_are_bridged_each_by_its_own_samples() -> None:
    drawn = bridge_short_gaps(TIME, np.column_stack([measured(), measured(4), measured(4, 8)]))
    assert np.isfinite(drawn).sum(axis=0).tolist() == [0, 1, 5]


def test_a_sensor_that_is_evenly_slower_has_its_own_rate_whatever_its_gaps() -> None:
    time = np.arange(4000) / 200.0
    on_row = np.full(4000, np.nan)
    on_row[np.round(np.arange(0.0, 19.99, 1.0 / 120.0) * 200.0).astype(int)] = 1.0
    assert slower_rate(time, on_row) == pytest.approx(120.0, rel=1e-3)
    on_row[1000:1500] = np.nan
    assert slower_rate(time, on_row) == pytest.approx(120.0, rel=1e-3)


@pytest.mark.parametrize("share", [0.0, 0.01, 0.05, 0.1, 0.4, 0.9, 1.0])
def test_samples_that_are_missing_here_and_there_are_no_rate(share: float) -> None:
    time = np.arange(4000) / 200.0
    values = np.where(np.random.default_rng(3).random(4000) < share, np.nan, 1.0)
    assert slower_rate(time, values) is None
