"""Clock of a tracker against that of the winches' log, by the motion that both recorded."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import correlation_lags

from ..errors import RecordingError
from ..robot.schema import Robot
from .clock_fit import MIN_SAMPLES, Alignment, ClockFit, TrackerClock
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
# The rms of lengths less travel over that of lengths: beyond the first it is another motion or another unit.
MAX_MISFIT, EQUAL_RATIO, EQUAL_DIFFERENCE = 0.2, 1.5, 0.005
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
    fit = ClockFit(robot, log, times, lengths)
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


def _require_unique(path: str, best: Alignment, others: list[Alignment]) -> None:
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
