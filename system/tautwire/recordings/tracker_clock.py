"""Clock of a tracker against that of the winches' log, by the motion that both recorded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import correlation_lags

from ..errors import RecordingError
from ..robot.schema import Robot
from .geometry_reading import GeometryReading, recorded_poses
from .recording import Recording
from .travel_correlation import TRAVEL_WINDOW, correlated, lowest_valleys, travel_on_grid
from .white_noise_estimate import white_noise_deviation

Array = NDArray[np.float64]

MIN_GRID_INTERVAL, MAX_GRID_POINTS = 0.02, 400_000  # s
# Share of the motion of the log or of the tracker that both have to have recorded.
MIN_MOTION_SHARE = 0.25
MIN_MOTION_NOISE_RATIO = 20.0
# Candidates whose coarse misfit is larger than the best by more are not refined.
MAX_COARSE_DIFFERENCE = 0.3
MAX_ITERATIONS, TOLERANCE = 15, 1e-6  # s
MIN_SAMPLES, MAX_SAMPLES = 20, 20_000
# The rms of lengths less travel over that of lengths: beyond the first it is another motion or another unit.
MAX_MISFIT, EQUAL_RATIO, EQUAL_DIFFERENCE = 0.2, 1.5, 0.005
OUTLIER_RATIO = 25.0  # of squares, to their median
JACKKNIFE_BLOCKS = 10
MIN_RATE_SIGMAS, MAX_RATE_ERROR = 3.0, 1e-2
MAX_DEVIATION = 5e-3  # s

STATE_OFFSET_HINT = "or state clock_offset in [recording.tracker]"


class UnmatchedTravelError(RecordingError):
    """A tracker's positions that match the winch travel at no offset of its clock."""

    def __init__(self, tracker: Recording) -> None:
        problem = "its positions match the winch travel at no offset of its clock"
        hint = (
            "check units, factors and signs of the winches in [recording.columns], units, axes and origin of the "
            f"tracker, and that it is that of this motion, {STATE_OFFSET_HINT}"
        )
        if np.all(np.diff(tracker.time) == 1.0):
            problem += ", and its time rises by exactly 1 from row to row, as the number of a frame does"
            hint = f"declare time in [recording.tracker.columns] with the s between frames as its factor, or {hint}"
        super().__init__(tracker.path, problem, hint)


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
class _Alignment:
    """A local optimum: the clock, the misfit of lengths and travel, and the standard deviation of the rate."""

    clock: TrackerClock
    misfit: float
    rate_deviation: float


def estimate_tracker_clock(robot: Robot, log: Recording, tracker: Recording) -> TrackerClock:
    """Time-delay estimation between geometric rope lengths ``|a_i - p|`` and the lengths that the winches wound.

    Cross-correlation of travel gives candidates, and Gauss-Newton steps refine offset and rate of each. The rate is 1
    unless it differs significantly.

    Raises UnmatchedTravelError where no offset fits, RecordingError where nothing moves, several fit, or the best is
    uncertain.
    """
    rows = _measured_rows(robot, tracker)
    times, positions = tracker.time[rows], tracker.position[rows]
    lengths = GeometryReading().directions(robot, recorded_poses(tracker, rows))[0]
    _require_motion(log, tracker, positions)
    fit = _ClockFit(robot, log, times, lengths)
    alignments = [fit.refined(offset) for offset in _candidate_offsets(log, times, lengths)]
    fitting = sorted((each for each in alignments if each and each.misfit <= MAX_MISFIT), key=lambda each: each.misfit)
    if not fitting:
        raise UnmatchedTravelError(tracker)
    best = fitting[0]
    _require_unique(tracker.path, best, fitting[1:])
    if best.clock.deviation > MAX_DEVIATION:
        problem = f"the winch travel tells the offset of its clock to no better than {_milliseconds(best.clock)}"
        raise RecordingError(
            tracker.path, problem, f"record a motion that starts, stops and returns, {STATE_OFFSET_HINT}"
        )
    return best.clock


def _milliseconds(clock: TrackerClock) -> str:
    return f"{1e3 * clock.deviation:.2g} ms"


def _measured_rows(robot: Robot, tracker: Recording) -> NDArray[np.int64]:
    """Rows in which every coordinate that the tracker has at all was measured."""
    measured = np.asarray(np.isfinite(tracker.position).any(axis=0))
    if not measured[list(robot.axes_in_plane)].all():
        hint = f"record every coordinate, {STATE_OFFSET_HINT}"
        raise RecordingError(tracker.path, "its positions are along too few axes to find its clock", hint)
    is_known = np.asarray(np.isfinite(tracker.position[:, measured]).all(axis=1))
    if robot.platform.is_rigid_body and tracker.has_orientation:
        is_known &= np.isfinite(tracker.orientation).all(axis=1)
    rows = np.flatnonzero(is_known)
    if len(rows) < MIN_SAMPLES:
        problem = f"has {len(rows)} samples with every coordinate, at least {MIN_SAMPLES} are needed to find its clock"
        raise RecordingError(tracker.path, problem, f"record for longer, {STATE_OFFSET_HINT}")
    return rows


def _require_motion(log: Recording, tracker: Recording, positions: Array) -> None:
    noise = white_noise_deviation(tracker.position)
    moved = float(np.sqrt(np.nanmax(np.nanvar(positions[:, np.isfinite(positions).any(axis=0)], axis=0))))
    still = log.path if not np.any(log.winch_speed) else tracker.path if moved <= MIN_MOTION_NOISE_RATIO * noise else ""
    if still:
        hint = f"record a motion, {STATE_OFFSET_HINT}"
        raise RecordingError(still, "has no motion by which the tracker's clock could be found", hint)


def _require_unique(path: str, best: _Alignment, others: list[_Alignment]) -> None:
    for other in others:
        is_apart = abs(other.clock.offset - best.clock.offset) > TRAVEL_WINDOW
        if is_apart and other.misfit <= EQUAL_RATIO * best.misfit + EQUAL_DIFFERENCE:
            offsets = f"{best.clock.offset:.3f} s and {other.clock.offset:.3f} s"
            problem = f"the winch travel fits offsets of its clock of {offsets} about equally well"
            hint = f"record beyond the repeated motion, from rest to rest, {STATE_OFFSET_HINT}"
            raise RecordingError(path, problem, hint)


def least_travel_mismatch(robot: Robot, log: Recording, tracker: Recording) -> float:
    """Least energy of the sum of both travels over that of each, at any offset: 0 where they match, 1 where unlike."""
    rows = _measured_rows(robot, tracker)
    lengths = GeometryReading().directions(robot, recorded_poses(tracker, rows))[0]
    travel = _correlated_travel(log, tracker.time[rows], lengths)
    return float(travel.misfits.min()) if travel else np.inf


@dataclass(frozen=True)
class _CorrelatedTravel:
    """Misfits of both travels by the lag (s) of one behind the other, on a grid of ``interval`` s."""

    misfits: Array
    lags: Array
    interval: float


def _candidate_offsets(log: Recording, times: Array, lengths: Array) -> list[float]:
    """Offsets at which the travel of both correlates best, the best first: local minima of the energy of their sum."""
    travel = _correlated_travel(log, times, lengths)
    if travel is None:
        return []
    limit = float(travel.misfits.min()) + MAX_COARSE_DIFFERENCE
    reach = round(TRAVEL_WINDOW / travel.interval) + 1
    return [float(times[0] + travel.lags[index]) for index in lowest_valleys(travel.misfits, limit, reach)]


def _correlated_travel(log: Recording, times: Array, lengths: Array) -> _CorrelatedTravel | None:
    """Cross-correlation of the travel of a log and of tracked lengths (M, n); None where one has none."""
    span = (times[-1] - times[0]) + log.duration
    intervals = [float(np.median(np.diff(each))) for each in (times, log.time)]
    interval = max(MIN_GRID_INTERVAL, *intervals, span / MAX_GRID_POINTS)
    reeled, is_reeled = travel_on_grid(log.time, log.wound_lengths(), interval)
    shortened, is_shortened = travel_on_grid(times, lengths, interval)
    if not (is_reeled.any() and is_shortened.any()):
        return None
    reeled_energy, shortened_energy = np.sum(reeled**2, axis=1), np.sum(shortened**2, axis=1)
    energy_of_log = correlated(is_shortened, reeled_energy)
    energy_of_tracker = correlated(shortened_energy, is_reeled)
    product = sum(correlated(first, second) for first, second in zip(shortened.T, reeled.T, strict=True))
    share = np.maximum(energy_of_log / reeled_energy.sum(), energy_of_tracker / shortened_energy.sum())
    energy = energy_of_log + energy_of_tracker
    is_shared = share >= MIN_MOTION_SHARE
    misfits = np.where(is_shared, 1.0 + 2.0 * product / np.where(is_shared, energy, 1.0), np.inf)
    return _CorrelatedTravel(misfits, interval * correlation_lags(len(shortened), len(reeled)), interval)


class _ClockFit:
    """Least squares for the clock of tracked rope lengths (M, n), in m, at ``times`` (M,) of the tracker.

    Errors are lengths plus travel less elongations ``T L / (E A + T)`` by the measured tensions. Beside them each cable
    has a constant, a drift and a scale of its winch.
    """

    def __init__(self, robot: Robot, log: Recording, times: Array, lengths: Array) -> None:
        self.log, self.times, self.lengths, self.wound = log, times, lengths, log.wound_lengths()
        self.compliances = np.array([1.0 / (cable.modulus * cable.area) for cable in robot.cables])
        self.tensions = np.column_stack([_without_gaps(log.time, column) for column in log.tension.T])

    def refined(self, offset: float) -> _Alignment | None:
        """The optimum near an offset; None where it leads out of the log or does not converge."""
        without_rate = self._converged(offset, is_rate_free=False)
        with_rate = self._converged(offset, is_rate_free=True)
        if with_rate and abs(with_rate.clock.rate - 1.0) > MIN_RATE_SIGMAS * with_rate.rate_deviation:
            return with_rate
        return without_rate

    def _converged(self, offset: float, is_rate_free: bool) -> _Alignment | None:
        clock = TrackerClock(offset)
        for _ in range(MAX_ITERATIONS):
            overlap = self._overlap(clock)
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
                return _Alignment(clock, self._misfit(clock), deviations[1])
        return None

    def _overlap(self, clock: TrackerClock) -> _Overlap:
        log_times = clock.log_times(self.times, self.log.time[0])
        rows = np.flatnonzero((log_times >= self.log.time[0]) & (log_times <= self.log.time[-1]))
        rows = rows[:: 1 + len(rows) // MAX_SAMPLES]
        lengths = self.lengths[rows]
        travel, tensions, speeds = (
            np.column_stack([np.interp(log_times[rows], self.log.time, column) for column in signals.T])
            for signals in (self.wound, self.tensions, self.log.winch_speed)
        )
        strains = tensions * self.compliances
        return _Overlap(
            self.times[rows], lengths, travel, lengths + travel - lengths * strains / (1.0 + strains), speeds
        )

    def _step(self, overlap: _Overlap, is_rate_free: bool) -> tuple[Array, Array]:
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
        overlap = self._overlap(clock)
        squares = np.sum((overlap.errors - np.median(overlap.errors, axis=0)) ** 2, axis=1)
        inliers = squares <= np.quantile(squares, 0.95)
        scale = float(np.sum((overlap.lengths[inliers] - overlap.lengths[inliers].mean(axis=0)) ** 2))
        return float(np.sqrt(squares[inliers].sum() / scale)) if scale > 0.0 else np.inf


@dataclass(frozen=True)
class _Overlap:
    """Samples (M,) of a tracker within the log: lengths, travel, errors (m) and winch speeds (m/s), each (M, n)."""

    times: Array
    lengths: Array
    travel: Array
    errors: Array
    speeds: Array

    def rows(self, selected: NDArray[np.bool_]) -> _Overlap:
        """Some of the samples."""
        signals = (self.times, self.lengths, self.travel, self.errors, self.speeds)
        return _Overlap(*(signal[selected] for signal in signals))

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
