"""Least squares for the offset and rate of a clock between recorded rope lengths and what the winches wound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import Robot
from .recording import Recording

Array = NDArray[np.float64]

MAX_ITERATIONS, TOLERANCE = 15, 1e-6  # s
MIN_SAMPLES, MAX_SAMPLES = 20, 20_000
OUTLIER_RATIO = 25.0  # of squares, to their median
JACKKNIFE_BLOCKS = 10
MIN_RATE_SIGMAS, MAX_RATE_ERROR = 3.0, 1e-2


@dataclass(frozen=True)
class TrackerClock:
    """A tracker's clock: it shows ``offset + rate * (t - t_1)`` at the time t of the log, whose first sample is at t_1.

    ``deviation`` is the standard deviation of the offset in the middle of the motion, in s; 0 where it is stated.
    """

    offset: float
    rate: float = 1.0
    deviation: float = 0.0

    def log_times(self, tracker_times: Array, first_log_time: float) -> Array:
        """Times on the log's clock."""
        return first_log_time + (tracker_times - self.offset) / self.rate


@dataclass(frozen=True)
class Alignment:
    """A local optimum: the clock, the misfit of lengths and travel, and the standard deviation of the rate."""

    clock: TrackerClock
    misfit: float
    rate_deviation: float


class ClockFit:
    """Least squares for the clock of tracked rope lengths (M, n), in m, at ``times`` (M,) of the tracker.

    Errors are lengths plus travel less elongations ``T L / (E A + T)`` by the measured tensions. Beside them each cable
    has a constant, a drift and a scale of its winch.
    """

    def __init__(self, robot: Robot, log: Recording, times: Array, lengths: Array) -> None:
        self.log, self.times, self.lengths, self.wound = log, times, lengths, log.wound_lengths()
        self.compliances = np.array([1.0 / (cable.modulus * cable.area) for cable in robot.cables])
        self.tensions = np.column_stack([_without_gaps(log.time, column) for column in log.tension.T])

    def refined(self, offset: float) -> Alignment | None:
        """The optimum near an offset; None where it leads out of the log or does not converge."""
        without_rate = self.converged(offset, is_rate_free=False)
        with_rate = self.converged(offset, is_rate_free=True)
        if with_rate and abs(with_rate.clock.rate - 1.0) > MIN_RATE_SIGMAS * with_rate.rate_deviation:
            return with_rate
        return without_rate

    def converged(self, offset: float, is_rate_free: bool) -> Alignment | None:
        """The optimum by Gauss-Newton steps from an offset, with or without a rate; None where there is none."""
        clock = TrackerClock(offset)
        for _ in range(MAX_ITERATIONS):
            overlap = self.overlap(clock)
            if len(overlap.times) < MIN_SAMPLES:
                return None
            step, deviations = self._step(overlap, is_rate_free)
            log_rate = 1.0 / clock.rate + step[1]
            if abs(log_rate - 1.0) > MAX_RATE_ERROR:
                return None
            middle = overlap.times.mean()
            since_start = (middle - clock.offset) / clock.rate + step[0]
            clock = TrackerClock(middle - since_start / log_rate, 1.0 / log_rate, deviations[0])
            if abs(step[0]) + abs(step[1]) * np.ptp(overlap.times) < TOLERANCE:
                return Alignment(clock, self._misfit(clock), deviations[1])
        return None

    def overlap(self, clock: TrackerClock) -> Overlap:
        """The tracker's samples within the log, and the log's signals at their times."""
        log_times = clock.log_times(self.times, self.log.time[0])
        rows = np.flatnonzero((log_times >= self.log.time[0]) & (log_times <= self.log.time[-1]))
        rows = rows[:: 1 + len(rows) // MAX_SAMPLES]
        lengths = self.lengths[rows]
        travel, tensions, speeds = (
            np.column_stack([np.interp(log_times[rows], self.log.time, column) for column in signals.T])
            for signals in (self.wound, self.tensions, self.log.winch_speed)
        )
        strains = tensions * self.compliances
        return Overlap(
            self.times[rows], lengths, travel, lengths + travel - lengths * strains / (1.0 + strains), speeds
        )

    def _step(self, overlap: Overlap, is_rate_free: bool) -> tuple[Array, Array]:
        """Gauss-Newton step of the log's time at the middle and of its rate, and their deviations by a jackknife."""
        lever = overlap.times - overlap.times.mean()
        levers = np.column_stack([np.ones_like(lever), lever][: 1 + is_rate_free])
        errors = overlap.without_nuisances(overlap.errors)
        squares = np.sum(errors**2, axis=1)
        kept = overlap.rows(squares <= OUTLIER_RATIO * np.median(squares))
        levers = levers[squares <= OUTLIER_RATIO * np.median(squares)]
        errors = kept.without_nuisances(kept.errors)
        jacobian = np.stack([kept.without_nuisances(kept.speeds * each[:, None]) for each in levers.T], axis=2)
        inverse = np.linalg.pinv(np.einsum("kcp,kcq->pq", jacobian, jacobian), hermitian=True)
        step = -inverse @ np.einsum("kcp,kc->p", jacobian, errors)
        left = np.einsum("kcp,kc->kp", jacobian, errors + jacobian @ step)
        scores = np.array([block.sum(axis=0) for block in np.array_split(left, JACKKNIFE_BLOCKS)])
        covariance = inverse @ (scores.T @ scores) @ inverse * JACKKNIFE_BLOCKS / (JACKKNIFE_BLOCKS - 1)
        return np.append(step, 0.0)[:2], np.append(np.sqrt(np.diag(covariance)), 0.0)[:2]

    def _misfit(self, clock: TrackerClock) -> float:
        """Rms of the errors over that of the lengths, both centred, without the twentieth of rows that err most."""
        overlap = self.overlap(clock)
        squares = np.sum((overlap.errors - np.median(overlap.errors, axis=0)) ** 2, axis=1)
        inliers = squares <= np.quantile(squares, 0.95)
        scale = float(np.sum((overlap.lengths[inliers] - overlap.lengths[inliers].mean(axis=0)) ** 2))
        return float(np.sqrt(squares[inliers].sum() / scale)) if scale > 0.0 else np.inf


@dataclass(frozen=True)
class Overlap:
    """Samples (M,) of a tracker within the log: lengths, travel, errors (m) and winch speeds (m/s), each (M, n)."""

    times: Array
    lengths: Array
    travel: Array
    errors: Array
    speeds: Array

    def rows(self, selected: NDArray[np.bool_]) -> Overlap:
        """Some of the samples."""
        signals = (self.times, self.lengths, self.travel, self.errors, self.speeds)
        return Overlap(*(signal[selected] for signal in signals))

    def without_nuisances(self, signals: Array) -> Array:
        """Signals (M, n) without what each cable's constant, drift and scale could explain."""
        cleared = np.empty_like(signals)
        for cable, signal in enumerate(signals.T):
            basis = np.column_stack([np.ones_like(self.times), self.times - self.times[0], self.travel[:, cable]])
            basis = np.linalg.qr(basis / np.maximum(np.abs(basis).max(axis=0), np.finfo(float).tiny))[0]
            cleared[:, cable] = signal - basis @ (basis.T @ signal)
        return cleared


def _without_gaps(time: Array, signal: Array) -> Array:
    """The signal interpolated where it is missing; 0 where it is missing everywhere."""
    finite = np.isfinite(signal)
    return np.interp(time, time[finite], signal[finite]) if finite.any() else np.zeros_like(signal)
