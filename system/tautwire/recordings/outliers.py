"""Outlier removal: single samples that jump by many sigma and come back, which no robot does."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import sqrt

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from ..errors import RecordingError
from ..robot.schema import QUATERNION_COLUMNS
from .recording import Recording
from .white_noise_estimate import DIFFERENCE_ORDER, NORMAL_ABSOLUTE_MEDIAN, RELATIVE_RESOLUTION, white_noise_deviation

Array = NDArray[np.float64]

# Samples on each side that give the local noise; samples at the ends that give the local median.
HALF_WINDOW_SAMPLES, END_SAMPLES = 25, 10
PATTERN_REACH = DIFFERENCE_ORDER // 2
# Sixth difference of a unit impulse, over its value in the middle.
OUTLIER_PATTERN = np.array([-1.0, 6.0, -15.0, 20.0, -15.0, 6.0, -1.0]) / 20.0


@dataclass(frozen=True)
class OutlierPolicy:
    """When a sample counts as an outlier, and how many of them a channel may have."""

    # Standard deviations of local noise: jolts of the robot stay below, losses of a tracker are far above.
    # Chosen, not calibrated.
    sigmas: float = 25.0
    # A sensor with values in fewer than this share of the samples is less smooth, so its threshold is larger by the
    # factor. Chosen, not calibrated.
    sparse_ratio: float = 0.5
    sparse_factor: float = 1.5
    # Largest mismatch with the pattern of a single outlier, as a share of its energy: a step leaves 0.08, a kink 0.02.
    max_pattern_mismatch: float = 0.013
    # At the ends, largest deviation of a neighbour relative to the outlier's. Chosen, not calibrated.
    max_neighbour_ratio: float = 0.25
    # Share of a channel's samples, beside a few: with more the sensor is not to be trusted. Chosen, not calibrated.
    max_ratio: float = 0.01
    allowed_count: int = 3


DEFAULT_OUTLIER_POLICY = OutlierPolicy()


def without_outliers(
    recording: Recording, policy: OutlierPolicy = DEFAULT_OUTLIER_POLICY
) -> tuple[Recording, tuple[str, ...]]:
    """The recording with outliers of outputs emptied and those of winch speeds interpolated, and a note.

    A quaternion with an outlier in any of its numbers is one. Raises RecordingError where more than 1 % of a channel's
    samples are outliers.
    """
    measured, winch_speed = recording.measured(), recording.winch_speed.copy()
    counts: dict[str, int] = {}
    names = (*recording.channel_names, *(f"winch_speed_{cable + 1}" for cable in range(recording.cable_count)))
    orientation = recording.orientation.copy()
    channels = {name: column[:, None] for name, column in zip(names, (*measured.T, *winch_speed.T), strict=True)}
    for name, columns in (channels | {", ".join(QUATERNION_COLUMNS): orientation}).items():
        outlier_rows = _outlier_rows(columns, policy, f"{recording.path}: column {name}")
        if len(outlier_rows):
            counts[name] = len(outlier_rows)
            columns[outlier_rows] = np.nan
    if not counts:
        return recording, ()
    for column in winch_speed.T:
        is_missing = ~np.isfinite(column)
        column[is_missing] = np.interp(recording.time[is_missing], recording.time[~is_missing], column[~is_missing])
    description = ", ".join(f"{count} of {name}" for name, count in counts.items())
    note = f"{recording.path}: outliers beyond {policy.sigmas:g} sigma removed: {description}"
    cleaned = replace(recording, position=measured[:, :3], tension=measured[:, 3:], orientation=orientation)
    return cleaned.with_winch_speed(winch_speed), (note,)


def _outlier_rows(columns: Array, policy: OutlierPolicy, where: str) -> NDArray[np.intp]:
    """Rows of a channel's columns (N, k) with an outlier in any; raises RecordingError where there are too many."""
    measured_rows = np.flatnonzero(np.isfinite(columns).all(axis=1))
    is_sparse = len(measured_rows) < policy.sparse_ratio * len(columns)
    channel_policy = replace(policy, sigmas=policy.sigmas * policy.sparse_factor) if is_sparse else policy
    indices = [outlier_indices(column[measured_rows], channel_policy) for column in columns.T]
    outlier_rows = measured_rows[np.unique(np.concatenate(indices))]
    if len(outlier_rows) > max(policy.max_ratio * len(measured_rows), policy.allowed_count):
        problem = f"has outliers in {len(outlier_rows)} of {len(measured_rows)} samples, more than 1 %"
        raise RecordingError(where, problem, "repair the sensor, or omit the column")
    return outlier_rows


def outlier_indices(signal: Array, policy: OutlierPolicy = DEFAULT_OUTLIER_POLICY) -> NDArray[np.intp]:
    """Indices of single-sample outliers in a signal (N,) without gaps.

    Each sample is compared with the polynomial of degree five through its six neighbours,
    ``r_k = (y_(k-3) - 6 y_(k-2) + 15 y_(k-1) - 20 y_k + ...) / -20``; an outlier leaves a known pattern in ``r``.
    """
    indices: list[int] = []
    cleaned = signal.copy()
    if len(signal) < 4 * END_SAMPLES:
        return np.array(indices, dtype=np.intp)
    sigma = white_noise_deviation(signal[:, None])
    indices += _end_outliers(cleaned, sigma, policy)
    cleaned[indices] = np.interp(indices, np.delete(np.arange(len(cleaned)), indices), np.delete(cleaned, indices))
    while True:
        new_indices = _interior_outliers(cleaned, sigma, policy)
        if not len(new_indices) or len(indices) > policy.max_ratio * len(signal) + policy.allowed_count:
            return np.array(sorted({*indices, *new_indices.tolist()}), dtype=np.intp)
        indices += new_indices.tolist()
        inliers = np.setdiff1d(np.arange(len(cleaned)), indices)
        cleaned[indices] = np.interp(indices, inliers, cleaned[inliers])


def _interior_outliers(signal: Array, sigma: float, policy: OutlierPolicy) -> NDArray[np.intp]:
    """Indices of interior outliers, each the strongest of its neighbourhood."""
    residual = np.convolve(signal, OUTLIER_PATTERN, mode="valid")
    windows = sliding_window_view(residual, len(OUTLIER_PATTERN))
    pattern_energy = float(OUTLIER_PATTERN @ OUTLIER_PATTERN)
    amplitude = windows @ OUTLIER_PATTERN / pattern_energy
    mismatch = np.sum((windows - amplitude[:, None] * OUTLIER_PATTERN) ** 2, axis=1)
    noise_level = sigma * sqrt(pattern_energy)
    local_noise = np.maximum(_noisier_side(np.abs(residual)) / NORMAL_ABSOLUTE_MEDIAN, noise_level)
    local_noise = local_noise[PATTERN_REACH:-PATTERN_REACH]
    energy = np.sum(windows**2, axis=1)
    is_peak = np.abs(amplitude) >= np.max(
        np.abs(sliding_window_view(np.pad(amplitude, PATTERN_REACH), len(OUTLIER_PATTERN))), axis=1
    )
    is_outlier = (
        (np.abs(amplitude) > policy.sigmas * local_noise / sqrt(pattern_energy))
        & (mismatch < policy.max_pattern_mismatch * energy)
        & is_peak
    )
    return np.flatnonzero(is_outlier) + 2 * PATTERN_REACH


def _noisier_side(values: Array) -> Array:
    """Larger of the running medians before and after each value: where motion begins or ends one side is quiet."""
    sides = (
        median_filter(values, 2 * HALF_WINDOW_SAMPLES + 1, mode="mirror", origin=side)
        for side in (-HALF_WINDOW_SAMPLES, HALF_WINDOW_SAMPLES)
    )
    larger: Array = np.maximum(*sides)
    return larger


def _end_outliers(signal: Array, sigma: float, policy: OutlierPolicy) -> list[int]:
    """Indices of outliers among the first and last six samples, where neighbours on one side are missing."""
    indices = []
    for first in (0, len(signal) - END_SAMPLES):
        window = signal[first : first + END_SAMPLES]
        distance = np.abs(window - np.median(window))
        spread = max(
            float(np.median(distance)) / NORMAL_ABSOLUTE_MEDIAN,
            sigma,
            RELATIVE_RESOLUTION * float(np.max(np.abs(signal))),
        )
        outer = range(2 * PATTERN_REACH) if first == 0 else range(END_SAMPLES - 2 * PATTERN_REACH, END_SAMPLES)
        neighbour_distance = np.maximum(np.append(distance[1:], 0.0), np.append(0.0, distance[:-1]))
        is_outlier = (distance > policy.sigmas * spread) & (neighbour_distance < policy.max_neighbour_ratio * distance)
        indices += [first + index for index in outer if is_outlier[index]]
    return indices
