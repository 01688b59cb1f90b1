"""Winch speeds between samples: cubic splines of a smooth motion against its closed form."""

from dataclasses import replace

import numpy as np
import pytest

from tautwire.cosimulation import PiecewiseCubicInput
from tautwire.estimation.filter_columns import filter_columns
from tautwire.recordings.recording import Recording
from tautwire.recordings.speed_interpolation import speed_bends, with_linear_speeds, with_spline_speeds

STEP, TRAVEL, FREQUENCY = 0.01, 1e-3, 3.0
ANGLE = 2.0 * np.pi * FREQUENCY * STEP


def swinging(time: np.ndarray) -> Recording:
    """Two winches of which one swings, with x = TRAVEL sin(2 pi FREQUENCY t), and one stands."""
    speed = 2.0 * np.pi * FREQUENCY * TRAVEL * np.cos(2.0 * np.pi * FREQUENCY * time)
    count = len(time)
    nothing = np.full((count, 3), np.nan)
    return Recording("r.csv", time, np.column_stack([speed, 0.0 * time]), np.full((count, 2), np.nan), nothing)


def travel(time: np.ndarray) -> np.ndarray:
    return TRAVEL * np.sin(2.0 * np.pi * FREQUENCY * time)


def test_linear_speeds_lose_a_twelfth_of_the_squared_angle_and_splines_next_to_nothing() -> None:
    time = STEP * np.arange(301)
    recording = swinging(time)
    linear = np.max(np.abs(recording.wound_lengths()[:, 0] - travel(time)))
    cubic = np.max(np.abs(with_spline_speeds(recording).wound_lengths()[:, 0] - travel(time)))
    assert linear == pytest.approx(TRAVEL * ANGLE**2 / 12.0, rel=0.01)
    assert cubic < 0.02 * linear
    assert not np.any(with_spline_speeds(recording).wound_lengths()[:, 1])


def test_linear_speeds_have_no_bends() -> None:
    recording = swinging(STEP * np.arange(20))
    assert not np.any(speed_bends(recording))
    assert not np.any(speed_bends(with_linear_speeds(with_spline_speeds(recording))))
    assert np.any(speed_bends(with_spline_speeds(recording)))


def test_three_samples_stay_linear() -> None:
    assert with_spline_speeds(swinging(STEP * np.arange(3))).winch_acceleration is None


def test_parts_of_a_recording_keep_their_rates_and_other_speeds_are_linear() -> None:
    recording = with_spline_speeds(swinging(STEP * np.arange(60)))
    assert recording.winch_acceleration is not None
    np.testing.assert_array_equal(recording.part(20, 40).winch_acceleration, recording.winch_acceleration[20:40])
    assert recording.with_winch_speed(2.0 * recording.winch_speed).winch_acceleration is None


def test_parts_of_a_gap_move_the_rope_as_the_whole_step() -> None:
    time = np.delete(STEP * np.arange(60), [20, 21, 22, 40])
    recording = with_spline_speeds(swinging(time))
    nothing = np.full((len(time), 1), np.nan)
    (_, _, _, speed, later, bends, step, *_), is_recorded = filter_columns(recording, nothing, np.zeros_like(nothing))
    begin, end = bends[:2], bends[2:]
    moved = step * (0.5 * (speed + later) + (begin - end) / 12.0)
    reached = np.concatenate([[0.0], np.cumsum(moved[0])[:-1]])
    assert np.count_nonzero(~is_recorded) == 3
    assert reached[is_recorded] == pytest.approx(recording.wound_lengths()[:, 0], abs=1e-15)
    exact = 2.0 * np.pi * FREQUENCY * TRAVEL * np.cos(2.0 * np.pi * FREQUENCY * (0.01 * 19 + 0.04 / 3.0))
    assert speed[0, 20] == pytest.approx(exact, rel=2e-3)
    assert np.interp(0.01 * 19 + 0.04 / 3.0, time, recording.winch_speed[:, 0]) != pytest.approx(exact, rel=2e-2)


def test_input_of_a_co_simulation_is_the_same_cubic_within_a_step() -> None:
    recording = with_spline_speeds(swinging(STEP * np.arange(50)))
    assert recording.winch_acceleration is not None
    source = PiecewiseCubicInput(recording.time, recording.winch_speed, recording.winch_acceleration)
    start, end = source.interval(7, 0.07, STEP, np.zeros(0))
    assert start.tolist() == pytest.approx([recording.winch_speed[7, 0], recording.winch_acceleration[7, 0], 0.0, 0.0])
    assert end.tolist() == pytest.approx([recording.winch_speed[8, 0], recording.winch_acceleration[8, 0], 0.0, 0.0])
    for at in (0.072, 0.0755):
        angle = 2.0 * np.pi * FREQUENCY * at
        value, rate, *_ = source.interval(7, at, 0.001, np.zeros(0))[0]
        assert value == pytest.approx(2.0 * np.pi * FREQUENCY * TRAVEL * np.cos(angle), abs=2e-6)
        assert rate == pytest.approx(-((2.0 * np.pi * FREQUENCY) ** 2) * TRAVEL * np.sin(angle), rel=2e-2)


def test_a_recording_of_another_clock_begins_at_any_time() -> None:
    time = STEP * np.arange(100)
    moved = replace(swinging(time), time=time + 1e4)
    wound = with_spline_speeds(moved).wound_lengths()[:, 0]
    assert wound == pytest.approx(with_spline_speeds(swinging(time)).wound_lengths()[:, 0], abs=1e-9)
