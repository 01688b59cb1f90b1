"""Spectral analysis of residuals: lines in the innovations, and resonance peaks of a residual force."""

from __future__ import annotations

from math import log

import numpy as np
from numpy.typing import NDArray
from scipy.signal import detrend, find_peaks, peak_prominences, welch

from .discovery.policy import SpectralLinePolicy
from .innovations import Innovations
from .localisation.policy import ResonancePeakPolicy
from .policy import DEFAULT_POLICY

Array = NDArray[np.float64]

# Zero padding, so that a line between two frequencies is not missed.
ZERO_PADDING_FACTOR = 4
FLOOR_HALF_WINDOW = 80


def spectral_lines(
    time: Array,
    innovations: Innovations,
    rows: NDArray[np.bool_],
    policy: SpectralLinePolicy = DEFAULT_POLICY.discovery.spectral_lines,
) -> list[float]:
    """Angular frequencies (rad/s) of the strongest lines in the innovations, strongest first."""
    frequency, power = _power_spectrum(time[rows], innovations.values[rows], innovations.observed[rows])
    floor = np.array(
        [np.median(power[max(0, k - FLOOR_HALF_WINDOW) : k + FLOOR_HALF_WINDOW]) for k in range(len(power))]
    )
    ratio = power / np.maximum(floor, np.finfo(float).tiny)
    peaks, _ = find_peaks(ratio, height=policy.min_power_ratio, distance=2 * ZERO_PADDING_FACTOR)
    strongest = sorted(peaks, key=lambda index: -power[index])[: policy.max_count]
    return [2.0 * np.pi * float(frequency[index]) for index in strongest]


def _power_spectrum(time: Array, values: Array, observed: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Frequencies (Hz) and power summed over the outputs, of samples taken as evenly spaced."""
    step = float(np.median(np.diff(time)))
    filled = np.where(observed, np.nan_to_num(values), 0.0)
    windowed = (filled - np.mean(filled, axis=0)) * np.hanning(len(filled))[:, None]
    power: Array = np.sum(np.abs(np.fft.rfft(windowed, ZERO_PADDING_FACTOR * len(filled), axis=0)) ** 2, axis=1)
    frequency: Array = np.asarray(np.fft.rfftfreq(ZERO_PADDING_FACTOR * len(filled), step), dtype=float)
    return frequency, power


WELCH_SEGMENTS = 3
MIN_SAMPLES, MIN_FREQUENCIES = 64, 5


def resonance_frequency(
    time: Array,
    residual: Array,
    acceleration: Array,
    cutoff: float,
    policy: ResonancePeakPolicy = DEFAULT_POLICY.localisation.resonance_peaks,
) -> float | None:
    """Resonance frequency (Hz) of a residual force (N,) below ``cutoff`` (rad/s); None where there is none.

    The ratio of its power spectral density to that of the acceleration (N,) along it is that of a mass squared where
    a weight is wrong, falls steadily for a damping force, and has a peak for an attached oscillator.
    """
    is_finite = np.isfinite(residual)
    if np.sum(is_finite) < MIN_SAMPLES:
        return None
    step = float(np.median(np.diff(time)))
    uniform_time = np.arange(time[is_finite][0], time[is_finite][-1], step)
    length = 2 * len(uniform_time) // (WELCH_SEGMENTS + 1)
    spectra = [
        welch(detrend(np.interp(uniform_time, time[is_finite], values[is_finite])), 1.0 / step, nperseg=length)
        for values in (residual, acceleration)
    ]
    frequency = np.asarray(spectra[0][0], dtype=float)
    is_below_cutoff = (frequency > 0.0) & (2.0 * np.pi * frequency < cutoff)
    frequency, (residual_power, motion_power) = (
        frequency[is_below_cutoff],
        (np.asarray(power, dtype=float)[is_below_cutoff] for _, power in spectra),
    )
    if len(frequency) < MIN_FREQUENCIES or not (np.all(residual_power > 0.0) and np.all(motion_power > 0.0)):
        return None
    ratio = np.log(residual_power / motion_power)
    peaks = find_peaks(ratio, prominence=log(policy.min_prominence))[0]
    for peak in peaks[np.argsort(-peak_prominences(ratio, peaks)[0])]:
        half_width = max(policy.half_width_ratio * frequency[peak], 1.5 * frequency[0])
        is_in_peak = np.abs(frequency - frequency[peak]) <= half_width
        peak_power = np.sum(residual_power[is_in_peak])
        if peak_power > policy.min_power_ratio * np.sum(residual_power):
            return float(np.sum(frequency[is_in_peak] * residual_power[is_in_peak]) / peak_power)
    return None
