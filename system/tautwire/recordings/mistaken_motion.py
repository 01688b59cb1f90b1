"""Mistakes in units, signs, order, axes or quaternions of a recording, told by its winch travel and its poses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import AXES, Robot
from .alternative_readings import LENGTH_UNITS, TIME_UNITS, Mistake, WindingReading, winding_as_declared
from .candidate_readings import (
    SAMPLE_INTERVALS,
    are_of_one_system,
    geometry_readings,
    pose_readings,
    winding_readings,
)
from .frame_alignment import aligned_frames
from .geometry_reading import GeometryReading, RecordedPoses, recorded_poses
from .motion_regression import RopeMotion, centred, moves_along_two_axes, moving_rows, quasi_static_units, rope_motion
from .recording import Recording

Array = NDArray[np.float64]

# A smaller misfit is for effects to explain, and a mistake has to divide a larger one by the factor, to a share, which
# is that of several.
MAX_MISFIT, MIN_IMPROVEMENT, MAX_CORRECTED_MISFIT = 0.05, 4.0, 0.2
# Quaternions and centres of mass have few readings, none of which an effect takes after: these are tried beyond this.
MIN_POSE_MISFIT = 0.005
# Readings that misfit by no more than this times the best, and this more, explain a recording as well.
EQUAL_RATIO, EQUAL_DIFFERENCE = 1.5, 0.005
# Share of the robot's size that positions of another origin begin away from the declared start.
MIN_START_SHARE = 0.02
# Of anchors that lie in a frame of their own, in which the start says nothing: with it at most, and at least without.
MAX_FRAME_MISFIT, MIN_FRAME_MISFIT = 0.01, 0.2
# Of frames that bring the start nearer where much is missed, beside drums that are off by as much.
MAX_FAR_MISFIT = 0.08
MIN_CLOCK_OFFSET, MAX_CLOCK_OFFSET = 0.5, 10.0  # s


@dataclass(frozen=True)
class MotionReading:
    """Geometry and winding as they are read, with the misfit between both, and the mistakes that this means."""

    geometry: GeometryReading
    winding: WindingReading
    misfit: float
    mistakes: tuple[Mistake, ...]
    penalty: int = 0

    @property
    def is_of_winches(self) -> bool:
        """Whether winches are read otherwise than declared."""
        return self.winding != winding_as_declared(len(self.winding.order))


@dataclass(frozen=True)
class MotionCheck:
    """Winch travel against poses: the misfit as declared, and the readings that mend it equally well, if any."""

    misfit: float
    readings: tuple[MotionReading, ...]


@dataclass(frozen=True)
class _RecordedMotion:
    """What was recorded in the rows where the robot moves: times (M,), poses, and lengths wound (M, n) in m."""

    robot: Robot
    recording: Recording
    time: Array
    poses: RecordedPoses
    wound: Array

    @property
    def travel(self) -> Array:
        """Lengths wound about their means."""
        return centred(self.wound)

    @property
    def declared(self) -> WindingReading:
        """Winches as the format has them."""
        return winding_as_declared(self.robot.cable_count)

    def ropes(self, geometry: GeometryReading) -> RopeMotion:
        """Motion of the ropes in a geometry."""
        return rope_motion(self.robot, geometry, self.poses)

    def misfit(self, geometry: GeometryReading, winding: WindingReading) -> float:
        """Misfit of geometry and winding as they are read."""
        return self.ropes(geometry).misfit(self.travel, winding)


def check_motion(robot: Robot, recording: Recording) -> MotionCheck | None:
    """Regression of the geometric rope lengths ``|a_i - p - R b_i|`` on those that the winches wound, cable by cable.

    The misfit is the rms of what they differ by, over that of the geometric lengths about their mean. Where it is
    large, other units, signs, orders, axes and quaternions are tried; of those that mend it equally the ones with
    fewest mistakes are returned. None where the winches or the platform hardly move, or so fast that it swings on its
    ropes, and where positions are known along too few axes, or a rigid platform's orientation is not.
    """
    check, unit = _check_as_read(robot, recording), _stated_unit(recording)
    if check is None or not check.misfit > MAX_MISFIT or unit == "m":
        return check
    in_metres = _check_as_read(robot, replace(recording, position=recording.position / LENGTH_UNITS[unit]))
    if in_metres is None:
        return check
    readings = list(in_metres.readings)
    if in_metres.misfit <= MAX_MISFIT:
        readings.append(MotionReading(GeometryReading(), winding_as_declared(robot.cable_count), in_metres.misfit, ()))
    stated = [
        _reading(replace(each.geometry, stated_unit=unit), each.winding, each.misfit, recording) for each in readings
    ]
    return replace(check, readings=_best([*check.readings, *stated], check.misfit))


def _stated_unit(recording: Recording) -> str:
    """The unit other than m that all positions are said to be in; else m."""
    units = {recording.columns[axis].unit if axis in recording.columns else "" for axis in AXES}
    (unit, *others) = sorted(units)
    return unit if not others and unit in LENGTH_UNITS else "m"


def _check_as_read(robot: Robot, recording: Recording) -> MotionCheck | None:
    rows = moving_rows(robot, recording)
    units = {} if rows is None else quasi_static_units(robot, recording, rows)
    if rows is None or not units:
        return None
    motion = _recorded_motion(robot, recording, rows)
    misfit = motion.misfit(GeometryReading(), motion.declared)
    if not misfit > MAX_MISFIT:
        is_tried = robot.platform.is_rigid_body and misfit > MIN_POSE_MISFIT
        return MotionCheck(misfit, _best(_pose_readings(motion), misfit) if is_tried else ())
    readings = _readings(motion, units, misfit / MIN_IMPROVEMENT)
    if "m" not in units.get("s", ()):
        # Of a fast motion every longer unit of time makes a slow one: it alone has to explain the recording.
        readings = [each for each in readings if each.winding.time_unit == "s" or len(each.mistakes) == 1]
    else:
        clocks = _clock_readings(motion)
        readings += [_reading(GeometryReading(), winding, error, recording) for winding, error in clocks]
        frames = aligned_frames(robot, motion.poses, motion.wound)
        framed = [_declared_reading(motion, frame) for frame in frames]
        limit = MAX_MISFIT if misfit < MIN_FRAME_MISFIT else MAX_FAR_MISFIT
        readings += [each for each in framed if each.misfit <= limit and _is_start_nearer(motion, each.geometry)]
        is_far = misfit >= MIN_FRAME_MISFIT and moves_along_two_axes(motion.ropes(GeometryReading()).lengths)
        if is_far and not any(each.misfit <= MAX_FRAME_MISFIT for each in readings):
            readings += [each for each in framed if each.misfit <= MAX_FRAME_MISFIT]
    return MotionCheck(misfit, _best(readings, misfit))


def misfit_of_geometry(robot: Robot, recording: Recording, geometry: GeometryReading) -> float | None:
    """The misfit of :func:`check_motion` in a geometry, with the winches as declared; None where it has none."""
    rows = moving_rows(robot, recording)
    if rows is None or "m" not in quasi_static_units(robot, recording, rows).get("s", ()):
        return None
    motion = _recorded_motion(robot, recording, rows)
    return motion.misfit(geometry, motion.declared)


def _recorded_motion(robot: Robot, recording: Recording, rows: NDArray[np.int64]) -> _RecordedMotion:
    poses = recorded_poses(recording, rows)
    return _RecordedMotion(robot, recording, recording.time[rows], poses, recording.wound_lengths()[rows])


def _pose_readings(motion: _RecordedMotion) -> list[MotionReading]:
    """Readings of quaternions and centres of mass, with the winches as declared."""
    return [_declared_reading(motion, geometry) for geometry in pose_readings(motion.robot)]


def _declared_reading(motion: _RecordedMotion, geometry: GeometryReading) -> MotionReading:
    misfit = motion.misfit(geometry, motion.declared)
    return _reading(geometry, motion.declared, misfit, motion.recording)


def _readings(motion: _RecordedMotion, units: Mapping[str, Sequence[str]], max_misfit: float) -> list[MotionReading]:
    """Readings of geometry and winding with a misfit up to a maximum, for these units of time and anchors."""
    interval, travel = float(np.median(np.diff(motion.recording.time))), motion.travel
    readings = []
    for geometry in geometry_readings(motion.robot):
        if any(geometry.anchor_unit in anchor_units for anchor_units in units.values()):
            ropes = motion.ropes(geometry)
            windings = list(winding_readings(ropes.lengths, travel, interval))
            # Where a rigid platform swings, travel says little of the winches, and poses may be mistaken all the same.
            windings += [motion.declared] if motion.robot.platform.is_rigid_body else []
            misfits = {
                winding: ropes.misfit(travel, winding)
                for winding in dict.fromkeys(windings)
                if geometry.anchor_unit in units.get(winding.time_unit, ()) and are_of_one_system(geometry, winding)
            }
            readings += [
                _reading(geometry, winding, misfit, motion.recording)
                for winding, misfit in misfits.items()
                if misfit <= max_misfit
            ]
    return readings


def _is_start_nearer(motion: _RecordedMotion, geometry: GeometryReading) -> bool:
    """Whether positions that begin away from the declared start begin within half that distance in this geometry."""
    robot = motion.robot
    start, size = np.array(robot.platform.start), float(np.ptp([*robot.anchors, robot.platform.start], axis=0).max())
    before, after = (
        float(np.linalg.norm(reading.positions(robot, motion.poses)[0] - start))
        for reading in (GeometryReading(), geometry)
    )
    return before > MIN_START_SHARE * size and after < 0.5 * before


def _reading(geometry: GeometryReading, winding: WindingReading, misfit: float, recording: Recording) -> MotionReading:
    mistakes = (*geometry.mistakes(recording.has_orientation), *winding.mistakes(recording))
    interval = float(np.median(np.diff(recording.time))) * TIME_UNITS[winding.time_unit]
    penalty = len(mistakes) + (not SAMPLE_INTERVALS[0] <= interval <= SAMPLE_INTERVALS[1])
    return MotionReading(geometry, winding, misfit, mistakes, penalty)


def _best(readings: list[MotionReading], declared_misfit: float) -> tuple[MotionReading, ...]:
    limit = declared_misfit / MIN_IMPROVEMENT
    matching = [
        reading
        for reading in readings
        if reading.misfit <= min(limit, MAX_CORRECTED_MISFIT / max(1, len(reading.mistakes)))
    ]
    if not matching:
        return ()
    limit = EQUAL_RATIO * min(reading.misfit for reading in matching) + EQUAL_DIFFERENCE
    equal = [reading for reading in matching if reading.misfit <= limit]
    fewest = min(reading.penalty for reading in equal)
    unique = {reading.mistakes: reading for reading in equal if reading.penalty == fewest}
    # A factor that was fitted fits a little better than the unit near it.
    return tuple(sorted(unique.values(), key=lambda each: (each.winding.speed_unit is None, each.misfit)))


def _clock_readings(motion: _RecordedMotion) -> Iterator[tuple[WindingReading, float]]:
    """The shift of the winches' clock with the smallest misfit, where none that an effect explains is about as good."""
    time, ropes, declared = motion.time, motion.ropes(GeometryReading()), motion.declared
    reach = min(MAX_CLOCK_OFFSET, 0.25 * float(time[-1] - time[0]))

    def misfit(shift: float) -> float:
        inside = (time - shift >= time[0]) & (time - shift <= time[-1])
        shifted = np.column_stack([np.interp(time[inside] - shift, time, column) for column in motion.wound.T])
        part = RopeMotion(centred(ropes.lengths[inside]), ropes.least_scale[inside])
        return part.misfit(centred(shifted), declared)

    least, best = min((misfit(shift), float(shift)) for shift in np.linspace(-reach, reach, 401))
    if abs(best) < MIN_CLOCK_OFFSET:
        return
    # Of a periodic motion, a shift by whole periods fits as well as a small one.
    small = min(misfit(shift) for shift in np.linspace(-MIN_CLOCK_OFFSET, MIN_CLOCK_OFFSET, 101))
    if small > MIN_IMPROVEMENT * least + EQUAL_DIFFERENCE:
        yield WindingReading(signs=declared.signs, order=declared.order, clock_offset=-best), least
