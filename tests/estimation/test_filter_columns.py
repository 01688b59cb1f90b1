"""Columns of a filter's inputs: gaps in time, and outputs of sensors that lag."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tautwire.estimation.filter_columns import align_delayed_outputs, filter_columns
from tests.support.recordings import recorded

RECORDING = recorded("three", 1).first(60)
STEP = 0.02


def test_a_gap_is_filled_with_samples_that_measure_nothing() -> None:
    kept = np.delete(np.arange(60), np.arange(20, 23))
    gappy = replace(
        RECORDING, **{name: getattr(RECORDING, name)[kept] for name in ("time", "winch_speed", "tension", "position")}
    )
    outputs = np.hstack([gappy.position, gappy.tension])
    columns, is_recorded = filter_columns(gappy, outputs, np.zeros_like(outputs))
    measured, observed, _, speed, later, _, step, *_ = columns
    # Four intervals, in steps of at most one and a half.
    assert list(np.flatnonzero(~is_recorded)) == [20, 21]
    assert step[0, :-1] == pytest.approx(np.where(np.isin(np.arange(58), [19, 20, 21]), 4.0 / 3.0 * STEP, STEP))
    assert not np.any(observed[:, 20:22])
    assert np.array_equal(measured[:, is_recorded], outputs.T)
    # Speeds run on a straight line meanwhile.
    assert np.diff(speed[:, 19:23], 2) == pytest.approx(0.0, abs=1e-12)
    assert later[:, :-1] == pytest.approx(speed[:, 1:])


def test_a_late_sensor_is_aligned_with_the_state_that_it_shows() -> None:
    time = STEP * np.arange(50)
    shown = np.column_stack([np.sin(time), np.sin(time - 0.06)])
    values, shift = align_delayed_outputs(time, shown, np.array([0.0, 0.05]))
    assert values[:, 0] == pytest.approx(shown[:, 0])
    # 50 ms are two samples and a half: the nearest is 40 or 60 ms later than the state.
    ends = slice(0, 46)
    assert values[ends, 1] == pytest.approx(np.sin(time[ends] + shift[ends, 1] - 0.06))
    assert np.abs(shift[ends, 1] - 0.05) == pytest.approx(0.01)
    assert np.all(np.isnan(values[-2:, 1]))


def test_rotations_are_columns_of_their_own_from_which_what_is_measured_is_zero() -> None:
    rotation = np.linspace(0.0, 0.3, 60)[:, None] * [1.0, 2.0, -1.0]
    rotation[30] = np.nan
    outputs = np.hstack([RECORDING.position, rotation])
    (measured, observed, *_, turned), _ = filter_columns(RECORDING, outputs, np.zeros_like(outputs), 3)
    assert measured[3:] == pytest.approx(0.0)
    assert not np.any(observed[3:, 30])
    assert turned[:, 30] == pytest.approx(0.5 * (rotation[29] + rotation[31]))
    assert np.array_equal(turned[:, :30].T, rotation[:30])
