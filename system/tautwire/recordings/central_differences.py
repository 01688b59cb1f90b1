"""Winch speeds that are central differences of an encoder's counts, taken back to the speeds between samples.

With rope travel l and the sample interval h a log has ``v_k = (l_{k+1} - l_{k-1}) / 2h``. Taken as linear between
samples these move the rope by the mean of three steps: a motion of angle theta a sample shrinks to ``cos^2(theta/2)``.
Speeds w that move it as it was follow by a geometric series, with the second difference ``D``:

    (w_{k-1} + 2 w_k + w_{k+1}) / 4 = v_k        w = (1 - D/4 + D^2/16) v        D v_k = v_{k-1} - 2 v_k + v_{k+1}

The whole series would have an infinite gain where noise alternates from sample to sample.

Source: Hamming (1989), Digital Filters, 3rd ed., on transfer functions of smoothing and of difference formulas.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .recording import Recording

Array = NDArray[np.float64]

SERIES_ORDER = 2
# Share of different values among a moving winch's: 0.35 to 0.94 with an encoder's counts, 1.0 with analogue noise.
MAX_DISTINCT_SHARE = 0.95
# In medians of the sample interval: across a longer step differences say nothing.
MAX_STEP_TO_MEDIAN = 1.5


def may_be_central_differences(recording: Recording) -> bool:
    """Whether the winch speeds may be differences of counts: rates of rope lengths, or few different values."""
    if recording.rope_lengths:
        return True
    moving = [column[column != 0.0] for column in recording.winch_speed.T]
    return any(len(each) > 0 and len(np.unique(each)) <= MAX_DISTINCT_SHARE * len(each) for each in moving)


def with_speeds_between_samples(recording: Recording) -> Recording:
    """The recording with winch speeds whose central differences are the recorded ones, see the module."""
    steps = np.diff(recording.time)
    is_regular = steps <= MAX_STEP_TO_MEDIAN * np.median(steps)
    has_neighbours = np.zeros(recording.sample_count, dtype=bool)
    has_neighbours[1:-1] = is_regular[1:] & is_regular[:-1]
    speeds = term = recording.winch_speed
    for _ in range(SERIES_ORDER):
        term = -0.25 * _second_difference(term, has_neighbours)
        speeds = speeds + term
    return recording.with_winch_speed(speeds)


def _second_difference(values: Array, has_neighbours: NDArray[np.bool_]) -> Array:
    """Second difference of each column (N, n); zero where a sample has no neighbours."""
    difference = np.zeros_like(values)
    difference[1:-1] = values[:-2] - 2.0 * values[1:-1] + values[2:]
    return np.where(has_neighbours[:, None], difference, 0.0)
