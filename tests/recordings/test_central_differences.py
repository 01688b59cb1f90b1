"""Winch speeds that are central differences of counts move the rope as it was, once they are taken back."""

from dataclasses import replace

import numpy as np
import pytest

from tautwire.recordings.central_differences import may_be_central_differences, with_speeds_between_samples
from tautwire.recordings.recording import Recording
from tests.support.recordings import recorded

INTERVAL, COUNT = 0.01, 1e-6
TIMES = INTERVAL * np.arange(801)


def travel(frequency: float) -> np.ndarray:
    """Rope travel (N, 3) in m of winches that swing at a frequency (Hz)."""
    return 0.01 * np.sin(2.0 * np.pi * frequency * TIMES[:, None] + np.arange(3.0))


def log(lengths: np.ndarray, times: np.ndarray = TIMES) -> Recording:
    """A log whose speeds are central differences of these lengths."""
    nothing = np.full((len(times), 3), np.nan)
    return Recording("log.csv", times, np.gradient(lengths, times, axis=0), nothing, nothing)


def travel_errors(recording: Recording, lengths: np.ndarray) -> np.ndarray:
    """Errors (m) of what the speeds, linear between samples, move in two steps; away from the ends."""
    speeds, steps = recording.winch_speed, np.diff(recording.time)[:, None]
    moved = 0.5 * (speeds[1:] + speeds[:-1]) * steps
    errors: np.ndarray = (moved[1:] + moved[:-1] - (lengths[2:] - lengths[:-2]))[5:-5]
    return errors


@pytest.mark.parametrize("frequency", [2.0, 7.0, 15.0])
def test_the_rope_moves_as_the_encoder_saw(frequency: float) -> None:
    lengths = travel(frequency)
    before, after = (
        np.sqrt(np.mean(travel_errors(recording, lengths) ** 2))
        for recording in (log(lengths), with_speeds_between_samples(log(lengths)))
    )
    # The series leaves the third power of what was smoothed away.
    smoothed = np.sin(np.pi * frequency * INTERVAL) ** 2
    assert after == pytest.approx(smoothed**2 * before, rel=0.02)


def test_slow_speeds_stay() -> None:
    recording = log(0.1 * TIMES[:, None] * np.array([1.0, -0.5, 0.2]))
    assert np.allclose(with_speeds_between_samples(recording).winch_speed, recording.winch_speed, rtol=1e-12)


def test_nothing_is_taken_across_a_gap() -> None:
    kept = (TIMES < 3.0) | (TIMES > 4.0)
    recording = log(travel(7.0)[kept], TIMES[kept])
    corrected = with_speeds_between_samples(recording).winch_speed
    last = np.flatnonzero(TIMES[kept] < 3.0)[-1]
    assert np.array_equal(corrected[[last, last + 1]], recording.winch_speed[[last, last + 1]])
    assert not np.allclose(corrected[last - 5], recording.winch_speed[last - 5], rtol=1e-3)


def test_counts_show_in_few_different_speeds() -> None:
    assert may_be_central_differences(log(COUNT * np.round(travel(2.0) / (100 * COUNT)) * 100))
    assert not may_be_central_differences(recorded("three", 1))


def test_rates_of_rope_lengths_are_differences() -> None:
    speeds = recorded("three", 1)
    assert not may_be_central_differences(speeds)
    assert may_be_central_differences(replace(speeds, rope_length=-speeds.wound_lengths()))


def test_winches_that_stand_tell_nothing() -> None:
    standing = replace(recorded("three", 1), winch_speed=np.zeros_like(recorded("three", 1).winch_speed))
    assert not may_be_central_differences(standing)
