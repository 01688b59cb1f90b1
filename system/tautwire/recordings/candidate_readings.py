"""Candidate readings of a recording: units, axes, signs and orders that its winch travel and positions may have."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from ..robot.schema import Robot
from .alternative_readings import ANCHOR_UNITS, ATTACHMENT_UNITS, LENGTH_UNITS, SPEED_UNITS, TIME_UNITS, WindingReading
from .geometry_reading import GeometryReading, QuaternionReading, signed_axes
from .motion_regression import moves_along_two_axes

Array = NDArray[np.float64]

# Units err from the nearest one by less, drums included; within the second none but the unit is likely.
MIN_UNIT_RATIO, MAX_UNIT_ERROR = 1.25, 0.01
# Cables whose winches show angles have one ratio.
MAX_RATIO_SPREAD = 0.03
# Ratios of geometric to wound lengths that drums and ropes that give may have, whatever the unit.
GIVING_ROPES = (0.5, 4.0)
# Beyond the ratio it is a gear's if it leaves this share of what is missed at most.
MIN_GEAR_RATIO, MAX_GEAR_SHARE = 1.25, 0.1
PLANE = 2  # axes, of which one in another unit is the other one in that of both
LONG_TIME_UNITS = ("min", "h", "d")
SAMPLE_INTERVALS = (5e-5, 0.5)  # s, of recordings


def geometry_readings(robot: Robot) -> Iterator[GeometryReading]:
    """The declared reading first; then other units, signed axes, and both, or one axis in another unit.

    Of rigid platforms also other poses, and attachments in another unit.
    """
    for axes, signs in signed_axes():
        # A coordinate across the plane is not read, whatever its sign.
        is_other = any(sign < 0 for axis, sign in enumerate(signs) if axis not in robot.axes_in_plane)
        for unit in () if is_other else LENGTH_UNITS:
            yield GeometryReading(unit, "m", axes, signs)
    for unit in ANCHOR_UNITS[1:]:
        yield GeometryReading(anchor_unit=unit)
    if not robot.platform.is_rigid_body:
        yield GeometryReading("mm", anchor_unit="mm")
    for unit, odd_axis, odd_unit in product(LENGTH_UNITS, robot.axes_in_plane, LENGTH_UNITS):
        if unit != odd_unit and (unit == "m" or len(robot.axes_in_plane) > PLANE):
            yield GeometryReading(unit, odd_axis=odd_axis, odd_unit=odd_unit)
    if robot.platform.is_rigid_body:
        for unit in ATTACHMENT_UNITS:
            yield from pose_readings(robot, unit)
        for unit, attachment_unit in product(ATTACHMENT_UNITS, ATTACHMENT_UNITS[1:]):
            yield GeometryReading(unit, attachment_unit=attachment_unit)


def pose_readings(robot: Robot, position_unit: str = "m") -> Iterator[GeometryReading]:
    """Readings of a rigid platform's pose: the order and the sense of quaternions, and positions of its centre of mass.

    The declared one is not among them.
    """
    for is_centre, is_last, is_inverse in product((False, True), repeat=3):
        if (is_centre or is_last or is_inverse) and not (is_centre and not any(robot.platform.centre_of_mass)):
            quaternion = QuaternionReading(is_last, is_inverse)
            yield GeometryReading(position_unit, quaternion=quaternion, is_centre_of_mass=is_centre)


def winding_readings(lengths: Array, wound: Array, interval: float) -> Iterator[WindingReading]:
    """Units, signs and orders that the slopes of centred lengths on centred travel suggest, each (N, n)."""
    count = lengths.shape[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = np.nan_to_num(-(lengths.T @ wound) / np.sum(wound**2, axis=0))
        energies = np.sqrt(np.outer(np.sum(lengths**2, axis=0), np.sum(wound**2, axis=0)))
        correlations = np.nan_to_num((lengths.T @ wound) / energies)
    assigned = tuple(int(column) for column in linear_sum_assignment(-(correlations**2))[1])
    for order in dict.fromkeys((tuple(range(count)), assigned)):
        by_cable = slopes[np.arange(count), order]
        moving = np.abs(by_cable[by_cable != 0.0])
        if not moving.size:
            continue
        signs = tuple(-1 if slope < 0.0 else 1 for slope in by_cable)
        ratio = float(np.median(moving))
        units = [
            (time_unit, speed_unit)
            for time_unit, speed_unit in product(TIME_UNITS, SPEED_UNITS)
            if (speed_unit == "m/s" or time_unit not in LONG_TIME_UNITS)
            and 1.0 / MIN_UNIT_RATIO < ratio / (TIME_UNITS[time_unit] * SPEED_UNITS[speed_unit]) < MIN_UNIT_RATIO
        ]
        for time_unit, speed_unit in units:
            yield WindingReading(time_unit, speed_unit, signs, order)
        sizes = [TIME_UNITS[time_unit] * SPEED_UNITS[speed_unit] for time_unit, speed_unit in units]
        is_unit = any(abs(ratio / size - 1.0) <= MAX_UNIT_ERROR for size in sizes)
        is_of_angle = not GIVING_ROPES[0] < ratio < GIVING_ROPES[1] and np.ptp(moving) <= MAX_RATIO_SPREAD * ratio
        if not is_unit and (is_of_angle or _is_of_gear(lengths, np.array(signs) * wound[:, order], ratio)):
            for time_unit, size in TIME_UNITS.items():
                if SAMPLE_INTERVALS[0] <= interval * size <= SAMPLE_INTERVALS[1]:
                    yield WindingReading(time_unit, None, signs, order, ratio / size)


def _is_of_gear(lengths: Array, wound: Array, ratio: float) -> bool:
    """Whether a ratio of centred lengths to travel, each (N, n), is that of a gear, and not what ropes give."""
    if 1.0 / MIN_GEAR_RATIO < ratio < MIN_GEAR_RATIO:
        return False
    missed, without = np.linalg.norm(lengths + ratio * wound), np.linalg.norm(lengths + wound)
    return bool(missed <= MAX_GEAR_SHARE * without) and moves_along_two_axes(lengths)


def are_of_one_system(geometry: GeometryReading, winding: WindingReading) -> bool:
    """Whether positions and winches may be in these units at once: rare ones of both only where they are alike."""
    if geometry.position_unit == geometry.anchor_unit != "m":
        # The winches' scale is then that of anchors and positions.
        return winding.factor == 1.0
    if geometry.attachment_unit != "m":
        # Beside distant anchors, poses and winches in a thousandth of the unit fit almost as well.
        return winding.factor == 1.0
    if winding.speed_unit in ("in/s", "ft/s") and geometry.position_unit == "m":
        return geometry == GeometryReading()
    is_rare = geometry.odd_axis is not None or geometry.position_unit in ("um", "in", "ft")
    return not is_rare or winding.speed_unit in ("m/s", f"{geometry.position_unit}/s")
