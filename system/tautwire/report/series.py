"""Long series made small enough for a page, with their peaks kept."""

from __future__ import annotations

import base64
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import welch

Array = NDArray[np.float64]

LONGEST_SEGMENT = 4096
SPECTRUM_POINTS = 240
FEWEST_SAMPLES = 32


@dataclass(frozen=True)
class Spectrum:
    """Amplitude spectral densities of a residual before and after, in the residual's unit per root hertz."""

    frequency: Array
    before: Array
    after: Array


def packed(values: Array) -> str:
    """Numbers as base64 of little-endian float32; whatever is not finite becomes NaN, a gap when drawn."""
    finite = np.where(np.isfinite(values), values, np.nan)
    return base64.b64encode(finite.astype("<f4").tobytes()).decode("ascii")


def unpacked(text: str) -> Array:
    """What :func:`packed` packed, to the precision of float32."""
    return np.frombuffer(base64.b64decode(text), dtype="<f4").astype(np.float64)


def envelope_times(time: Array, points: int) -> Array:
    """The times that :func:`envelope` draws at: two for each group of samples, or all where they are few."""
    if time.size <= points:
        return time
    size = -(-2 * time.size // points)
    starts = np.arange(0, time.size, size)
    middles = np.minimum(starts + size // 2, time.size - 1)
    return np.column_stack((time[starts], time[middles])).ravel()


def envelope(values: Array, points: int) -> Array:
    """Least and largest value of each group of samples, in the order in which they came; NaN is left out."""
    if values.size <= points:
        return values
    size = -(-2 * values.size // points)
    missing = -values.size % size
    groups = np.pad(np.where(np.isfinite(values), values, np.nan), (0, missing), constant_values=np.nan)
    groups = groups.reshape(-1, size)
    lowest, highest = np.where(np.isnan(groups), np.inf, groups), np.where(np.isnan(groups), -np.inf, groups)
    low, high = lowest.min(axis=1), highest.max(axis=1)
    low_first = (lowest.argmin(axis=1) <= highest.argmax(axis=1))[:, None]
    pairs = np.where(low_first, np.column_stack((low, high)), np.column_stack((high, low)))
    return np.where(np.isfinite(pairs), pairs, np.nan).ravel()


def thinned(count: int, points: int) -> NDArray[np.int64]:
    """Indices of at most ``points`` of ``count`` samples, spread evenly, with both ends."""
    return np.unique(np.linspace(0, count - 1, min(count, points)).round().astype(np.int64))


def spectrum(time: Array, before: Array, after: Array) -> Spectrum | None:
    """Welch's spectra of two residuals of one output; None where too little was measured."""
    step = float(np.median(np.diff(time)))
    even = np.arange(time[0], time[-1] + 0.5 * step, step)
    if even.size < FEWEST_SAMPLES:
        return None
    filled = [_filled(time, values, even) for values in (before, after)]
    if filled[0] is None or filled[1] is None:
        return None
    length = min(even.size, LONGEST_SEGMENT, max(256, even.size // 4))
    frequency, power_before = welch(filled[0], fs=1.0 / step, nperseg=length)
    _, power_after = welch(filled[1], fs=1.0 / step, nperseg=length)
    return _thinned_spectrum(frequency[1:], power_before[1:], power_after[1:])


def noise_density(sigma: float, time: Array) -> float:
    """The amplitude spectral density of white noise of standard deviation ``sigma``, sampled at ``time``."""
    return float(sigma * np.sqrt(2.0 * np.median(np.diff(time))))


def _filled(time: Array, values: Array, even: Array) -> Array | None:
    """Values at even times, straight across gaps; None where most of them are missing."""
    known = np.isfinite(values)
    if known.sum() < max(FEWEST_SAMPLES, values.size // 2):
        return None
    return np.interp(even, time[known], values[known])


def _thinned_spectrum(frequency: Array, before: Array, after: Array) -> Spectrum:
    """Powers averaged over frequencies that lie close together on a logarithmic axis, as amplitudes."""
    edges = np.geomspace(frequency[0], frequency[-1], SPECTRUM_POINTS)
    starts = np.unique(np.searchsorted(frequency, edges * (1.0 - 1e-9)))
    counts = np.diff(np.append(starts, frequency.size))
    averaged = [np.add.reduceat(values, starts) / counts for values in (frequency, before, after)]
    return Spectrum(averaged[0], np.sqrt(averaged[1]), np.sqrt(averaged[2]))
