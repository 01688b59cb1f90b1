"""Plain functions from series to the numbers of the ledger."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks
from scipy.signal.windows import hann

from .records import Record

Array = NDArray[np.float64]
# By the ids of the claims; two numbers are a range. Units are the claims'.
Values = dict[str, float | tuple[float, float] | None]

# s, within which two curves turn together.
NEAR = 1.5
DRIFT_ORDER = 8
FEWEST_PERIODS = 4.0
PADDING = 16


def largest(series: Array) -> float:
    """The largest absolute value."""
    return float(np.max(np.abs(series)))


def relative_difference(base: Record, other: Record, name: str, moment: float) -> float:
    """How far another run's series is off at a moment (s), in % of the base's there."""
    return 100.0 * abs(other.at(name, moment) - base.at(name, moment)) / abs(base.at(name, moment))


@dataclass(frozen=True)
class Turn:
    """Where two curves of one quantity turn, each at its own moment: ``moment`` in s is between the two."""

    moment: float
    first: float
    second: float

    @property
    def gap(self) -> float:
        """How far the two turn apart."""
        return abs(self.first - self.second)


def turns(first: Record, second: Record, name: str, prominence: float) -> list[Turn]:
    """The turns of a series that stand out by so much (in its unit), by time; the end where there are none.

    A turn of the second curve is its extreme of the same kind near that of the first.
    """
    time, found = first.time, []
    for sign in (1.0, -1.0):
        for row in find_peaks(sign * first[name], prominence=prominence)[0]:
            near = np.flatnonzero(np.abs(time - time[row]) <= NEAR)
            other = near[np.argmax(sign * second[name][near])]
            moment = 0.5 * float(time[row] + time[other])
            found.append(Turn(moment, float(first[name][row]), float(second[name][other])))
    if not found:
        return [Turn(float(time[-1]), float(first[name][-1]), float(second[name][-1]))]
    return sorted(found, key=lambda turn: turn.moment)


def mean_reduction(before: Record, after: Record, name: str) -> float:
    """By how much the mean absolute value of a series falls, in %."""
    return 100.0 * (1.0 - float(np.mean(np.abs(after[name])) / np.mean(np.abs(before[name]))))


def dominant_frequency(time: Array, series: Array) -> float:
    """Where the spectrum of a series (N,) at even times (s) is largest, in Hz, a slow drift taken off by a polynomial.

    Only frequencies with four periods or more in the series count.
    """
    centred = 2.0 * (time - time[0]) / (time[-1] - time[0]) - 1.0
    drift = np.polynomial.chebyshev.chebfit(centred, series, DRIFT_ORDER)
    swing = series - np.polynomial.chebyshev.chebval(centred, drift)
    count = PADDING * len(swing)
    spectrum = np.abs(np.fft.rfft(swing * hann(len(swing)), count))
    frequency = np.fft.rfftfreq(count, time[1] - time[0])
    spectrum[frequency < FEWEST_PERIODS / (time[-1] - time[0])] = 0.0
    return float(frequency[np.argmax(spectrum)])


def amplitude(time: Array, series: Array, frequency: float, begin: float, end: float) -> float:
    """Amplitude of a swing of a frequency (Hz) between two moments (s), on a drift of second order: least squares."""
    inside = (time >= begin) & (time <= end)
    turn = 2.0 * np.pi * frequency * time[inside]
    columns = np.column_stack([np.vander(time[inside] - begin, 3), np.cos(turn), np.sin(turn)])
    found = np.linalg.lstsq(columns, series[inside], rcond=None)[0]
    return float(np.hypot(found[3], found[4]))
