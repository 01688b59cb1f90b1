"""Smoothing splines through recorded rope lengths: the winch speeds, and the error of length that is left.

Each cable's spline l minimises, with the penalty lambda,

    sum_k (L_k - l(t_k))^2 + lambda integral of l''^2 dt

Of white noise with variance s^2 in the recorded lengths L, sampled every h seconds, it passes the share H of an
amplitude with the angular frequency w. The penalty is that of the least unbiased risk R (Mallows' C_L); what noise
leaves has the variance s_l^2 and, as its spectrum at zero tells, the bandwidth f of an Ornstein-Uhlenbeck process:

    H(w) = 1 / (1 + lambda h w^4)        R = mean_k (L_k - l(t_k))^2 + 2 s^2 mean_w H
    s_l^2 = s^2 mean_w H^2               f = mean_w H^2 / (pi h)

Source: Wahba (1990), Spline Models for Observational Data, ch. 4; Silverman (1984), Annals of Statistics 12(3),
898-916.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log10, pi

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_smoothing_spline
from scipy.optimize import minimize_scalar

from .recording import Recording
from .white_noise_estimate import quantization_step, white_noise_deviation

Array = NDArray[np.float64]

# Lengths closer than this (m) are the same count, written with a rounding error.
MIN_RESOLUTION = 1e-9
# Samples by which a penalty is chosen, those with the most travel; and angular frequencies of which means are taken.
MAX_SAMPLES, FREQUENCY_COUNT = 10_000, 2_001
# Shortest period of a motion that is passed, in samples, and the longest in s; and the tolerance of a penalty's decade.
MIN_PERIOD_SAMPLES, MAX_PERIOD, DECADE_TOLERANCE = 2.0, 10.0, 0.1
# A cubic spline's smoothing needs as many.
MIN_SAMPLES = 5


@dataclass(frozen=True)
class LengthSmoothing:
    """Smoothing of a cable's length: its ``penalty`` (s^3), and the ``rms`` (m) and ``bandwidth`` (Hz) of its error."""

    penalty: float
    rms: float
    bandwidth: float


def length_smoothing(recording: Recording) -> tuple[LengthSmoothing | None, ...]:
    """Smoothing of each cable's recorded length; None where none was recorded, or nothing can be smoothed."""
    lengths, cables = recording.rope_length, range(1, recording.cable_count + 1)
    if lengths is None or recording.sample_count < MIN_SAMPLES:
        return (None,) * recording.cable_count
    return tuple(
        _smoothing(*_liveliest_part(recording.time, lengths[:, cable - 1])) if cable in recording.rope_lengths else None
        for cable in cables
    )


def with_smoothed_lengths(recording: Recording, smoothing: Sequence[LengthSmoothing | None]) -> Recording:
    """The recording with winch speeds that, linear between samples, move the ropes as the splines do."""
    if recording.rope_length is None:
        return recording
    speeds = recording.winch_speed.copy()
    for index, each in enumerate(smoothing):
        if each is not None and np.isfinite(recording.rope_length[:, index]).all():
            time = recording.time - recording.time[0]
            spline = make_smoothing_spline(time, recording.rope_length[:, index], lam=each.penalty)
            speeds[:, index] = _trapezoidal(time, -spline(time), -spline.derivative()(time))
    return replace(recording, winch_speed=speeds)


def _liveliest_part(time: Array, lengths: Array) -> tuple[Array, Array]:
    """Times from zero on and lengths of the stretch with the most travel: a winch that stands asks for no speed."""
    stretches = np.array_split(np.arange(len(time)), -(-len(time) // MAX_SAMPLES))
    rows = max(stretches, key=lambda rows: float(np.sum(np.abs(np.diff(lengths[rows])))))
    return time[rows] - time[rows[0]], lengths[rows]


def _smoothing(time: Array, lengths: Array) -> LengthSmoothing | None:
    deviation = length_noise(lengths)
    if deviation == 0.0:
        return None
    interval = float(np.median(np.diff(time)))
    frequency = np.linspace(0.0, pi / interval, FREQUENCY_COUNT)

    def passed(penalty: float) -> Array:
        share: Array = 1.0 / (1.0 + penalty * interval * frequency**4)
        return share

    def risk(decade: float) -> float:
        penalty = 10.0**decade
        residual = lengths - make_smoothing_spline(time, lengths, lam=penalty)(time)
        return float(np.mean(residual**2) + 2.0 * deviation**2 * np.mean(passed(penalty)))

    periods = (MIN_PERIOD_SAMPLES * interval, MAX_PERIOD)
    shortest, longest = (log10((period / (2.0 * pi)) ** 4 / interval) for period in periods)
    best = minimize_scalar(risk, bounds=(shortest, longest), method="bounded", options={"xatol": DECADE_TOLERANCE})
    penalty = 10.0 ** float(best.x)
    mean_square = float(np.mean(passed(penalty) ** 2))
    return LengthSmoothing(penalty, deviation * mean_square**0.5, mean_square / (pi * interval))


def length_noise(lengths: Array) -> float:
    """Standard deviation (m) of a recorded length (N,): that of a count's rounding, or of white noise where larger."""
    if np.ptp(lengths) <= MIN_RESOLUTION:
        return 0.0
    return max(quantization_step(lengths) / 12.0**0.5, white_noise_deviation(lengths[:, None]))


def _trapezoidal(time: Array, lengths: Array, rates: Array) -> Array:
    """Values at times (N,) whose trapezoidal sums are the lengths (N,) less the first, by the rates (N,) of these.

    What the rates' own sum errs in a step is taken back at both of its ends, and of all steps as a whole.
    """
    steps = np.diff(time)
    errors = 0.5 * steps * (rates[1:] + rates[:-1]) - np.diff(lengths)
    of_neighbours = np.append(errors, 0.0) + np.append(0.0, errors)
    corrected: Array = rates - of_neighbours / (np.append(steps, 0.0) + np.append(0.0, steps))
    return corrected
