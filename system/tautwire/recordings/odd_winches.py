"""Winches whose travel no reading of the recording mends: dead or clipped encoders, lost counts, a wrong exit point."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ..robot.schema import Robot
from .geometry_reading import GeometryReading, recorded_poses
from .motion_regression import centred, moving_rows
from .recording import Recording

Array = NDArray[np.float64]

# Rms of what a rope's length misses beside a constant and a scale, over that of its motion: stretch, drums and backlash
# stay below.
MAX_MISFIT, MAX_TOLD = 0.15, 3
# Cables that hardly move count as if they moved by this share of the rms of all.
LEAST_MOTION = 0.3
INLIER_QUANTILE = 0.95
# A cause leaves at most this share of the misfit, and of the cable's motion.
MAX_MISFIT_LEFT, MAX_SHARE_LEFT = 0.25, 0.05
MAX_GAP_INTERVALS = 5.0
DRUM_SCALES = (0.7, 1.4)
MIN_HELD_SAMPLES, MIN_CLIPPED_SHARE, MIN_TAUT_SHARE = 20, 0.03, 0.2
SPEED_QUANTILE, MIN_SPIKE_RATIO = 0.99, 20.0


@dataclass(frozen=True)
class OddWinch:
    """A cable, counted from 1, whose rope misses by ``misfit`` of its motion, the likely cause and what mends it."""

    cable: int
    misfit: float
    cause: str
    remedy: str


@dataclass(frozen=True)
class _Travel:
    """Rows (M,) of a recording, their poses' rope lengths and the lengths wound, each (M, n) in m about their means."""

    recording: Recording
    rows: NDArray[np.int64]
    lengths: Array
    wound: Array

    @property
    def drift(self) -> Array:
        """What speeds that are off by a constant leave, (M,)."""
        return np.asarray(self.recording.time[self.rows] - self.recording.time[self.rows[0]])

    @property
    def motion(self) -> Array:
        """Rms of each cable's length, at least a share of that of all, (n,)."""
        squares = np.mean(self.lengths**2, axis=0)
        return np.asarray(np.sqrt(np.maximum(squares, LEAST_MOTION**2 * squares.mean())))

    def misfit(self, cable: int, *others: Array) -> float:
        """Rms of a cable's length beside constant, a drum's scale and other columns (M,), over that of its motion."""
        wound, length = self.wound[:, cable], self.lengths[:, cable]
        basis = np.column_stack([np.ones_like(wound), wound, *others])
        scale = float(np.clip(-np.linalg.lstsq(basis, length, rcond=None)[0][1], *DRUM_SCALES))
        others_alone, missed = np.delete(basis, 1, axis=1), length + scale * wound
        squares = (missed - others_alone @ np.linalg.lstsq(others_alone, missed, rcond=None)[0]) ** 2
        inliers = squares <= np.quantile(squares, INLIER_QUANTILE)
        return float(np.sqrt(squares[inliers].mean()) / self.motion[cable])


def odd_winches(robot: Robot, recording: Recording) -> tuple[OddWinch, ...]:
    """Cables whose geometric length does not follow what was wound, for a cause that is seen; the three worst first.

    Each cable is judged by itself, by least squares of its length on the travel of its winch. What happened while
    nothing was recorded is not judged, and what has no such cause is left to the trace: soft ropes swing.
    """
    part = _longest_part(recording)
    rows = moving_rows(robot, part)
    if rows is None:
        return ()
    lengths = centred(GeometryReading().directions(robot, recorded_poses(part, rows))[0])
    travel = _Travel(part, rows, lengths, centred(part.wound_lengths()[rows]))
    misfits = [travel.misfit(cable) for cable in range(part.cable_count)]
    odd = sorted((cable for cable, misfit in enumerate(misfits) if misfit > MAX_MISFIT), key=lambda c: -misfits[c])
    # What a delay leaves is proportional to the speed.
    late = [cable for cable in odd if travel.misfit(cable, part.winch_speed[rows, cable]) <= MAX_MISFIT]
    causes = ((cable, _fault(travel, cable)) for cable in odd if cable not in late)
    faults = [OddWinch(cable + 1, misfits[cable], *texts) for cable, texts in causes if texts]
    # Where every exit point seems to be wrong it is another robot, or another frame.
    if not faults and len(odd) < part.cable_count:
        steady = [cable for cable in odd if travel.misfit(cable, travel.drift) > MAX_MISFIT]
        points = ((cable, _exit_point(robot, travel, cable)) for cable in steady)
        faults = [OddWinch(cable + 1, misfits[cable], *texts) for cable, texts in points if texts]
    return tuple(faults[:MAX_TOLD])


def _longest_part(recording: Recording) -> Recording:
    steps = np.diff(recording.time)
    edges = [0, *(np.flatnonzero(steps > MAX_GAP_INTERVALS * np.median(steps)) + 1), recording.sample_count]
    return recording.part(*max(pairwise(edges), key=lambda rows: rows[1] - rows[0]))


def _fault(travel: _Travel, cable: int) -> tuple[str, str] | None:
    """The fault of a winch's column, as a clause, and what mends it; None where none is seen."""
    speeds, name = travel.recording.winch_speed, f"winch_speed_{cable + 1}"
    speed = speeds[:, cable]
    for other in range(speeds.shape[1]):
        differ = np.sqrt(np.mean((travel.lengths[:, cable] - travel.lengths[:, other]) ** 2))
        if differ > MAX_MISFIT * travel.motion[cable] and np.any(speed) and np.array_equal(speed, speeds[:, other]):
            return f"{name} repeats winch_speed_{other + 1}", f"record {name}"
    if held := _held_stretch(travel, cable):
        first, last = (f"{travel.recording.time[row]:.5g}" for row in held)
        return f"{name} stays at {speed[held[0]]:.4g} from {first} to {last} s", f"record {name}, or cut that part out"
    for limit in (speed.max(), speed.min()):
        count = int(np.count_nonzero(speed == limit))
        if limit and count > MIN_CLIPPED_SHARE * len(speed):
            return f"{name} is clipped at {limit:.4g} in {count} samples", f"record {name} in its whole range"
    if np.max(np.abs(speed)) > MIN_SPIKE_RATIO * (usual := float(np.quantile(np.abs(speed), SPEED_QUANTILE))) > 0.0:
        cause = f"{name} reaches {np.max(np.abs(speed)):.3g} m/s, and stays below {usual:.3g} in 99 % of all samples"
        return f"{cause}, as where counts wrap", f"leave these samples empty, or record rope_length_{cable + 1}"
    if np.any(speed) and not np.any(speed < 0.0):
        return f"{name} is never negative", f"record {name} with its sign, negative where the rope pays out"
    if jump := _jump(travel, cable):
        time, length = jump
        cause = f"its rope is {abs(length):.3g} m {'shorter' if length < 0.0 else 'longer'} from {time:.5g} s on"
        return f"{cause}, as where counts are lost, samples left out or the tracker moved", "cut the recording there"
    return None


def _held_stretch(travel: _Travel, cable: int) -> tuple[int, int] | None:
    """First and last row of the longest stretch with one speed in which a taut rope's length changes otherwise."""
    is_held = np.concatenate([[0], (np.diff(travel.recording.winch_speed[:, cable]) == 0.0).astype(int), [0]])
    edges = np.flatnonzero(np.diff(is_held))
    stretches = sorted(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True), key=lambda rows: rows[0] - rows[1])
    for first, last in stretches:
        if last - first < MIN_HELD_SAMPLES:
            break
        missed = (travel.lengths + travel.wound)[(travel.rows >= first) & (travel.rows <= last), cable]
        if missed.size < 2:
            continue
        # A rope that is longer than its line may be slack, unless its load cell says otherwise.
        shorter = missed[0] - missed.min() if _is_taut(travel.recording.tension[first:last, cable]) else 0.0
        if max(missed.max() - missed[0], shorter) > travel.motion[cable]:
            return first, last
    return None


def _is_taut(tension: Array) -> bool:
    measured = tension[np.isfinite(tension)]
    return bool(measured.size and measured.min() > MIN_TAUT_SHARE * np.median(measured))


def _jump(travel: _Travel, cable: int) -> tuple[float, float] | None:
    """Time (s) and size (m) of one step that explains what a rope's length misses."""
    missed = (travel.lengths + travel.wound)[:, cable]
    before, after = (_running_mean(each) for each in (missed, missed[::-1]))
    counts = np.arange(1, len(missed))
    steps = after[::-1][1:] - before[:-1]
    row = int(np.argmax(steps**2 * counts * (len(missed) - counts))) + 1
    is_after = (np.arange(len(missed)) >= row).astype(float)
    misfits = travel.misfit(cable, travel.drift, is_after), travel.misfit(cable, travel.drift)
    is_explained = _is_explained(*misfits)
    return (float(travel.recording.time[travel.rows[row]]), float(steps[row - 1])) if is_explained else None


def _running_mean(values: Array) -> Array:
    return np.asarray(np.cumsum(values) / np.arange(1, len(values) + 1))


def _exit_point(robot: Robot, travel: _Travel, cable: int) -> tuple[str, str] | None:
    """The exit point with which a rope's length follows its winch; None of a rigid platform, or where none does."""
    if robot.platform.is_rigid_body:
        return None
    declared, poses = np.array(robot.anchors[cable], dtype=float), recorded_poses(travel.recording, travel.rows)
    free = list(robot.axes_in_plane)

    def missed(change: Array) -> Array:
        point = declared.copy()
        point[free] += change
        cables = list(robot.cables)
        cables[cable] = replace(cables[cable], anchor=tuple(point.tolist()))
        moved = GeometryReading().directions(replace(robot, cables=tuple(cables)), poses)[0][:, cable]
        return np.asarray(np.nan_to_num(moved - moved.mean() + travel.wound[:, cable]))

    fit = least_squares(missed, np.zeros(len(free)), loss="soft_l1", f_scale=0.1 * travel.motion[cable])
    left = float(np.sqrt(np.mean(missed(fit.x) ** 2))) / travel.motion[cable]
    if not _is_explained(left, travel.misfit(cable)):
        return None
    declared[free] += fit.x
    written = ", ".join(f"{coordinate:.4g}" for coordinate in declared)
    return f"its exit point fits at about [{written}] m", f"correct cable[{cable + 1}].anchor in the robot file"


def _is_explained(left: float, misfit: float) -> bool:
    return left <= min(MAX_MISFIT_LEFT * misfit, MAX_SHARE_LEFT)
