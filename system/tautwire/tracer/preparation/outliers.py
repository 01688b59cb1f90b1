"""Single samples that jump by many sigma and come back: no robot does that, so they are taken out and counted."""

from __future__ import annotations

from dataclasses import replace
from math import sqrt

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from ...errors import RecordingError
from ...recordings.recording import Recording
from ...recordings.roughness import DIFFERENCES, RESOLUTION, roughness

Array = NDArray[np.float64]

SIGMAS = 25.0
# A sensor that shows fewer than this share of the samples is less smooth from one to the next.
SPARSE, MORE = 0.5, 1.5
# What of a jump may look otherwise than one sample that is off, as a share of its square: a step leaves 0.08, a kink
# 0.02.
OTHERWISE = 0.013
# Samples about one that tell how rough the signal is there; at the ends, that tell where it should be.
AROUND, AT_ENDS = 25, 10
# At the ends, the most that a neighbour is off too.
COMES_BACK = 0.25
MOST = 0.01
FEW = 3
NORMAL_MEDIAN = 0.6745
REACH = DIFFERENCES // 2
# What six differences make of one sample that is off by one, over the difference in its middle.
PATTERN = np.array([-1.0, 6.0, -15.0, 20.0, -15.0, 6.0, -1.0]) / 20.0


def without_outliers(recording: Recording) -> tuple[Recording, tuple[str, ...]]:
    """The recording with such samples of the outputs as empty cells, and those of winch speeds interpolated; a note.

    Raises RecordingError where more than 1 % of a channel's samples do so.
    """
    measured, winch_speed = recording.measured(), recording.winch_speed.copy()
    counts: dict[str, int] = {}
    names = (*recording.channel_names, *(f"winch_speed_{cable + 1}" for cable in range(recording.cable_count)))
    for name, column in zip(names, (*measured.T, *winch_speed.T), strict=True):
        there = np.flatnonzero(np.isfinite(column))
        found = there[outliers(column[there], SIGMAS * (MORE if len(there) < SPARSE * len(column) else 1.0))]
        if not len(found):
            continue
        if len(found) > max(MOST * len(there), FEW):
            problem = f"jumps and comes back in {len(found)} of {len(there)} samples, more than 1 %"
            mend = "mend the sensor, or leave the column out"
            raise RecordingError(f"{recording.path}: column {name}", problem, mend)
        counts[name] = len(found)
        column[found] = np.nan
    if not counts:
        return recording, ()
    for column in winch_speed.T:
        lost = ~np.isfinite(column)
        column[lost] = np.interp(recording.time[lost], recording.time[~lost], column[~lost])
    said = ", ".join(f"{count} of {name}" for name, count in counts.items())
    note = f"{recording.path}: samples that jump by more than {SIGMAS:g} sigma and come back are taken out: {said}"
    cleaned = replace(recording, position=measured[:, :3], tension=measured[:, 3:], winch_speed=winch_speed)
    return cleaned, (note,)


def outliers(signal: Array, sigmas: float = SIGMAS) -> NDArray[np.intp]:
    """Places of single samples that are off, in a signal (N,) without gaps.

    Each sample is held against the polynomial of degree five through its six neighbours,
    ``r_k = (y_(k-3) - 6 y_(k-2) + 15 y_(k-1) - 20 y_k + ...) / -20``; one that is off leaves a known pattern in ``r``.
    """
    found: list[int] = []
    kept = signal.copy()
    if len(signal) < 4 * AT_ENDS:
        return np.array(found, dtype=np.intp)
    sigma = roughness(signal[:, None])
    found += _at_ends(kept, sigma, sigmas)
    kept[found] = np.interp(found, np.delete(np.arange(len(kept)), found), np.delete(kept, found))
    while True:
        places = _single(kept, sigma, sigmas)
        if not len(places) or len(found) > MOST * len(signal) + FEW:
            return np.array(sorted({*found, *places.tolist()}), dtype=np.intp)
        found += places.tolist()
        others = np.setdiff1d(np.arange(len(kept)), found)
        kept[found] = np.interp(found, others, kept[others])


def _single(signal: Array, sigma: float, sigmas: float) -> NDArray[np.intp]:
    """Those that stand alone, strongest of their neighbourhood first."""
    left = np.convolve(signal, PATTERN, mode="valid")
    windows = sliding_window_view(left, len(PATTERN))
    weight = float(PATTERN @ PATTERN)
    size = windows @ PATTERN / weight
    rest = np.sum((windows - size[:, None] * PATTERN) ** 2, axis=1)
    usual = sigma * sqrt(weight)
    rough = np.maximum(_rougher_side(np.abs(left)) / NORMAL_MEDIAN, usual)[REACH:-REACH]
    whole = np.sum(windows**2, axis=1)
    peak = np.abs(size) >= np.max(np.abs(sliding_window_view(np.pad(size, REACH), len(PATTERN))), axis=1)
    stands = (np.abs(size) > sigmas * rough / sqrt(weight)) & (rest < OTHERWISE * whole) & peak
    return np.flatnonzero(stands) + 2 * REACH


def _rougher_side(values: Array) -> Array:
    """The larger of the medians before and after each value: where motion begins or ends one side is quiet."""
    sides = (median_filter(values, 2 * AROUND + 1, mode="mirror", origin=side) for side in (-AROUND, AROUND))
    rougher: Array = np.maximum(*sides)
    return rougher


def _at_ends(signal: Array, sigma: float, sigmas: float) -> list[int]:
    """Those among the first and last six samples, where the neighbours on one side are missing."""
    found = []
    for first in (0, len(signal) - AT_ENDS):
        near = signal[first : first + AT_ENDS]
        away = np.abs(near - np.median(near))
        spread = max(float(np.median(away)) / NORMAL_MEDIAN, sigma, RESOLUTION * float(np.max(np.abs(signal))))
        outer = range(2 * REACH) if first == 0 else range(AT_ENDS - 2 * REACH, AT_ENDS)
        beside = np.maximum(np.append(away[1:], 0.0), np.append(0.0, away[:-1]))
        alone = (away > sigmas * spread) & (beside < COMES_BACK * away)
        found += [first + place for place in outer if alone[place]]
    return found
