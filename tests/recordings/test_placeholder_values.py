"""Values that sensors write while they measure nothing are emptied; values that they measure stay."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire.recordings.placeholder_values import without_placeholders

Columns = dict[str, NDArray[np.float64]]
LOST = np.zeros(1000, dtype=bool)
LOST[300:321] = LOST[700:702] = True


def columns() -> Columns:
    """A robot in motion, seen with noise."""
    time, generator = np.arange(1000) / 100.0, np.random.default_rng(5)
    signals = {"x": 2.0 + np.sin(time), "y": 0.1 * np.cos(time), "z": 1.0 + 0.3 * np.sin(2.0 * time)}
    signals |= {"tension_1": 300.0 + 20.0 * np.sin(time), "tension_2": 20.0 * np.sin(time)}
    return {"time": time} | {name: values + 1e-4 * generator.normal(size=1000) for name, values in signals.items()}


@pytest.mark.parametrize("value", [0.0, -1.0, 9999.0, -1e6])
@pytest.mark.parametrize("lost", [LOST, np.arange(1000) < 50, np.arange(1000) >= 600], ids=["inside", "first", "last"])
def test_positions_where_the_tracker_lost_the_platform_are_emptied(value: float, lost: NDArray[np.bool_]) -> None:
    recorded = {name: np.where(lost & (name in "xyz"), value, values) for name, values in columns().items()}
    changed, (note,) = without_placeholders(recorded)
    for axis in "xyz":
        assert np.array_equal(np.isnan(changed[axis]), lost)
        assert np.array_equal(changed[axis][~lost], columns()[axis][~lost])
    assert note.startswith(f"x, y, z: {lost.sum()} samples at {value:.6g}, ")


def test_a_load_cell_beyond_its_range_is_emptied() -> None:
    recorded = columns() | {"tension_1": np.where(LOST, -9999.0, columns()["tension_1"])}
    changed, (note,) = without_placeholders(recorded)
    assert np.array_equal(np.isnan(changed["tension_1"]), LOST) and note.startswith("tension_1: 23 samples at -9999 ")


def test_what_a_sensor_measures_stays() -> None:
    """Slack ropes, resting platforms, coarse or slow sensors and single coordinates at zero are measured."""
    recorded = columns()
    recorded["tension_2"] = np.maximum(np.round(recorded["tension_2"]), 0.0)
    recorded["tension_1"] = np.where(LOST, 0.0, recorded["tension_1"])
    recorded["y"] = np.where(LOST, 0.0, recorded["y"])
    for axis in "xz":
        recorded[axis] = np.round(recorded[axis][np.arange(1000) // 8 * 8], 3)
    changed, notes = without_placeholders(recorded)
    assert notes == () and all(np.array_equal(changed[name], values) for name, values in recorded.items())


def test_an_axis_without_values_hides_no_placeholder() -> None:
    recorded = {name: np.where(LOST & (name in "xz"), 0.0, values) for name, values in columns().items()}
    changed, notes = without_placeholders(recorded | {"y": np.full(1000, np.nan)})
    assert np.array_equal(np.isnan(changed["x"]), LOST) and len(notes) == 1
