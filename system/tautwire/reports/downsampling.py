"""Downsampling of long series for figures with their peaks kept, and the spectra of residuals."""

from __future__ import annotations

import base64
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

Array = NDArray[np.float64]

MAX_WELCH_SEGMENT = 4096
MAX_SPECTRUM_POINTS = 240
MIN_SAMPLES = 32


@dataclass(frozen=True)
class ResidualSpectra:
    """Amplitude spectral densities of a residual before and after, in the residual's unit per root hertz."""

    frequency: Array
    before: Array
    after: Array


def pack_float32(values: Array) -> str:
    """Packs numbers as base64 of little-endian float32; what is not finite becomes NaN, a gap in the curve."""
    finite = np.where(np.isfinite(values), values, np.nan)
    return base64.b64encode(finite.astype("<f4").tobytes()).decode("ascii")


def unpack_float32(text: str) -> Array:
    """The inverse of :func:`pack_float32`, to the precision of float32."""
    return np.frombuffer(base64.b64decode(text), dtype="<f4").astype(np.float64)


def envelope_times(time: Array, max_points: int) -> Array:
    """The times of :func:`min_max_envelope`: two for each group of samples, or all where they are few."""
    if time.size <= max_points:
        return time
    group_size = -(-2 * time.size // max_points)
    starts = np.arange(0, time.size, group_size)
    middles = np.minimum(starts + group_size // 2, time.size - 1)
    return np.column_stack((time[starts], time[middles])).ravel()


def min_max_envelope(values: Array, max_points: int) -> Array:
    """Min-max decimation: minimum and maximum of each group of samples, in order of time; NaN is ignored."""
    if values.size <= max_points:
        return values
    group_size = -(-2 * values.size // max_points)
    padding = -values.size % group_size
    groups = np.pad(np.where(np.isfinite(values), values, np.nan), (0, padding), constant_values=np.nan)
    groups = groups.reshape(-1, group_size)
    lowest, highest = np.where(np.isnan(groups), np.inf, groups), np.where(np.isnan(groups), -np.inf, groups)
    low, high = lowest.min(axis=1), highest.max(axis=1)
    low_first = (lowest.argmin(axis=1) <= highest.argmax(axis=1))[:, None]
    pairs = np.where(low_first, np.column_stack((low, high)), np.column_stack((high, low)))
    return np.where(np.isfinite(pairs), pairs, np.nan).ravel()


def evenly_spaced_indices(count: int, max_points: int) -> NDArray[np.int64]:
    """Indices of at most ``max_points`` of ``count`` samples, spread evenly, with both ends."""
    return np.unique(np.linspace(0, count - 1, min(count, max_points)).round().astype(np.int64))


def residual_spectra(time: Array, before: Array, after: Array) -> ResidualSpectra | None:
    """Spectra of two residuals of one output by Welch's method, at the rate of the samples that were measured.

    None where these are too few, or more than half are missing between them.
    """
    is_measured = np.isfinite(before) & np.isfinite(after)
    measured_times = time[is_measured]
    if measured_times.size < MIN_SAMPLES:
        return None
    step = float(np.median(np.diff(measured_times)))
    if measured_times.size < (measured_times[-1] - measured_times[0]) / (2.0 * step):
        return None
    even_times = np.arange(measured_times[0], measured_times[-1] + 0.5 * step, step)
    # Linear across gaps.
    resampled = [np.interp(even_times, measured_times, values[is_measured]) for values in (before, after)]
    segment_length = min(even_times.size, MAX_WELCH_SEGMENT, max(256, even_times.size // 4))
    frequency, power_before = welch(resampled[0], fs=1.0 / step, nperseg=segment_length)
    _, power_after = welch(resampled[1], fs=1.0 / step, nperseg=segment_length)
    return _average_on_log_axis(frequency[1:], power_before[1:], power_after[1:])


def white_noise_density(sigma: float, time: Array) -> float:
    """The amplitude spectral density of white noise of standard deviation ``sigma``, sampled at ``time``."""
    return float(sigma * np.sqrt(2.0 * np.median(np.diff(time))))


def _average_on_log_axis(frequency: Array, before: Array, after: Array) -> ResidualSpectra:
    """Averages power spectral densities over logarithmically spaced bands; returns amplitude densities."""
    edges = np.geomspace(frequency[0], frequency[-1], MAX_SPECTRUM_POINTS)
    starts = np.unique(np.searchsorted(frequency, edges * (1.0 - 1e-9)))
    counts = np.diff(np.append(starts, frequency.size))
    averaged = [np.add.reduceat(values, starts) / counts for values in (frequency, before, after)]
    return ResidualSpectra(averaged[0], np.sqrt(averaged[1]), np.sqrt(averaged[2]))
