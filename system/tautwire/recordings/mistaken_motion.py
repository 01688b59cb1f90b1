"""Mistakes in units, signs, order or axes of a recording, told by its winch travel and its positions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import AXES, Robot
from .alternative_readings import (
    ANCHOR_UNITS,
    TIME_UNITS,
    GeometryReading,
    Mistake,
    WindingReading,
)
from .candidate_readings import SAMPLE_INTERVALS, are_of_one_system, geometry_readings, winding_readings
from .frame_alignment import aligned_frames
from .recording import Recording
from .white_noise_estimate import white_noise_deviation

Array = NDArray[np.float64]

# A smaller misfit is for effects to explain, and a mistake has to divide a larger one by the factor, to a share, which
# is that of several.
MAX_MISFIT, MIN_IMPROVEMENT, MAX_CORRECTED_MISFIT = 0.05, 4.0, 0.2
# Readings that misfit by no more than this times the best, and this more, explain a recording as well.
EQUAL_RATIO, EQUAL_DIFFERENCE = 1.5, 0.005
# Share of the robot's size that positions of another origin begin away from the declared start.
MIN_START_SHARE = 0.02
# Share of the lowest natural frequency up to which the platform follows the winches.
MAX_QUASI_STATIC_SHARE = 0.5
MIN_MOTION_NOISE_RATIO = 20.0
MAX_ROWS, ROWS_USED = 8000, 1000
MIN_CLOCK_OFFSET, MAX_CLOCK_OFFSET = 0.5, 10.0  # s


@dataclass(frozen=True)
class MotionReading:
    """Geometry and winding as they are read, with the misfit between both, and the mistakes that this means."""

    geometry: GeometryReading
    winding: WindingReading
    misfit: float
    mistakes: tuple[Mistake, ...]
    penalty: int = 0


@dataclass(frozen=True)
class MotionCheck:
    """Winch travel against positions: the misfit as declared, and the readings that mend it equally well, if any."""

    misfit: float
    readings: tuple[MotionReading, ...]


@dataclass(frozen=True)
class LengthRegression:
    """Centred geometric rope lengths on centred wound ones, both (M, n) in m: their slopes and misfits, (n,).

    A slope is the shortening by what was reeled in, 1 where both agree.
    """

    lengths: Array
    wound: Array
    slopes: Array
    misfits: Array


def length_regression(robot: Robot, recording: Recording) -> LengthRegression | None:
    """Regression, cable by cable, that :func:`check_motion` makes of a recording as it is declared.

    None where the winches or the platform hardly move, and where positions are known along too few axes.
    """
    rows = _moving_rows(robot, recording)
    if rows is None:
        return None
    lengths = _centred(GeometryReading().directions(robot, recording.position[rows])[0])
    wound = _centred(recording.wound_lengths()[rows])
    single = WindingReading(signs=(1,), order=(0,))
    misfits = [_misfit(lengths[:, [cable]], wound[:, [cable]], single) for cable in range(robot.cable_count)]
    energies = np.sum(wound**2, axis=0)
    slopes = -np.sum(lengths * wound, axis=0) / np.where(energies > 0.0, energies, np.nan)
    return LengthRegression(lengths, wound, slopes, np.array(misfits))


def check_motion(robot: Robot, recording: Recording) -> MotionCheck | None:
    """Regression of the geometric rope lengths ``|a_i - p|`` on the lengths that the winches wound, cable by cable.

    The misfit is the rms of what they differ by, over that of the geometric lengths about their mean. Where it is
    large, other units, signs, orders and axes are tried; of those that mend it equally the ones with fewest mistakes
    are returned. None where the winches or the platform hardly move, or so fast that the platform swings, and where
    positions are known along too few axes.
    """
    rows = _moving_rows(robot, recording)
    units = {} if rows is None else _quasi_static_units(robot, recording, rows)
    if rows is None or not units:
        return None
    time, wound, recorded_positions = recording.time[rows], recording.wound_lengths()[rows], recording.position[rows]
    declared = WindingReading(signs=(1,) * robot.cable_count, order=tuple(range(robot.cable_count)))
    lengths, travel = _centred(GeometryReading().directions(robot, recorded_positions)[0]), _centred(wound)
    misfit = _misfit(lengths, travel, declared)
    if misfit <= MAX_MISFIT:
        return MotionCheck(misfit, ())
    readings = _readings(robot, recording, rows, units)
    if "m" not in units.get("s", ()):
        # Of a fast motion every longer unit of time makes a slow one: it alone has to explain the recording.
        readings = [each for each in readings if each.winding.time_unit == "s" or len(each.mistakes) == 1]
    else:
        clocks = _clock_readings(lengths, declared, time, wound)
        readings += [_reading(GeometryReading(), winding, error, recording) for winding, error in clocks]
        for geometry in aligned_frames(robot, recorded_positions, wound):
            if _is_start_nearer(robot, recorded_positions, geometry):
                error = _misfit(_centred(geometry.directions(robot, recorded_positions)[0]), travel, declared)
                if error <= MAX_MISFIT:
                    readings.append(_reading(geometry, declared, error, recording))
    return MotionCheck(misfit, _best(readings, misfit))


def _readings(
    robot: Robot, recording: Recording, rows: NDArray[np.int64], units: Mapping[str, Sequence[str]]
) -> list[MotionReading]:
    """Readings of geometry and winding, with their misfits, for these units of time and anchors."""
    travel, interval = _centred(recording.wound_lengths()[rows]), float(np.median(np.diff(recording.time)))
    readings = []
    for geometry in geometry_readings(robot):
        if any(geometry.anchor_unit in anchor_units for anchor_units in units.values()):
            lengths = _centred(geometry.directions(robot, recording.position[rows])[0])
            readings += [
                _reading(geometry, winding, _misfit(lengths, travel, winding), recording)
                for winding in winding_readings(lengths, travel, interval)
                if geometry.anchor_unit in units.get(winding.time_unit, ()) and are_of_one_system(geometry, winding)
            ]
    return readings


def _is_start_nearer(robot: Robot, recorded_positions: Array, geometry: GeometryReading) -> bool:
    """Whether positions that begin away from the declared start begin within half that distance in this geometry."""
    start, size = np.array(robot.platform.start), float(np.ptp([*robot.anchors, robot.platform.start], axis=0).max())
    before, after = (
        float(np.linalg.norm(reading.positions(robot, recorded_positions[:1])[0] - start))
        for reading in (GeometryReading(), geometry)
    )
    return before > MIN_START_SHARE * size and after < 0.5 * before


def _reading(geometry: GeometryReading, winding: WindingReading, misfit: float, recording: Recording) -> MotionReading:
    mistakes = (*geometry.mistakes(), *winding.mistakes(recording))
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
    return tuple(sorted(unique.values(), key=lambda reading: reading.misfit))


def _clock_readings(
    lengths: Array, declared: WindingReading, time: Array, wound: Array
) -> Iterator[tuple[WindingReading, float]]:
    """The shift of the winches' clock with the smallest misfit, where none that an effect explains is about as good."""
    reach = min(MAX_CLOCK_OFFSET, 0.25 * float(time[-1] - time[0]))

    def misfit(shift: float) -> float:
        inside = (time - shift >= time[0]) & (time - shift <= time[-1])
        shifted = np.column_stack([np.interp(time[inside] - shift, time, column) for column in wound.T])
        return _misfit(_centred(lengths[inside]), _centred(shifted), declared)

    # Of a periodic motion, a shift by whole periods fits as well as a small one.
    small = min(misfit(shift) for shift in np.linspace(-MIN_CLOCK_OFFSET, MIN_CLOCK_OFFSET, 101))
    least, best = min((misfit(shift), float(shift)) for shift in np.linspace(-reach, reach, 401))
    if abs(best) >= MIN_CLOCK_OFFSET and small > MIN_IMPROVEMENT * least + EQUAL_DIFFERENCE:
        yield WindingReading(signs=declared.signs, order=declared.order, clock_offset=-best), least


def _moving_rows(robot: Robot, recording: Recording) -> NDArray[np.int64] | None:
    """Rows with positions, evenly spaced in the stretch where winches move most; None where nothing moves."""
    wound, position = recording.wound_lengths(), recording.position
    measured = np.isfinite(position).any(axis=0)
    if np.count_nonzero(measured) < len(robot.axes_in_plane) or not np.any(wound):
        return None
    travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(wound, axis=0)).sum(axis=1))])
    first = 0
    if recording.sample_count > MAX_ROWS:
        first = int(np.argmax(travel[MAX_ROWS:] - travel[:-MAX_ROWS]))
    stretch = np.arange(first, min(first + MAX_ROWS, recording.sample_count))
    rows = stretch[np.isfinite(position[stretch][:, measured]).all(axis=1)]
    if rows.size < 10:
        return None
    moved = np.sqrt(np.mean(np.var(position[rows][:, measured], axis=0)))
    noise = white_noise_deviation(recording.position)
    if moved <= MIN_MOTION_NOISE_RATIO * (noise if np.isfinite(noise) else 0.0):
        return None
    return rows[:: max(1, rows.size // ROWS_USED)]


def _quasi_static_units(robot: Robot, recording: Recording, rows: NDArray[np.int64]) -> dict[str, tuple[str, ...]]:
    """Units of anchors, by that of time, with which the winches move too slowly to excite the lowest mode.

    Its frequency is that of ropes ``E A / L`` under the tension ``m g / n`` each, at the start; that of the winches, in
    their stretch of rows, is the rms of their speed over that of their travel.
    """
    stretch = slice(rows[0], rows[-1] + 1)
    travel = _centred(recording.wound_lengths()[stretch])
    frequency = np.sqrt(np.sum(recording.winch_speed[stretch] ** 2) / max(float(np.sum(travel**2)), 1e-300))
    natural = {unit: _lowest_natural_frequency(robot, GeometryReading(anchor_unit=unit)) for unit in ANCHOR_UNITS}
    by_time = {
        time_unit: tuple(unit for unit in natural if frequency / size <= MAX_QUASI_STATIC_SHARE * natural[unit])
        for time_unit, size in TIME_UNITS.items()
    }
    return {time_unit: units for time_unit, units in by_time.items() if units}


def _lowest_natural_frequency(robot: Robot, geometry: GeometryReading) -> float:
    """Lowest natural angular frequency at the start, rad/s."""
    axes, mass = list(robot.axes_in_plane), robot.platform.mass
    lengths, directions = (values[0] for values in geometry.directions(robot, np.full((1, len(AXES)), np.nan)))
    stiffness, tension = np.zeros((len(AXES), len(AXES))), mass * robot.gravity / robot.cable_count
    for cable, length, direction in zip(robot.cables, lengths, directions, strict=True):
        along = np.outer(direction, direction)
        stiffness += (cable.modulus * cable.area * along + tension * (np.eye(len(AXES)) - along)) / length
    return float(np.sqrt(max(np.linalg.eigvalsh(stiffness[np.ix_(axes, axes)])[0], 0.0) / mass))


def _misfit(lengths: Array, wound: Array, winding: WindingReading) -> float:
    """Rms of centred lengths plus travel, over that of the lengths, without the twentieth of rows that err most."""
    errors = lengths + np.array(winding.signs) * winding.factor * wound[:, winding.order]
    errors = errors - np.median(errors, axis=0)
    squares = np.sum(errors**2, axis=1)
    inliers = squares <= np.quantile(squares, 0.95)
    scale = float(np.sum(lengths[inliers] ** 2))
    return float(np.sqrt(squares[inliers].sum() / scale)) if scale > 0.0 else np.inf


def _centred(values: Array) -> Array:
    return np.asarray(values - values.mean(axis=0))
