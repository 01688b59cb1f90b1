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


def orientations(angle: float) -> Columns:
    """A platform that turns by an angle (rad) about x, seen with noise."""
    time, generator = np.arange(1000) / 100.0, np.random.default_rng(7)
    half = 0.5 * angle * np.sin(time) + 1e-4 * generator.normal(size=1000)
    return {"qw": np.cos(half), "qx": np.sin(half), "qy": np.zeros(1000), "qz": np.zeros(1000)}


def lost_at(recorded: Columns, quaternion: tuple[float, float, float, float]) -> Columns:
    placeholders = zip(recorded, quaternion, strict=True)
    return {name: np.where(LOST, value, recorded[name]) for name, value in placeholders}


@pytest.mark.parametrize("quaternion", [(1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 0.0)])
def test_a_quaternion_that_the_platform_jumps_to_is_no_orientation(quaternion: tuple[float, ...]) -> None:
    turned = orientations(0.2)
    turned["qw"], turned["qz"] = 0.8 * turned["qw"] - 0.6 * turned["qz"], 0.6 * turned["qw"] + 0.8 * turned["qz"]
    flipped = {name: np.where(np.arange(1000) < 500, values, -values) for name, values in turned.items()}
    changed, (note,) = without_placeholders(columns() | lost_at(flipped, quaternion))
    assert all(np.array_equal(np.isnan(changed[name]), LOST) for name in flipped)
    assert note.startswith("qw, qx, qy, qz: 23 samples ") and note.endswith(" are no orientation: not used")


def test_a_quaternion_near_the_measured_ones_is_lost_with_the_position() -> None:
    """Identity, beside a platform that hardly turns: no jump shows it."""
    recorded = columns() | lost_at(orientations(0.001), (1.0, 0.0, 0.0, 0.0))
    assert without_placeholders(recorded)[1] == ()
    lost = recorded | {name: np.where(LOST, 0.0, recorded[name]) for name in "xyz"}
    changed, notes = without_placeholders(lost)
    assert len(notes) == 2 and all(np.array_equal(np.isnan(changed[name]), LOST) for name in ("x", "qw", "qz"))


def test_orientations_of_another_sensor_stay_where_the_position_is_lost() -> None:
    recorded = columns() | orientations(0.01)
    changed, notes = without_placeholders(recorded | {name: np.where(LOST, 0.0, recorded[name]) for name in "xyz"})
    assert len(notes) == 1 and all(np.isfinite(changed[name]).all() for name in orientations(0.01))


def test_a_platform_at_rest_whose_quaternion_changes_its_sign_is_measured() -> None:
    time = np.arange(1000) / 100.0
    half = 0.1 * np.sin(np.maximum(time - 5.0, 0.0))
    sign = np.where((time > 2.0) & (time < 3.0), -1.0, 1.0)
    recorded = {"qw": sign * np.cos(half), "qx": sign * np.sin(half), "qy": 0.0 * time, "qz": 0.0 * time}
    assert without_placeholders(columns() | recorded)[1] == ()


@pytest.mark.parametrize(("name", "value"), [("tension_1", 0.0), ("tension_1", -1.0), ("z", -1.0), ("z", 0.0)])
def test_a_value_that_one_sensor_drops_to_again_and_again_is_emptied(name: str, value: float) -> None:
    dropped = np.isin(np.arange(1000), (120, 121, 480, 800))
    changed, (note,) = without_placeholders(columns() | {name: np.where(dropped, value, columns()[name])})
    assert np.array_equal(np.isnan(changed[name]), dropped) and note.startswith(f"{name}: 4 samples at {value:.6g} are")


def test_one_sample_alone_is_left_to_the_outliers() -> None:
    recorded = columns() | {"z": np.where(np.arange(1000) == 480, -1.0, columns()["z"])}
    assert without_placeholders(recorded)[1] == ()
