"""A recording that was resampled, delayed or shifted from another is told by its noise; another run is not."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from tautwire.errors import RecordingError
from tautwire.recordings.recording import Recording, read_recording, recording_from_frame
from tautwire.recordings.shared_noise import noise_correlation
from tautwire.recordings.shared_samples import require_unseen
from tests.support.robots import EXAMPLES

CABLES = {"three": 3, "eight": 8, "cogiro": 8}
OTHERS = CABLES | {"caroca8": 8}


def shipped(name: str, recording: str) -> Recording:
    return read_recording(EXAMPLES / name / f"{recording}.csv", OTHERS[name])


def resampled(recording: Recording, stride: float, delay: float, shift: float) -> Recording:
    """A recording at every so many of its intervals, from so many on, with its positions shifted (m)."""
    frame, interval = recording.frame(), float(np.median(np.diff(recording.time)))
    times = np.arange(recording.time[0] + delay * interval, recording.time[-1], stride * interval)
    columns = {name: np.interp(times, recording.time, frame[name]) for name in frame}
    columns |= {"time": times - times[0]} | {axis: columns[axis] + shift for axis in "xyz"}
    return recording_from_frame(pd.DataFrame(columns), recording.cable_count)


@pytest.mark.parametrize(
    ("stride", "delay", "shift"),
    [(1.0, 0.5, 0.0), (0.8, 0.3, 0.0), (1.25, 0.0, 0.0), (1.0, 0.0, 0.05), (3.0, 0.1, 0.0)],
)
@pytest.mark.parametrize("name", CABLES)
def test_a_copy_at_other_times_or_places_is_refused(name: str, stride: float, delay: float, shift: float) -> None:
    fit = shipped(name, "fit")
    with pytest.raises(RecordingError, match=r"the noise of FIT|samples in common"):
        require_unseen(fit, resampled(fit, stride, delay, shift))


@pytest.mark.parametrize("name", OTHERS)
def test_another_run_has_noise_of_its_own(name: str) -> None:
    assert noise_correlation(shipped(name, "check"), shipped(name, "fit")) < 0.2


def run_twice(shaking: np.ndarray) -> tuple[Recording, Recording]:
    """The example's motion with noise of its own in each run, and a shaking (N, 6) in deviations of it in both."""
    fit, generator = shipped("three", "fit"), np.random.default_rng(5)
    frame = fit.frame()
    smooth = frame.rolling(9, center=True, min_periods=1).mean().assign(time=frame["time"])
    runs = []
    for _ in range(2):
        run = smooth.copy()
        for number, name in enumerate(["x", "y", "z", "tension_1", "tension_2", "tension_3"]):
            run[name] += (3e-4 if number < 3 else 2.0) * (generator.normal(size=len(frame)) + shaking[:, number])
        runs.append(recording_from_frame(run, 3))
    return runs[0], runs[1]


def test_the_same_vibration_once_more_is_no_copy() -> None:
    """As where one program runs twice: what repeats is larger than the noise."""
    time = shipped("three", "fit").time
    runs = run_twice(2.3 * np.sin(2.0 * np.pi * np.outer(time, 14.0 + np.arange(6))))
    assert noise_correlation(runs[1], runs[0]) < 0.3


def test_the_same_jolts_once_more_are_no_copy() -> None:
    shaking = np.zeros((len(shipped("three", "fit").time), 6))
    shaking[np.random.default_rng(6).integers(100, len(shaking) - 100, 20)] = 30.0
    runs = run_twice(shaking)
    assert noise_correlation(runs[1], runs[0]) < 0.3


def test_the_same_motion_once_more_has_noise_of_its_own() -> None:
    fit, generator = shipped("three", "fit"), np.random.default_rng(4)
    frame = fit.frame()
    deviations = {"x": 3e-4, "y": 3e-4, "z": 3e-4} | {f"tension_{cable}": 2.0 for cable in (1, 2, 3)}
    again = frame.rolling(9, center=True, min_periods=1).mean().assign(time=frame["time"])
    for name, deviation in deviations.items():
        again[name] += deviation * generator.normal(size=len(frame))
    require_unseen(fit, recording_from_frame(again, 3))
