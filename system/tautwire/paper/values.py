"""Computes the numbers of the ledger from time series."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks
from scipy.signal.windows import hann

from .records import SimulationRecord

Array = NDArray[np.float64]
# Computed values by the ids of the claims, in the claims' units; two numbers are a range.
ClaimValues = dict[str, float | tuple[float, float] | None]

# s, within which turning points of two curves belong together.
TURN_WINDOW = 1.5
DRIFT_POLYNOMIAL_ORDER = 8
MIN_PERIODS = 4.0
ZERO_PADDING_FACTOR = 16


def max_abs(series: Array) -> float:
    """The largest absolute value."""
    return float(np.max(np.abs(series)))


def relative_difference(base: SimulationRecord, other: SimulationRecord, name: str, time: float) -> float:
    """Relative difference of another run's series at a time (s), in % of the base's there."""
    return 100.0 * abs(other.at(name, time) - base.at(name, time)) / abs(base.at(name, time))


@dataclass(frozen=True)
class TurningPoint:
    """A turning point of two curves of one quantity, each at its own time: ``time`` in s is halfway between."""

    time: float
    first: float
    second: float

    @property
    def gap(self) -> float:
        """Difference of the two extremes."""
        return abs(self.first - self.second)


def turning_points(
    first: SimulationRecord, second: SimulationRecord, name: str, prominence: float
) -> list[TurningPoint]:
    """Turning points of a series of at least this prominence (in its unit), by time; the end where there are none.

    A turning point of the second curve is its extreme of the same kind near that of the first.
    """
    time, points = first.time, []
    for sign in (1.0, -1.0):
        for row in find_peaks(sign * first[name], prominence=prominence)[0]:
            nearby = np.flatnonzero(np.abs(time - time[row]) <= TURN_WINDOW)
            other_row = nearby[np.argmax(sign * second[name][nearby])]
            mean_time = 0.5 * float(time[row] + time[other_row])
            points.append(TurningPoint(mean_time, float(first[name][row]), float(second[name][other_row])))
    if not points:
        return [TurningPoint(float(time[-1]), float(first[name][-1]), float(second[name][-1]))]
    return sorted(points, key=lambda point: point.time)


def mean_reduction(before: SimulationRecord, after: SimulationRecord, name: str) -> float:
    """Reduction of the mean absolute value of a series, in %."""
    return 100.0 * (1.0 - float(np.mean(np.abs(after[name])) / np.mean(np.abs(before[name]))))


def dominant_frequency(time: Array, series: Array) -> float:
    """Dominant frequency in Hz of a series (N,) at even times (s): its spectral peak after polynomial detrending.

    Only frequencies with four periods or more in the series count.
    """
    centred = 2.0 * (time - time[0]) / (time[-1] - time[0]) - 1.0
    drift = np.polynomial.chebyshev.chebfit(centred, series, DRIFT_POLYNOMIAL_ORDER)
    detrended = series - np.polynomial.chebyshev.chebval(centred, drift)
    count = ZERO_PADDING_FACTOR * len(detrended)
    spectrum = np.abs(np.fft.rfft(detrended * hann(len(detrended)), count))
    frequency = np.fft.rfftfreq(count, time[1] - time[0])
    spectrum[frequency < MIN_PERIODS / (time[-1] - time[0])] = 0.0
    return float(frequency[np.argmax(spectrum)])


def amplitude(time: Array, series: Array, frequency: float, start: float, end: float) -> float:
    """Least-squares amplitude of an oscillation of known frequency (Hz) between two times (s), on a quadratic drift."""
    inside = (time >= start) & (time <= end)
    phase = 2.0 * np.pi * frequency * time[inside]
    regressors = np.column_stack([np.vander(time[inside] - start, 3), np.cos(phase), np.sin(phase)])
    coefficients = np.linalg.lstsq(regressors, series[inside], rcond=None)[0]
    return float(np.hypot(coefficients[3], coefficients[4]))
