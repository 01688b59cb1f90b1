"""Regression of geometric rope lengths, by recorded poses, on the lengths that the winches wound."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..robot.rigid_equilibrium import platform_size
from ..robot.schema import AXES, Robot
from .alternative_readings import ANCHOR_UNITS, ATTACHMENT_UNITS, TIME_UNITS, WindingReading
from .geometry_reading import GeometryReading, RecordedPoses, recorded_poses, turned, unturned
from .recording import Recording
from .white_noise_estimate import white_noise_deviation

Array = NDArray[np.float64]

# Share of the lowest natural frequency up to which the platform follows the winches.
MAX_QUASI_STATIC_SHARE = 0.5
# Of squares of natural frequencies to the largest: in modes below, the platform swings and hardly stretches ropes.
MIN_STRETCHING_RATIO = 1e-4
MIN_MOTION_NOISE_RATIO = 20.0
MIN_SECOND_MOTION = 0.05  # of singular values of motion, to the largest
MAX_ROWS, ROWS_USED, MIN_ROWS = 8000, 1000, 10
# Quantile of rows that count: the others may be outliers.
INLIER_QUANTILE = 0.95
# Of the median interval: what a winch does in a longer one is unknown.
MAX_GAP_INTERVALS = 5.0


@dataclass(frozen=True)
class RopeMotion:
    """Geometric rope lengths (M, n) in m about their means, and the least scale (M,) in m^2 of what they miss.

    The scale of a rigid platform is that of its motion along an axis, since ropes need not change in length where it
    swings; of a point mass it is 0.
    """

    lengths: Array
    least_scale: Array

    def misfit(self, wound: Array, winding: WindingReading) -> float:
        """Rms of lengths plus centred travel (M, n), over that of the lengths, without the twentieth that errs most."""
        errors = self.lengths + np.array(winding.signs) * winding.factor * wound[:, winding.order]
        errors = errors - np.median(errors, axis=0)
        squares = np.sum(errors**2, axis=1)
        inliers = squares <= np.quantile(squares, INLIER_QUANTILE)
        scale = max(float(np.sum(self.lengths[inliers] ** 2)), float(np.sum(self.least_scale[inliers])))
        return float(np.sqrt(squares[inliers].sum() / scale)) if scale > 0.0 else np.inf


def rope_motion(robot: Robot, geometry: GeometryReading, poses: RecordedPoses) -> RopeMotion:
    """Motion of the ropes by poses as they are read."""
    lengths = centred(geometry.directions(robot, poses)[0])
    if not robot.platform.is_rigid_body:
        return RopeMotion(lengths, np.zeros(len(lengths)))
    positions, quaternions = geometry.positions(robot, poses), geometry.orientations(robot, poses)
    read = geometry.robot(robot)
    # A platform whose attachments are farther out than its anchors is no measure of motion, but another unit.
    size = min(platform_size(read), float(np.min(np.linalg.norm(np.array(read.anchors) - read.platform.start, axis=1))))
    angles_squared = np.sum((2.0 * centred(quaternions)) ** 2, axis=1)
    moved = np.sum(centred(positions) ** 2, axis=1) + size**2 * angles_squared
    # Nor is one outside of its robot, whose ropes hardly change in length by what it moves across them.
    if np.mean(np.sum((positions - read.platform.start) ** 2, axis=1)) > robot_size(read) ** 2:
        moved = np.zeros_like(moved)
    return RopeMotion(lengths, robot.cable_count * moved / len(AXES))


@dataclass(frozen=True)
class LengthRegression:
    """Centred geometric rope lengths on centred wound ones, both (M, n) in m, of ``rows``: slopes and misfits, (n,).

    A slope is the shortening by what was reeled in, 1 where both agree.
    """

    rows: NDArray[np.int64]
    lengths: Array
    wound: Array
    slopes: Array
    misfits: Array


def length_regression(robot: Robot, recording: Recording) -> LengthRegression | None:
    """Regression, cable by cable, of a recording as it is declared.

    None where the winches or the platform hardly move, and where poses are not known.
    """
    rows = moving_rows(robot, recording)
    if rows is None:
        return None
    motion, wound = (
        rope_motion(robot, GeometryReading(), recorded_poses(recording, rows)),
        wound_lengths_in(rows, recording),
    )
    single = WindingReading(signs=(1,), order=(0,))
    misfits = [
        RopeMotion(motion.lengths[:, [cable]], motion.least_scale / robot.cable_count).misfit(wound[:, [cable]], single)
        for cable in range(robot.cable_count)
    ]
    energies = np.sum(wound**2, axis=0)
    slopes = -np.sum(motion.lengths * wound, axis=0) / np.where(energies > 0.0, energies, np.nan)
    return LengthRegression(rows, motion.lengths, wound, slopes, np.array(misfits))


def wound_lengths_in(rows: NDArray[np.int64], recording: Recording) -> Array:
    """Lengths that the winches have reeled in at these rows about their means, (M, n) in m."""
    return centred(recording.wound_lengths()[rows])


def moving_rows(robot: Robot, recording: Recording) -> NDArray[np.int64] | None:
    """Rows with poses, evenly spaced in the stretch without gaps where winches move most; None where none do.

    None too where a rigid platform's orientation was not recorded, without which ropes have no known lengths.
    """
    wound, is_rigid = recording.wound_lengths(), robot.platform.is_rigid_body
    pose = np.hstack([recording.position, recording.orientation]) if is_rigid else recording.position
    measured = np.asarray(np.isfinite(pose).any(axis=0))
    needed = [*robot.axes_in_plane, *range(len(AXES), pose.shape[1])]
    # A platform may swing while its winches stand, and its ropes then keep their lengths.
    if (is_rigid and not measured[needed].all()) or not (is_rigid or np.any(wound)):
        return None
    if np.count_nonzero(measured) < len(robot.axes_in_plane):
        return None
    travel = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(wound, axis=0)).sum(axis=1))])
    begin, end = max(gapless_parts(recording.time), key=lambda part: travel[part[1] - 1] - travel[part[0]])
    first = begin
    if end - begin > MAX_ROWS:
        first += int(np.argmax(travel[begin + MAX_ROWS : end] - travel[begin : end - MAX_ROWS]))
    stretch = np.arange(first, min(first + MAX_ROWS, end))
    rows = stretch[np.isfinite(pose[stretch][:, measured]).all(axis=1)]
    if rows.size < MIN_ROWS or not (
        _moves(recording.position, rows) or (is_rigid and _moves(recording.orientation, rows))
    ):
        return None
    return rows[:: max(1, rows.size // ROWS_USED)]


def gapless_parts(time: Array) -> list[tuple[int, int]]:
    """First row and end of each part of times (N,) between gaps."""
    steps = np.diff(time)
    edges = [0, *(np.flatnonzero(steps > MAX_GAP_INTERVALS * np.median(steps)) + 1).tolist(), len(time)]
    return list(pairwise(edges))


def moves_along_two_axes(lengths: Array) -> bool:
    """Whether centred lengths (M, n) vary along more than one direction: along another, ropes give otherwise.

    False where poses inside a pulley have no lengths.
    """
    if not np.isfinite(lengths).all():
        return False
    first, second = np.linalg.svd(lengths, compute_uv=False)[:2]
    return bool(second >= MIN_SECOND_MOTION * first)


def _moves(signals: Array, rows: NDArray[np.int64]) -> bool:
    """Whether signals (N, k) vary in these rows by far more than their noise."""
    moved = np.sqrt(np.mean(np.var(signals[rows][:, np.isfinite(signals).any(axis=0)], axis=0)))
    noise = white_noise_deviation(signals)
    return bool(moved > MIN_MOTION_NOISE_RATIO * (noise if np.isfinite(noise) else 0.0))


def quasi_static_units(robot: Robot, recording: Recording, rows: NDArray[np.int64]) -> dict[str, tuple[str, ...]]:
    """Units of anchors, by that of time, with which the winches move too slowly to excite the lowest mode."""
    frequency = _winch_frequency(recording, rows)
    natural = {unit: lowest_frequency(robot, unit) for unit in ANCHOR_UNITS}
    by_time = {
        time_unit: tuple(unit for unit in natural if frequency / size <= MAX_QUASI_STATIC_SHARE * natural[unit])
        for time_unit, size in TIME_UNITS.items()
    }
    return {time_unit: units for time_unit, units in by_time.items() if units}


def dynamic_amplification(robot: Robot, recording: Recording, rows: NDArray[np.int64]) -> float:
    """Share ``r^2 / (1 - r^2)`` by which a platform overshoots; r is the frequency of the winches to the lowest mode's.

    Infinite where the motion is not quasi-static.
    """
    natural = lowest_frequency(robot, "m")
    ratio = _winch_frequency(recording, rows) / natural if natural > 0.0 else np.inf
    return float(ratio**2 / (1.0 - ratio**2)) if ratio <= MAX_QUASI_STATIC_SHARE else np.inf


def _winch_frequency(recording: Recording, rows: NDArray[np.int64]) -> float:
    """Angular frequency of the winches in their stretch of rows, rad/s: rms of speed over that of travel."""
    stretch = slice(rows[0], rows[-1] + 1)
    travel = centred(recording.wound_lengths()[stretch])
    return float(np.sqrt(np.sum(recording.winch_speed[stretch] ** 2) / max(float(np.sum(travel**2)), 1e-300)))


def lowest_frequency(robot: Robot, anchor_unit: str) -> float:
    """Lowest angular frequency that winches excite, rad/s; of a rigid platform with attachments in any unit."""
    if not robot.platform.is_rigid_body:
        return _lowest_natural_frequency(robot, GeometryReading(anchor_unit=anchor_unit))
    readings = (GeometryReading(anchor_unit=anchor_unit, attachment_unit=unit) for unit in ATTACHMENT_UNITS)
    return max(_lowest_elastic_frequency(robot, reading) for reading in readings)


def _at_start(robot: Robot, geometry: GeometryReading) -> tuple[Array, Array]:
    """Rope lengths (n,) in m and directions (n, 3) at the declared start; NaN where that is inside a pulley."""
    lengths, directions = geometry.directions(robot, unturned(np.full((1, len(AXES)), np.nan)))
    return lengths[0], directions[0]


def _lowest_natural_frequency(robot: Robot, geometry: GeometryReading) -> float:
    """Lowest natural angular frequency of a point mass at the start, rad/s.

    Of ropes ``E A / L`` under the tension ``m g / n`` each.
    """
    lengths, directions = _at_start(robot, geometry)
    if not np.isfinite(lengths).all():
        return 0.0
    axes, mass = list(robot.axes_in_plane), robot.platform.mass
    stiffness, tension = np.zeros((len(AXES), len(AXES))), mass * robot.gravity / robot.cable_count
    for cable, length, direction in zip(robot.cables, lengths, directions, strict=True):
        along = np.outer(direction, direction)
        stiffness += (cable.modulus * cable.area * along + tension * (np.eye(len(AXES)) - along)) / length
    return float(np.sqrt(max(np.linalg.eigvalsh(stiffness[np.ix_(axes, axes)])[0], 0.0) / mass))


def _lowest_elastic_frequency(robot: Robot, geometry: GeometryReading) -> float:
    """Lowest angular frequency at the start, rad/s, of the modes of a rigid platform that stretch its ropes.

    Of ropes ``E A / L``; modes in which it swings on ropes that keep their lengths do not count.
    """
    # Imported here: it takes long to import, and only rigid platforms need it.
    from scipy.linalg import eigh

    lengths, directions = _at_start(robot, geometry)
    if not np.isfinite(lengths).all():
        return 0.0
    platform = geometry.robot(robot).platform
    orientation = np.array([platform.start_orientation])
    rotation = np.column_stack(
        [turned(orientation, axis)[0] for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
    )
    arms = (np.array(geometry.robot(robot).attachments) - platform.centre_of_mass) @ rotation.T
    structure = np.vstack([directions.T, np.cross(arms, directions).T])
    axial = np.array([cable.modulus * cable.area for cable in robot.cables]) / lengths
    inertia = np.zeros((structure.shape[0], structure.shape[0]))
    inertia[:3, :3] = platform.mass * np.eye(3)
    inertia[3:, 3:] = rotation @ np.array(platform.inertia) @ rotation.T
    squares = eigh(structure @ (axial[:, None] * structure.T), inertia, eigvals_only=True)
    return float(np.sqrt(np.min(squares[squares > MIN_STRETCHING_RATIO * squares[-1]])))


def robot_size(robot: Robot) -> float:
    """The largest distance between two of the exit points and the start, in m."""
    points = np.array([*robot.anchors, robot.platform.start])
    return float(np.max(np.linalg.norm(points[:, None] - points[None], axis=2)))


def centred(values: Array) -> Array:
    """Values (M, n) about their means."""
    return np.asarray(values - values.mean(axis=0))
