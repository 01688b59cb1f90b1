"""A tracker's positions tell scales of a log's columns whatever the clocks, where one offset fits."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from tautwire import read_robot
from tautwire.recordings.tracked_rows import scales_by_tracker
from tests.support.robots import EXAMPLES

Array = NDArray[np.float64]
ROBOT = read_robot(EXAMPLES / "three" / "robot.toml")
SCALES = np.array([2e-5, -3e-5, 1e-5])
LOG = np.arange(0.0, 20.0, 0.01)
OFFSET = 137.4567


def motion(time: Array) -> Array:
    """Positions (N, 3) in m of a motion from rest to rest that repeats nothing."""
    window = np.where((time > 1.0) & (time < 19.0), np.sin(np.pi * (time - 1.0) / 18.0) ** 2, 0.0)
    time = np.maximum(time, 0.0)
    waves = np.column_stack([np.sin(0.9 * time), np.cos(0.31 * time**1.3), np.sin(0.17 * time**1.4)])
    return np.array(ROBOT.platform.start) + window[:, None] * waves


def lengths(position: Array) -> Array:
    return np.linalg.norm(np.array(ROBOT.anchors) - position[:, None], axis=2)


def tracked(begin: float, end: float, noise: float = 1e-4) -> tuple[Array, Array]:
    times = np.arange(begin, end, 1.0 / 60.0)
    places = motion(times) + noise * np.random.default_rng(1).standard_normal((len(times), 3))
    return times + OFFSET, lengths(places)


@pytest.mark.parametrize("span", [(0.0, 20.0), (-3.0, 24.0), (4.0, 20.0)], ids=["together", "longer", "later"])
def test_scales_are_told_at_any_offset_of_the_clock(span: tuple[float, float]) -> None:
    counts = np.round(lengths(motion(LOG)) / SCALES).T
    known = scales_by_tracker(LOG, list(counts), tracked(*span), [0, 1, 2])
    assert known is not None and known.scales == pytest.approx(SCALES, rel=1e-3)
    order = [2, 0, 1]
    others = [np.sin(LOG), np.where(LOG[1003] == LOG, 1.0, 0.0)]
    told = scales_by_tracker(LOG, [*counts[order], *others], tracked(*span), None)
    assert told is not None and told.cables.tolist() == [*order, -1, -1]
    assert told.scales[:3] == pytest.approx(SCALES[order], rel=1e-3)


def test_gaps_of_the_tracker_are_not_bridged() -> None:
    times, by_tracker = tracked(0.0, 20.0)
    by_tracker[300:600] = np.nan
    counts = lengths(motion(LOG)).T / SCALES[:, None]
    told = scales_by_tracker(LOG, list(counts), (times, by_tracker), [0, 1, 2])
    assert told is not None and told.scales == pytest.approx(SCALES, rel=1e-3)


def test_a_tracker_of_few_samples_a_second_tells_scales_too() -> None:
    times = np.arange(0.0, 20.0, 0.25)
    counts = lengths(motion(LOG)).T / SCALES[:, None]
    told = scales_by_tracker(LOG, list(counts), (times + OFFSET, lengths(motion(times))), [0, 1, 2])
    assert told is not None and told.scales == pytest.approx(SCALES, rel=5e-3)


@pytest.mark.parametrize("case", ["another motion", "at rest", "a motion that fits with both signs", "no tracker"])
def test_what_the_tracker_leaves_open_is_not_told(case: str) -> None:
    counts, tracker = list(lengths(motion(LOG)).T / SCALES[:, None]), tracked(0.0, 20.0)
    if case == "another motion":
        counts = list(lengths(motion(20.0 - LOG)[:, [1, 2, 0]]).T)
    elif case == "at rest":
        counts = [np.zeros_like(LOG)] * 3
    elif case == "no tracker":
        tracker = (np.zeros(0), np.zeros((0, 3)))
    else:
        start, direction = np.array(ROBOT.platform.start), np.array([0.01, 0.0, 0.0])
        counts = list(lengths(start + np.sin(2.0 * LOG)[:, None] * direction).T)
        times = np.arange(0.0, 60.0, 0.02)
        tracker = (times, lengths(start + np.sin(2.0 * times)[:, None] * direction))
    assert scales_by_tracker(LOG, counts, tracker, [0, 1, 2]) is None
