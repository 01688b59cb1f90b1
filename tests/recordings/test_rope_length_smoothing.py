"""Winch speeds of splines through recorded rope lengths move the ropes as they moved; what is left is stated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tautwire.recordings.recording import Recording
from tautwire.recordings.rope_length_smoothing import (
    LengthSmoothing,
    length_noise,
    length_smoothing,
    with_smoothed_lengths,
)

INTERVAL, COUNT = 0.005, 1e-4
TIMES = INTERVAL * np.arange(4001)


def lengths(times: np.ndarray = TIMES) -> np.ndarray:
    """Rope lengths (N, 2) in m of winches that move slowly and shake."""
    slow = 0.3 * np.sin(2.0 * np.pi * 0.11 * times[:, None] + np.arange(2.0))
    return 2.0 + slow + 0.01 * np.sin(2.0 * np.pi * 1.7 * times[:, None] + np.arange(2.0))


def log(recorded: np.ndarray, times: np.ndarray = TIMES) -> Recording:
    """A log of recorded lengths."""
    nothing = np.full((len(times), 2), np.nan)
    speeds = -np.gradient(recorded, times, axis=0)
    return Recording("log.csv", times, speeds, nothing, np.full((len(times), 3), np.nan), rope_length=recorded)


def counted(count: float) -> np.ndarray:
    return count * np.round(lengths() / count)


def errors(recording: Recording) -> np.ndarray:
    """Errors (N, 2) in m of what the speeds, linear between samples, have moved, less their means."""
    moved: np.ndarray = recording.wound_lengths() + lengths() - lengths()[0]
    return moved - np.mean(moved, axis=0)


def smoothings(recording: Recording) -> list[LengthSmoothing]:
    every = length_smoothing(recording)
    assert all(each is not None for each in every)
    return [each for each in every if each is not None]


@pytest.mark.validate
def test_the_error_that_is_stated_is_the_one_that_is_left() -> None:
    recording = log(counted(COUNT))
    stated = smoothings(recording)
    left = np.std(errors(with_smoothed_lengths(recording, stated)), axis=0)
    assert [each.rms for each in stated] == pytest.approx(left, rel=0.2)
    assert np.all(left < 0.45 * COUNT / np.sqrt(12.0))


@pytest.mark.validate
def test_its_bandwidth_is_that_of_a_process_with_the_same_memory() -> None:
    noise = 3e-5 * np.random.default_rng(1).standard_normal((len(TIMES), 2))
    stated = smoothings(log(lengths() + noise))
    left = -with_smoothed_lengths(log(noise), stated).wound_lengths()
    left -= np.mean(left, axis=0)
    for error, each in zip(left.T, stated, strict=True):
        memory = 1.0 / (2.0 * np.pi * each.bandwidth)
        lags = range(1, int(6.0 * memory / INTERVAL))
        correlation = [np.mean(error[lag:] * error[:-lag]) / np.mean(error**2) for lag in lags]
        assert INTERVAL * (0.5 + np.sum(correlation)) == pytest.approx(memory, rel=0.3)


def test_lengths_without_noise_move_the_rope_as_it_moved() -> None:
    recording = log(lengths())
    speeds = with_smoothed_lengths(recording, [LengthSmoothing(1e-12, 0.0, 1.0)] * 2)
    # Without the correction of trapezoidal sums this would be 1e-5.
    assert np.max(np.abs(errors(speeds)[50:-50])) < 2e-7


def test_uneven_steps_and_missing_samples_leave_no_lasting_error() -> None:
    is_kept = np.random.default_rng(3).random(len(TIMES)) > 0.1
    is_kept[1995:2005] = False
    times = TIMES[is_kept]
    recording = log(lengths(times), times)
    moved = with_smoothed_lengths(recording, [LengthSmoothing(1e-12, 0.0, 1.0)] * 2).wound_lengths()
    error = moved + lengths(times) - lengths(times)[0]
    # With the correction of even steps this would be 2e-4.
    assert np.max(np.abs(error[times > TIMES[2010]])) < 5e-6


def test_a_count_shows_in_third_differences() -> None:
    assert length_noise(counted(COUNT)[:, 0]) == pytest.approx(COUNT / np.sqrt(12.0), rel=0.03)
    noisy = lengths()[:, 0] + 5e-5 * np.random.default_rng(2).standard_normal(len(TIMES))
    assert length_noise(noisy) == pytest.approx(5e-5, rel=0.1)


@pytest.mark.validate
def test_a_long_rest_before_the_motion_does_not_smooth_the_motion() -> None:
    rest = np.repeat(counted(COUNT)[:1], 20_000, axis=0)
    times = INTERVAL * np.arange(20_000 + len(TIMES))
    stated = smoothings(log(np.vstack([rest, counted(COUNT)]), times))
    alone = smoothings(log(counted(COUNT)))
    assert [each.penalty for each in stated] == pytest.approx([each.penalty for each in alone], rel=1.0)


def test_speeds_that_were_recorded_stay() -> None:
    recorded = counted(COUNT)
    recorded[:, 1] = np.nan
    recording = replace(log(counted(COUNT)), rope_length=recorded)
    first, second = length_smoothing(recording)
    assert first is not None and second is None
    smoothed = with_smoothed_lengths(recording, (first, second))
    assert np.array_equal(smoothed.winch_speed[:, 1], recording.winch_speed[:, 1])
    assert not np.array_equal(smoothed.winch_speed[:, 0], recording.winch_speed[:, 0])
    assert length_smoothing(replace(recording, rope_length=None)) == (None, None)


def test_a_winch_that_stands_has_no_error() -> None:
    assert length_smoothing(log(np.full((len(TIMES), 2), 2.0))) == (None, None)


def test_a_steady_motion_is_no_count() -> None:
    noise = 2e-6 * np.random.default_rng(4).standard_normal(len(TIMES))
    assert length_noise(2.0 + 0.1 * TIMES + noise) == pytest.approx(2e-6, rel=0.1)
    assert length_noise(2.0 + 0.1 * TIMES) < 1e-6


def test_a_bridged_gap_has_no_smaller_counts() -> None:
    slow = COUNT * np.round((2.0 + 0.003 * np.sin(2.0 * np.pi * 0.11 * TIMES)) / COUNT)
    step = int(np.flatnonzero(np.diff(slow))[5])
    bridged = slow.copy()
    bridged[step - 2 : step + 4] = np.linspace(slow[step - 2], slow[step + 3], 6)
    assert length_noise(bridged) == pytest.approx(length_noise(slow)) == pytest.approx(COUNT / np.sqrt(12.0))
