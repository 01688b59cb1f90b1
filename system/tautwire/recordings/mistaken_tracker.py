"""Mistakes in units, signs or order between a log and a tracker's file, told where no offset of its clock fits."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from itertools import combinations, groupby, product

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError
from ..robot.schema import AXES, Robot
from .alternative_readings import LENGTH_UNITS, TIME_UNITS, Mistake, WindingReading, convert
from .candidate_readings import SAMPLE_INTERVALS
from .column_corrections import scaled
from .frame_alignment import forward_kinematics_of_travel
from .mistaken_motion import EQUAL_DIFFERENCE, EQUAL_RATIO, check_motion
from .recording import Recording
from .tracker_clock import MIN_GRID_INTERVAL, estimate_tracker_clock, least_travel_mismatch
from .travel_correlation import distance_lags

Array = NDArray[np.float64]

POSITION_UNITS = ("m", "mm", "cm", "in")
WINCH_SPEED_UNITS = ("m/s", "mm/s", "cm/s", "m/min")
# Mistakes at once: with more, a wrong motion fits by chance.
MAX_MISTAKES = 3
# Of their energy: travels that differ by more fit at no offset, which takes long to find out.
MAX_TRAVEL_MISMATCH = 0.3
MAX_OFFSETS, MAX_FOLLOWED = 3, 20_000  # offsets of a clock, and samples of a log


@dataclass(frozen=True)
class TrackerReading:
    """How a log and a tracker's file are read: units of the tracker's positions and time, and time and winches."""

    position_unit: str = "m"
    time_unit: str = "s"
    winding: WindingReading = field(default_factory=WindingReading)

    def tracker(self, shown: Recording) -> Recording:
        """The tracker's file in m and s."""
        position = shown.position * LENGTH_UNITS[self.position_unit]
        return replace(shown, time=shown.time * TIME_UNITS[self.time_unit], position=position)

    def log(self, shown: Recording) -> Recording:
        """The log in m/s and s, its winches in the order and with the signs of the reading."""
        winding, second = self.winding, TIME_UNITS[self.winding.time_unit]
        speeds = shown.winch_speed[:, winding.order] * np.array(winding.signs) * winding.factor / second
        return replace(shown, time=shown.time * second, winch_speed=speeds)

    def mistakes(self, log: Recording) -> tuple[Mistake, ...]:
        """What this reading changes."""
        own = []
        if self.time_unit != "s":
            factor = TIME_UNITS[self.time_unit]
            corrections = scaled(("time",), factor, self.time_unit)
            own.append(Mistake(f"its time is in {self.time_unit}", convert("its time", factor), corrections, True))
        if self.position_unit != "m":
            factor = LENGTH_UNITS[self.position_unit]
            corrections = scaled(AXES, factor, self.position_unit)
            own.append(
                Mistake(f"its x, y, z are in {self.position_unit}", convert("its x, y, z", factor), corrections, True)
            )
        return (*own, *self.winding.mistakes(log))


def tracker_mistakes(robot: Robot, log: Recording, tracker: Recording) -> tuple[tuple[Mistake, ...], ...]:
    """Fewest mistakes with which the tracker's positions match the winch travel at one offset of its clock.

    Tried are units of either file's time, of positions and speeds, the sign of all winches or of one, and two that are
    swapped. Each entry is one set of mistakes that explains it; empty where none of up to three does.
    """

    def count(reading: TrackerReading) -> int:
        return len(reading.mistakes(log))

    readings = [each for each in _readings(log, tracker) if 0 < count(each) <= MAX_MISTAKES]
    for _, group in groupby(sorted(readings, key=count), key=count):
        fitting = [reading for reading in group if _fits(robot, reading.log(log), reading.tracker(tracker))]
        if fitting:
            return tuple(reading.mistakes(log) for reading in fitting)
    return ()


def frame_mistakes(robot: Robot, log: Recording, tracker: Recording) -> tuple[tuple[Mistake, ...], ...]:
    """Mistakes in unit, axes, rotation and origin of a tracker of a point mass, at whatever offset of its clock.

    Distances travelled, which no frame changes, tell the offset against positions by forward kinematics of the winches.
    Each entry is one set of mistakes that explains the tracker; empty where none does.
    """
    measured = np.asarray(np.isfinite(tracker.position).any(axis=0))
    rows = np.flatnonzero(np.isfinite(tracker.position[:, measured]).all(axis=1))
    if robot.platform.is_rigid_body or not measured[list(robot.axes_in_plane)].all() or not np.any(log.winch_speed):
        return ()
    log_rows = slice(None, None, 1 + log.sample_count // MAX_FOLLOWED)
    followed = forward_kinematics_of_travel(robot, log.wound_lengths()[log_rows])
    shown, start = np.where(measured, tracker.position[rows], 0.0), tracker.time[rows[0]]
    paths = (tracker.time[rows], shown), (log.time[log_rows], followed)
    lags = distance_lags(*paths, max(MIN_GRID_INTERVAL, *(float(np.median(np.diff(times))) for times, _ in paths)))
    checks = (check_motion(robot, _merged(log, tracker, start + lag)) for lag in lags[:MAX_OFFSETS])
    readings = [reading for check in checks if check for reading in check.readings if not reading.is_of_winches]
    best = min((reading.misfit for reading in readings), default=np.inf)
    fitting = [each for each in readings if each.misfit <= EQUAL_RATIO * best + EQUAL_DIFFERENCE]
    return tuple(dict.fromkeys(tuple(replace(m, is_of_tracker=True) for m in each.mistakes) for each in fitting))


def _merged(log: Recording, tracker: Recording, offset: float) -> Recording:
    """The log with the tracker's positions, whose clock shows the offset at the log's first sample."""
    times = tracker.time - offset + log.time[0]
    columns = [_at(log.time, times, column) for column in tracker.position.T]
    return replace(log, position=np.column_stack(columns), columns={**log.columns, **tracker.columns})


def _at(wanted: Array, times: Array, column: Array) -> Array:
    finite = np.isfinite(column)
    if not finite.any():
        return np.full(len(wanted), np.nan)
    return np.interp(wanted, times[finite], column[finite], left=np.nan, right=np.nan)


def _readings(log: Recording, tracker: Recording) -> Iterator[TrackerReading]:
    """Units and signs of all winches in any combination; one sign or a swap alone."""
    count = log.cable_count
    declared, all_positive = tuple(range(count)), (1,) * count
    times = tuple(product(_likely_time_units(log), _likely_time_units(tracker)))
    for (log_time, tracker_time), position, speed, sign in product(times, POSITION_UNITS, WINCH_SPEED_UNITS, (1, -1)):
        yield TrackerReading(position, tracker_time, WindingReading(log_time, speed, (sign,) * count, declared))
    for log_time, tracker_time in times:
        for odd in range(count):
            signs = tuple(-1 if cable == odd else 1 for cable in range(count))
            yield TrackerReading("m", tracker_time, WindingReading(log_time, "m/s", signs, declared))
        for first, second in combinations(range(count), 2):
            order = list(declared)
            order[first], order[second] = second, first
            yield TrackerReading("m", tracker_time, WindingReading(log_time, "m/s", all_positive, tuple(order)))


def _likely_time_units(recording: Recording) -> tuple[str, ...]:
    """Units of time in which the samples are as far apart as those of a recording."""
    interval = float(np.median(np.diff(recording.time)))
    shortest, longest = SAMPLE_INTERVALS
    likely = tuple(unit for unit, size in TIME_UNITS.items() if shortest <= interval * size <= longest)
    return ("s",) if "s" in likely else likely


def _fits(robot: Robot, log: Recording, tracker: Recording) -> bool:
    """Whether the positions match the winch travel at one offset of the tracker's clock."""
    try:
        if least_travel_mismatch(robot, log, tracker) > MAX_TRAVEL_MISMATCH:
            return False
        estimate_tracker_clock(robot, log, tracker)
    except RecordingError:
        return False
    return True
