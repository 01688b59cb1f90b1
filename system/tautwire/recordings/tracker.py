"""Positions from a tracker's file of its own, put onto the rows of the winches' log."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError
from ..robot.recorded_columns import POSE_COLUMNS, TRACKER_TABLE
from ..robot.schema import RecordedColumn, Robot
from .alternative_readings import mistakes_text
from .clock_fit import TrackerClock
from .consistency import travel_error
from .mistaken_tracker import frame_mistakes, tracker_mistakes
from .quaternion_columns import unit_quaternions
from .recording import Recording, read_tracker
from .tracker_clock import UnmatchedTravelError, estimate_tracker_clock

Array = NDArray[np.float64]

# The polynomial through neighbours moves a sample to its row, and adds some 1 % to the variance of its noise.
NEIGHBOURS, POLYNOMIAL_DEGREE = 9, 3
# Beyond so many intervals without a sample a polynomial would be a guess.
MAX_GAP_INTERVALS = 5.0


def with_tracker(robot: Robot, log: Recording, path: str | Path) -> Recording:
    """The recording of a log without positions and of a tracker's file, each with a clock of its own.

    The robot's ``tracker`` says what the file's columns are, and may state its clock; otherwise that is estimated from
    the winch travel. ``read_as`` tells the clock.

    Raises RecordingError where the log has positions, the file is not valid, or its clock cannot be found, be it as the
    log moves more rope than fits into the robot.
    """
    if log.has_position:
        hint = "declare other columns as x, y, z, rename them, or leave the tracker's file out"
        raise RecordingError(log.path, f"has positions of its own beside those of {path}", hint)
    tracker = read_tracker(path, robot.tracker.columns)
    if not tracker.has_position:
        hint = "name the columns x, y, z in [recording.tracker.columns]"
        raise RecordingError(str(path), "has no positions", hint)
    declared = robot.tracker
    if declared.clock_offset is None:
        clock = _estimated_clock(robot, log, tracker)
        origin = f"from winch travel, +- {2e3 * clock.deviation:.2g} ms"
    else:
        clock = TrackerClock(declared.clock_offset, declared.clock_rate)
        origin = "as stated in [recording.tracker]"
    times = clock.log_times(tracker.time, log.time[0])
    position = samples_at_rows(log.time, times, tracker.position)
    filled = np.count_nonzero(np.isfinite(position).any(axis=1))
    if filled < 2:
        problem = f"has no samples during {log.path}, with {clock.offset:.6g} s on its clock at the first sample there"
        raise RecordingError(str(path), problem, "correct clock_offset in [recording.tracker], or leave it out")
    note = (
        f"positions are from {path}, whose clock shows {clock.offset:.4f} s at the first sample here"
        f"{_pace(clock)}, {origin}; {filled} of {log.sample_count} rows have one"
    )
    # Quaternions of continuous sign are moved as positions are, by small rotations.
    orientation = unit_quaternions(samples_at_rows(log.time, times, tracker.orientation))
    standard = {name: RecordedColumn(name, name, table=TRACKER_TABLE) for name in POSE_COLUMNS}
    of_tracker = {name: tracker.columns.get(name, column) for name, column in standard.items()}
    read_as = (*log.read_as, *tracker.read_as, note)
    recording = replace(log, position=position, columns={**log.columns, **of_tracker}, read_as=read_as)
    return replace(recording, orientation=orientation) if tracker.has_orientation else recording


def _estimated_clock(robot: Robot, log: Recording, tracker: Recording) -> TrackerClock:
    """The tracker's clock by the winch travel; where no offset fits, the error tells the likely mistakes."""
    try:
        return estimate_tracker_clock(robot, log, tracker)
    except RecordingError as error:
        of_travel = travel_error(robot, log)
        is_mistaken = of_travel is not None or isinstance(error, UnmatchedTravelError)
        alternatives = tracker_mistakes(robot, log, tracker) if is_mistaken else ()
        if not alternatives and isinstance(error, UnmatchedTravelError):
            alternatives = frame_mistakes(robot, log, tracker)
        if not alternatives:
            raise of_travel or error from None
        causes, remedies = mistakes_text(alternatives, log, tracker)
        problem = f"its positions match the winch travel at no offset of its clock, but do if {causes}"
        raise RecordingError(tracker.path, problem, remedies) from None


def _pace(clock: TrackerClock) -> str:
    return "" if clock.rate == 1.0 else f" and runs {clock.rate:.6f} times as fast"


def samples_at_rows(row_times: Array, sample_times: Array, recorded: Array) -> Array:
    """Values (N, k) at the times (N,) of rows, of samples (M, k) at other times (M,); NaN where a row has none.

    Each sample goes to the nearest row, and of several the nearest: a sample stays one sample, with its own noise. It
    is moved there by a cubic through its nine nearest neighbours, whose value at the sample itself is left out.
    """
    placed = np.full((len(row_times), recorded.shape[1]), np.nan)
    measured = np.isfinite(recorded).any(axis=0)
    complete = np.flatnonzero(np.isfinite(recorded[:, measured]).all(axis=1))
    times, samples = sample_times[complete], recorded[complete][:, measured]
    if len(times) < NEIGHBOURS:
        return placed
    rows = _nearest(row_times, times)
    distances = row_times[rows] - times
    limits = 0.5 * np.gradient(row_times)
    is_nearest = np.zeros(len(times), dtype=bool)
    is_nearest[_nearest(times, row_times)] = True
    chosen = np.flatnonzero(is_nearest & (np.abs(distances) <= 1.001 * limits[rows]))
    order = chosen[np.argsort(-np.abs(distances[chosen]), kind="stable")]
    for first in range(0, len(order), 100_000):
        part = order[first : first + 100_000]
        moved = samples[part] + _displacements(times, samples, part, distances[part])
        placed[rows[part][:, None], np.flatnonzero(measured)] = moved
    return placed


def _nearest(times: Array, wanted: Array) -> NDArray[np.intp]:
    """Index of the nearest of rising times."""
    after = np.clip(np.searchsorted(times, wanted), 1, len(times) - 1)
    return np.asarray(np.where(wanted - times[after - 1] <= times[after] - wanted, after - 1, after))


def _displacements(times: Array, samples: Array, part: NDArray[np.intp], distances: Array) -> Array:
    """How far the platform moves within the distances (K,) in s after samples; NaN in stretches between gaps too short.

    By the cubic that fits nine neighbours best.
    """
    gaps = np.diff(times) > MAX_GAP_INTERVALS * np.median(np.diff(times))
    bounds = np.concatenate([[0], np.flatnonzero(gaps) + 1, [len(times)]])
    stretch = np.searchsorted(bounds, part, side="right") - 1
    begin, end = bounds[stretch], bounds[stretch + 1]
    first = np.clip(part - NEIGHBOURS // 2, begin, np.maximum(end - NEIGHBOURS, begin))
    is_long = end - begin >= NEIGHBOURS
    neighbours = np.minimum(first[:, None] + np.arange(NEIGHBOURS), len(times) - 1)
    offsets = times[neighbours] - times[part][:, None]
    scale = np.maximum(np.abs(offsets).max(axis=1), np.finfo(float).tiny)
    powers = (offsets / scale[:, None])[..., None] ** np.arange(POLYNOMIAL_DEGREE + 1)
    at_row = (distances / scale)[:, None] ** np.arange(1, POLYNOMIAL_DEGREE + 1)
    weights = np.einsum("kp,kpj->kj", at_row, np.linalg.pinv(powers)[:, 1:])
    displacements = np.einsum("kj,kjc->kc", weights, samples[neighbours])
    return np.where(is_long[:, None], displacements, np.nan)
