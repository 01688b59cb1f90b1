"""Logs of winches, and trackers with another rate and clock that saw the same motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from tautwire.recordings.recording import Recording
from tautwire.robot.schema import Robot

Array = NDArray[np.float64]
Path = Callable[[Array], Array]


def log_along(robot: Robot, path: Path, duration: float, rate: float = 100.0) -> Recording:
    """The log of inelastic ropes that lead the platform along a path (N,) to (N, 3), without positions."""
    time = np.arange(round(duration * rate) + 1) / rate
    lengths = np.linalg.norm(np.array(robot.anchors) - path(time)[:, None], axis=2)
    missing = np.full((len(time), 3), np.nan)
    speeds = -CubicSpline(time, lengths)(time, 1)
    return Recording("log.csv", time, speeds, np.full_like(speeds, np.nan), missing)


def tracker_along(path: Path, times: Array, offset: float = 0.0, rate: float = 1.0, noise: float = 3e-4) -> Recording:
    """A tracker that samples a path at these times of the log's clock, whose own shows ``offset`` when that shows 0."""
    position = path(times) + noise * np.random.default_rng(5).normal(size=(len(times), 3))
    no_cables = np.zeros((len(times), 0))
    return Recording("tracker.csv", offset + rate * times, no_cables, no_cables, position)


def split(recording: Recording, samples_per_second: float, offset: float, rate: float) -> tuple[Recording, Recording]:
    """A recording as a log without positions, and as the file of a tracker that starts and ends within it."""
    start = recording.time[0]
    times = np.arange(0.0031, recording.duration, 1.0 / samples_per_second)
    tracker = tracker_along(CubicSpline(recording.time - start, recording.position), times, offset, rate, noise=0.0)
    return replace(recording, position=np.full_like(recording.position, np.nan)), tracker
