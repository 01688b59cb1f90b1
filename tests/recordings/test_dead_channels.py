from dataclasses import replace

import numpy as np
import pytest

from tautwire.recordings.dead_channels import without_dead_channels
from tautwire.recordings.recording import Recording
from tests.support.pose_recordings import noisy, wandering_recording
from tests.support.recordings import recorded
from tests.support.rigid_robots import crane_robot
from tests.support.robots import NAMES

WHOLE = recorded("three", 1)


def with_tension(place: int, values: np.ndarray) -> Recording:
    tension = WHOLE.tension.copy()
    tension[:, place] = values
    return replace(WHOLE, tension=tension)


@pytest.mark.parametrize("name", NAMES)
def test_a_recording_as_it_should_be_stays(name: str) -> None:
    recording = recorded(name, 1)
    cleaned, notes = without_dead_channels(recording)
    assert cleaned is recording and notes == ()


def test_a_load_cell_that_shows_one_value_all_along_is_not_used() -> None:
    cleaned, notes = without_dead_channels(with_tension(1, np.full(801, 1432.0)))
    assert np.isnan(cleaned.tension[:, 1]).all() and np.isfinite(cleaned.tension[:, [0, 2]]).all()
    assert notes == (f"{WHOLE.path}: tension_2 is constant throughout: not used",)


def test_a_load_cell_out_of_its_range_is_not_used_there() -> None:
    column = WHOLE.tension[:, 1]
    limit = float(np.round(np.quantile(column, 0.9)))
    cleaned, notes = without_dead_channels(with_tension(1, np.minimum(column, limit)))
    assert np.array_equal(np.isnan(cleaned.tension[:, 1]), column >= limit)
    assert f"tension_2: at its largest value, {limit:.6g} N, in {np.sum(column >= limit)} samples" in notes[0]


def test_slack_ropes_and_coarse_steps_are_no_load_cells_out_of_their_range() -> None:
    column = WHOLE.tension[:, 1]
    for shown in (np.maximum(column, np.quantile(column, 0.1)), 20.0 * np.round(column / 20.0)):
        assert np.isfinite(without_dead_channels(with_tension(1, shown))[0].tension[:, 1]).mean() > 0.99


def test_a_standstill_under_the_largest_tension_is_not_out_of_range() -> None:
    still = np.arange(801) < 300
    tension = np.where(still[:, None], WHOLE.tension.max(axis=0), WHOLE.tension)
    cleaned, notes = without_dead_channels(replace(WHOLE, tension=tension))
    assert np.isfinite(cleaned.tension).all() and notes == ()


def test_a_robot_that_rests_at_both_ends_keeps_a_cell_whose_steps_are_larger_than_its_noise() -> None:
    """Its largest value is that of home, about which the other cells have hysteresis."""
    rows = np.arange(801)[:, None]
    moved = np.where((rows > 250) & (rows < 550), 300.0 * np.sin(np.pi * (rows - 250) / 300.0), 0.0)
    hysteresis = np.where(rows < 400, 0.0, 40.0) * np.array([1.0, 0.0, 1.0])
    noise = np.random.default_rng(1).normal(scale=0.02, size=(801, 3))
    tension = np.round((1000.0 - moved + hysteresis + noise) / 0.5) * 0.5
    cleaned, notes = without_dead_channels(replace(WHOLE, tension=tension))
    assert np.isfinite(cleaned.tension[:, 1]).mean() > 0.99, notes


def test_a_load_cell_that_shows_noise_alone_is_not_used() -> None:
    noise = np.random.default_rng(1).normal(scale=2.0, size=801)
    cleaned, notes = without_dead_channels(with_tension(2, 700.0 + noise))
    assert np.isnan(cleaned.tension[:, 2]).all()
    assert "tension_3 shows only noise" in notes[0]


def test_a_robot_that_rests_all_along_keeps_its_load_cells() -> None:
    noise = np.random.default_rng(1).normal(scale=2.0, size=(801, 3))
    resting = replace(WHOLE, tension=1000.0 + noise, position=WHOLE.position[:1] + 1e-4 * noise)
    assert without_dead_channels(resting)[0] is resting


def test_a_load_cell_that_dies_on_the_way_is_used_until_then() -> None:
    values = WHOLE.tension[:, 0].copy()
    values[500:] = values[500]
    cleaned, notes = without_dead_channels(with_tension(0, values))
    assert np.isfinite(cleaned.tension[:501, 0]).all() and np.isnan(cleaned.tension[501:, 0]).all()
    assert "tension_1: frozen for 300 samples" in notes[0]


def test_a_slower_sensor_whose_values_are_repeated_is_used_once_a_value() -> None:
    held = WHOLE.position[np.arange(801) // 5 * 5]
    cleaned, notes = without_dead_channels(replace(WHOLE, position=held))
    assert np.flatnonzero(np.isfinite(cleaned.position).all(axis=1)).tolist() == list(range(0, 801, 5))
    assert "x, y, z: each value is repeated about 5 times" in notes[0]


def test_a_coordinate_that_never_changes_is_not_used() -> None:
    position = WHOLE.position.copy()
    position[:, 1] = 0.0
    cleaned, notes = without_dead_channels(replace(WHOLE, position=position))
    assert np.isnan(cleaned.position[:, 1]).all() and np.isfinite(cleaned.position[:, 0]).all()
    assert "y is constant throughout" in notes[0]


def test_a_coarse_sensor_is_no_slow_one() -> None:
    coarse = np.round(WHOLE.tension / 20.0) * 20.0
    cleaned, notes = without_dead_channels(replace(WHOLE, tension=coarse))
    assert np.mean(np.isfinite(cleaned.tension)) > 0.8
    assert not any("repeated" in note for note in notes)


RIGID = noisy(wandering_recording(crane_robot()))


def test_an_orientation_that_is_constant_is_not_used() -> None:
    still = replace(RIGID, orientation=np.tile([1.0, 0.0, 0.0, 0.0], (RIGID.sample_count, 1)))
    cleaned, notes = without_dead_channels(still)
    assert not cleaned.has_orientation
    assert notes == ("log.csv: qw, qx, qy, qz are constant throughout: not used",)


def test_of_an_orientation_that_is_held_the_first_sample_of_each_is_used() -> None:
    held = replace(RIGID, orientation=np.repeat(RIGID.orientation[::4], 4, axis=0)[: RIGID.sample_count])
    cleaned, notes = without_dead_channels(held)
    assert np.flatnonzero(np.isfinite(cleaned.orientation).all(axis=1)).tolist() == list(
        range(0, RIGID.sample_count, 4)
    )
    assert notes == ("log.csv: qw, qx, qy, qz: each value is repeated about 4 times: only the first was used",)


def test_an_orientation_that_freezes_while_the_platform_moves_is_not_used_there() -> None:
    orientation = RIGID.orientation.copy()
    orientation[100:160] = orientation[99]
    cleaned, notes = without_dead_channels(replace(RIGID, orientation=orientation))
    assert np.flatnonzero(np.isnan(cleaned.orientation).any(axis=1)).tolist() == list(range(100, 160))
    assert notes == ("log.csv: qw, qx, qy, qz: frozen for 60 samples while positions move: not used there",)
    assert without_dead_channels(RIGID) == (RIGID, ())


def test_positions_that_a_tracker_repeats_while_winches_move_are_emptied() -> None:
    position = WHOLE.position.copy()
    position[300:500] = position[300]
    cleaned, notes = without_dead_channels(replace(WHOLE, position=position))
    assert np.isnan(cleaned.position[301:500]).all() and np.isfinite(cleaned.position[:301]).all()
    assert notes == (f"{WHOLE.path}: x, y, z: frozen for 199 samples while winches move: not used there",)
    at_rest = replace(WHOLE, position=position, winch_speed=np.zeros_like(WHOLE.winch_speed))
    assert without_dead_channels(at_rest)[1] == ()
