"""Numbers taken from series, on series whose numbers are known."""

from __future__ import annotations

import numpy as np
import pytest

from tautwire.paper.simulation_records import (
    SimulationRecord,
    amplitude,
    dominant_frequency,
    max_abs,
    mean_reduction,
    relative_difference,
    turning_points,
)

TIME = np.linspace(0.0, 7.0, 2101)
DRIFT = 0.02 * TIME**3 - 0.1 * TIME


def test_frequency_of_a_swing_on_a_drift_is_found() -> None:
    assert dominant_frequency(TIME, DRIFT + 0.05 * np.sin(2 * np.pi * 1.33 * TIME)) == pytest.approx(1.33, abs=0.01)


def test_amplitude_of_a_swing_on_a_drift_is_found() -> None:
    swing = DRIFT + 0.05 * np.sin(2 * np.pi * 3.0 * TIME)
    assert amplitude(TIME, swing, 3.0, 2.0, 3.0) == pytest.approx(0.05, rel=0.02)


def test_differences_are_shares_of_the_base() -> None:
    base, other = (SimulationRecord(TIME, {"r": factor * TIME}) for factor in (2.0, 1.5))
    assert relative_difference(base, other, "r", 3.21) == pytest.approx(25.0)
    assert mean_reduction(base, other, "r") == pytest.approx(25.0)
    assert base.at("r", 1.0 / 3.0) == pytest.approx(2.0 / 3.0)
    assert max_abs(np.array([1.0, -3.0])) == 3.0


def test_curves_that_turn_together_are_compared_where_each_turns() -> None:
    first = SimulationRecord(TIME, {"r": np.sin(2.0 * TIME), "line": TIME})
    second = SimulationRecord(TIME, {"r": 0.9 * np.sin(2.0 * (TIME - 0.1)), "line": 1.1 * TIME})
    result = turning_points(first, second, "r", prominence=0.5)
    tops = (np.arange(4) + 0.5) * np.pi / 2.0
    assert [turn.time for turn in result] == pytest.approx(tops + 0.05, abs=0.005)
    assert [turn.gap for turn in result] == pytest.approx([0.1] * 4, abs=1e-4)
    (end,) = turning_points(first, second, "line", prominence=0.5)
    assert (end.time, end.gap) == pytest.approx((7.0, 0.7)), "a curve without turns at its end"
