"""The balance of forces and moments on the platform, in blocks of a recording: what load cells should carry."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import AXES, Robot
from .alternative_readings import TIME_UNITS, WindingReading
from .geometry_reading import GeometryReading, RecordedPoses
from .inertial_wrench import balance_matrices, inertial_wrenches
from .recording import Recording
from .sensor_gaps import bridge_short_gaps
from .units import UNITS
from .white_noise_estimate import white_noise_deviation

Array = NDArray[np.float64]

MIN_SIGNAL_NOISE_RATIO = 5.0
BLOCK_DURATION = 0.25  # s; forces are averaged over it
MAX_BLOCK_STRETCH = 1.5  # a longer block spans a gap
MIN_BLOCKS = 4
MAX_BLOCKS = 400
MIN_SEEN_SHARE = 0.1  # of the weight, in the directions that load cells see
MAX_UNSEEN_TRAVEL = 0.05  # of a rope: without positions the platform counts as at the start until it was reeled

FORCE_UNITS = {
    unit.symbol: unit.to_si(1.0) for unit in UNITS["force"] if unit.symbol in ("N", "kN", "mN", "daN", "kg", "g", "lbf")
}


@dataclass(frozen=True)
class ForceBalance:
    """B blocks of the balance ``sum_i T_i u_i = m (a + g)``, without the directions of cables that have no load cell.

    ``directions`` (B, d, n), ``tensions`` (B, n) as read, 0 where there is no load cell, ``required`` (B, d) in N;
    ``time`` (B,) in s of the middles. d is 3, or 6 of a rigid platform whose orientation was recorded: the last three
    are moments about its centre of mass over its size.
    """

    time: Array
    directions: Array
    tensions: Array
    required: Array
    has_load_cell: tuple[bool, ...]

    @property
    def has_moments(self) -> bool:
        """Whether moments are balanced beside forces."""
        return self.directions.shape[1] > len(AXES)

    def balanced_tensions(self) -> Array:
        """The balanced tensions nearest to the measured ones, (B, n) in N, NaN where there is no load cell."""
        unbalanced = self.required - self.forces(tuple(range(len(self.has_load_cell))))
        corrections = np.einsum("bic,bc->bi", np.linalg.pinv(self.directions), unbalanced)
        return np.where(self.has_load_cell, self.tensions + corrections, np.nan)

    def carried(self, order: tuple[int, ...]) -> float:
        """The part of the required wrench that the tensions, read in this order, carry; 1 where they are right."""
        return float(np.sum(self.forces(order) * self.required) / np.sum(self.required**2))

    def misfit(self, order: tuple[int, ...], factor: float = 1.0) -> float:
        """Rms of what is not balanced, over that of the required wrench."""
        unbalanced = factor * self.forces(order) - self.required
        return float(np.sqrt(np.sum(unbalanced**2) / np.sum(self.required**2)))

    def explains_beside_zeros(self, max_misfit: float) -> bool:
        """Whether tensions balance to a misfit where each load cell may show a number of its own without load.

        And to half of what is left without them, so that numbers that are no tensions do not.
        """
        ones, declared = np.ones_like(self.tensions), tuple(range(len(self.has_load_cell)))
        _, misfit = self._balancing_factors(ones, self.required - self.forces(declared))
        _, misfit_without = self._balancing_factors(ones, self.required)
        return misfit < min(max_misfit, 0.5 * misfit_without)

    def explains_by_gains(self, factor: float, max_error: float, max_misfit: float) -> bool:
        """Whether tensions times a factor balance to a misfit if each load cell has a gain that is off by no more."""
        gains, misfit = self._balancing_factors(factor * self.tensions, self.required)
        return misfit <= max_misfit and float(np.max(np.abs(gains - 1.0))) < max_error

    def _balancing_factors(self, tensions: Array, wrenches: Array) -> tuple[Array, float]:
        """Factors of the tensions (B, n), one for each load cell, that balance the wrenches (B, d) best; and a misfit.

        That is the rms of what is left, over that of the required wrench.
        """
        pulls = (self.directions * tensions[:, None, :])[:, :, np.array(self.has_load_cell)]
        shapes = pulls.reshape(-1, pulls.shape[2])
        factors = np.asarray(np.linalg.lstsq(shapes, wrenches.ravel(), rcond=None)[0], dtype=float)
        return factors, float(np.linalg.norm(wrenches.ravel() - shapes @ factors) / np.linalg.norm(self.required))

    def best_factor(self, order: tuple[int, ...]) -> float:
        """The factor on all tensions that balances best; 0 where none does."""
        forces = self.forces(order)
        energy = float(np.sum(forces**2))
        return float(np.sum(forces * self.required)) / energy if energy > 0.0 else 0.0

    def pulls(self, factor: float) -> bool:
        """Whether ropes pull, as they do, where tensions are multiplied by this factor."""
        return factor * float(self.tensions.sum()) > 0.0

    def tension_to_weight(self, factor: float = 1.0) -> float:
        """Rms of all tensions together, times a factor, over that of the required wrench."""
        return abs(factor) * float(np.sqrt(np.sum(self.tensions**2) / np.sum(self.required**2)))

    def forces(self, order: tuple[int, ...]) -> Array:
        """What the tensions, read in this order, exert, (B, d)."""
        return np.asarray(np.einsum("bci,bi->bc", self.directions, self.tensions[:, order]))


def force_balance(
    robot: Robot, recording: Recording, geometry: GeometryReading, winding: WindingReading
) -> ForceBalance | None:
    """The balance of forces and moments in blocks of a quarter second; None where too few are whole or seen."""
    has_load_cell = np.asarray(np.isfinite(recording.tension).any(axis=0))
    block_means = _block_means(robot, recording, winding)
    if block_means is None or not _is_more_than_noise(recording.tension):
        return None
    time, poses, tensions, duration = block_means
    # The second difference of means is the acceleration seen through a B-spline, and so are the forces beside it.
    required = inertial_wrenches(robot, geometry, poses, duration)
    tensions = (tensions[2:] + 4.0 * tensions[1:-1] + tensions[:-2]) / 6.0
    directions = balance_matrices(robot, geometry, poses)[1:-1]
    is_complete = np.isfinite(required).all(axis=1) & np.isfinite(tensions[:, has_load_cell]).all(axis=1)
    if np.count_nonzero(is_complete) < MIN_BLOCKS:
        return None
    tensions, directions = np.where(has_load_cell, tensions, 0.0)[is_complete], directions[is_complete]
    projection = _without_directions(directions[:, :, np.logical_not(has_load_cell)])
    required = required[is_complete]
    required = np.einsum("bij,bj->bi", projection, required)
    weight = robot.platform.mass * robot.gravity
    if not np.sqrt(np.mean(np.sum(required**2, axis=1))) > MIN_SEEN_SHARE * weight > 0.0:
        return None
    cells = tuple(map(bool, has_load_cell))
    return ForceBalance(time[1:-1][is_complete], projection @ directions, tensions, required, cells)


def _block_means(
    robot: Robot, recording: Recording, winding: WindingReading
) -> tuple[Array, RecordedPoses, Array, float] | None:
    """Middles of blocks (B,) in s, means of poses (B,) and tensions (B, n), and the duration of a block in s."""
    interval = float(np.median(np.diff(recording.time))) * TIME_UNITS[winding.time_unit]
    size = max(1, round(BLOCK_DURATION / interval))
    rows = min(recording.sample_count, MAX_BLOCKS * size)
    if not np.isfinite(recording.position[:, robot.axes_in_plane]).any(axis=0).all():
        travel = np.abs(winding.factor * recording.wound_lengths()).max(axis=1)
        lengths = [math.dist(anchor, robot.platform.start) for anchor in robot.anchors]
        rows = min(rows, int(np.argmax(travel > MAX_UNSEEN_TRAVEL * min(lengths))) or rows)
    count = rows // size
    if count < MIN_BLOCKS:
        return None
    starts = recording.time[: count * size : size] * TIME_UNITS[winding.time_unit]
    spans_gap = np.append(np.diff(starts) > MAX_BLOCK_STRETCH * size * interval, False)
    # Of a sensor slower than the log the mean of its samples would not be that of the block's middle, which a second
    # difference needs; one slower than the blocks would leave some without a sample.
    used = slice(count * size)
    means = []
    for values in (recording.position, recording.orientation, recording.tension):
        blocks = bridge_short_gaps(recording.time[used], values[used]).reshape(count, size, -1)
        counts = np.isfinite(blocks).sum(axis=1)
        mean = np.nansum(blocks, axis=1) / np.where(counts > 0, counts, np.nan)
        means.append(np.where(spans_gap[:, None], np.nan, mean))
    orientation = means[1] / np.linalg.norm(means[1], axis=1, keepdims=True)
    return starts + 0.5 * size * interval, RecordedPoses(means[0], orientation), means[2], size * interval


def _is_more_than_noise(tension: Array) -> bool:
    """Whether load cells show forces: the rest after taring at a standstill is noise and drift."""
    measured = tension[np.isfinite(tension)]
    if not measured.size:
        return False
    noise = white_noise_deviation(tension)
    return bool(np.median(np.abs(measured)) > MIN_SIGNAL_NOISE_RATIO * (noise if np.isfinite(noise) else 0.0))


def _without_directions(directions: Array) -> Array:
    """Projections (B, d, d) onto what is perpendicular to vectors (B, d, k)."""
    return np.asarray(np.eye(directions.shape[1]) - directions @ np.linalg.pinv(directions))
