"""Winches whose travel no reading of the recording mends: dead or clipped encoders, lost counts, a wrong exit point."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ..robot.schema import Robot
from .alternative_readings import LENGTH_UNITS, SPEED_UNITS, Mistake, convert, factor_text, mistakes_text
from .column_corrections import ColumnCorrection, scaled
from .geometry_reading import GeometryReading, recorded_poses
from .motion_regression import centred, gapless_parts, moving_rows
from .recording import Recording

Array = NDArray[np.float64]
# The likely cause, as a clause, and what mends it.
Texts = tuple[str, str]

# Rms of what a rope's length misses beside a constant and a scale, over that of its motion: stretch, drums and backlash
# stay below.
MAX_MISFIT, MAX_TOLD = 0.15, 3
# Cables that hardly move count as if they moved by this share of the rms of all.
LEAST_MOTION = 0.3
INLIER_QUANTILE = 0.95
# A cause leaves at most this share of the misfit, and of the cable's motion.
MAX_MISFIT_LEFT, MAX_SHARE_LEFT = 0.25, 0.05
# Of an exit point's distance from the start. Less is left to the trace: a pulley moves the point by its radius or more,
# one of 24 mm by 7 % on a robot of 0.6 m.
MIN_MOVED, MAX_MOVED = 0.15, 2.0
DRUM_SCALES = (0.7, 1.4)
# Of a unit that is written otherwise, and of drums; what is farther off is an angle or a count.
MAX_UNIT_ERROR, WINCH_RATIOS = 0.03, (0.55, 1.8)
MIN_HELD_SAMPLES, MIN_TAUT_SHARE = 20, 0.2
# Of samples, and of the rope's speed to the one that is recorded in them.
MIN_CLIPPED_SHARE, MIN_CLIPPED_RATIO = 0.03, 1.2
SPEED_QUANTILE, MIN_SPIKE_RATIO = 0.99, 20.0


@dataclass(frozen=True)
class OddWinch:
    """A cable, counted from 1, whose rope misses by ``misfit`` of its motion, the likely cause and what mends it.

    ``is_factor`` where the cause is a factor on its winch's column.
    """

    cable: int
    misfit: float
    cause: str
    remedy: str
    is_factor: bool = False


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

    def is_length(self, cable: int) -> bool:
        """Whether a cable's rope length was recorded, of which its speed is the rate."""
        return cable + 1 in self.recording.rope_lengths

    def column(self, cable: int) -> str:
        """The recorded column of a cable's winch."""
        return f"rope_length_{cable + 1}" if self.is_length(cable) else f"winch_speed_{cable + 1}"

    def speed_name(self, cable: int) -> str:
        """What to call a cable's speed."""
        return f"the rate of {self.column(cable)}" if self.is_length(cable) else self.column(cable)

    def ratio(self, cable: int) -> float:
        """Length of a cable by what was wound, by least squares; 1 where nothing was."""
        wound = self.wound[:, cable]
        energy = float(wound @ wound)
        return -float(self.lengths[:, cable] @ wound) / energy if energy > 0.0 else 1.0

    def share_missed(self, cable: int, factor: float) -> float:
        """Rms of what a cable's length misses with a factor on what was wound, over that of its motion."""
        missed = self.lengths[:, cable] + factor * self.wound[:, cable]
        return float(np.sqrt(np.mean(missed**2)) / self.motion[cable])

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
    told = {cable: texts for cable in odd if (texts := _fault(travel, cable))}
    # Where no other cable follows its winch it is another robot or frame, or the platform swings.
    others = [misfit for cable, misfit in enumerate(misfits) if cable not in odd]
    if not told and max(others, default=1.0) <= MAX_SHARE_LEFT:
        told = {cable: texts for cable in odd if (texts := _exit_point(robot, travel, cable))}
    return tuple(
        OddWinch(cable + 1, misfits[cable], *texts, _is_factor(travel, cable)) for cable, texts in told.items()
    )[:MAX_TOLD]


def _longest_part(recording: Recording) -> Recording:
    return recording.part(*max(gapless_parts(recording.time), key=lambda rows: rows[1] - rows[0]))


def _fault(travel: _Travel, cable: int) -> Texts | None:
    """The fault of a winch's column, as a clause, and what mends it; None where none is seen."""
    faults = (_other_unit, _other_factor, _copied, _held, _clipped, _wrapped, _unsigned, _jump)
    return next((texts for fault in faults if (texts := fault(travel, cable))), None)


def _is_factor(travel: _Travel, cable: int) -> bool:
    """Whether a factor on the winch's column explains what its rope misses."""
    return _is_explained(travel.share_missed(cable, travel.ratio(cable)), travel.misfit(cable))


def _other_unit(travel: _Travel, cable: int) -> Texts | None:
    """A unit in which a rope's length follows its winch."""
    name, ratio = travel.column(cable), travel.ratio(cable)
    for unit, size in (LENGTH_UNITS if travel.is_length(cable) else SPEED_UNITS).items():
        is_near = size != 1.0 and abs(ratio / size - 1.0) <= MAX_UNIT_ERROR
        if is_near and _is_explained(travel.share_missed(cable, size), travel.misfit(cable)):
            mistake = Mistake(f"{name} is in {unit}", convert(name, size), scaled((name,), size, unit))
            return mistakes_text([[mistake]], travel.recording)
    return None


def _other_factor(travel: _Travel, cable: int) -> Texts | None:
    """A factor that no drum is off by, with which a rope's length follows its winch."""
    name, ratio = travel.column(cable), travel.ratio(cable)
    is_drums = WINCH_RATIOS[0] < ratio < WINCH_RATIOS[1]
    if is_drums or not _is_explained(travel.share_missed(cable, ratio), travel.misfit(cable)):
        return None
    # Where none follows its winch, the platform swings.
    if min(travel.misfit(each) for each in range(travel.wound.shape[1])) > MAX_MISFIT:
        return None
    sign = -1.0 if ratio < 0.0 else 1.0
    other_sign = f", and {name} has the other sign" if sign < 0.0 else ""
    cause = factor_text([name], abs(ratio), travel.is_length(cable)) + other_sign
    better = "or better by the factor that follows from the drum's radius and what is recorded in one turn of it"
    correction = ColumnCorrection(name, factor=float(f"{abs(ratio):.6g}"), sign=sign)
    return mistakes_text([[Mistake(cause, f"{convert(name, ratio)}, {better}", (correction,))]], travel.recording)


def _copied(travel: _Travel, cable: int) -> Texts | None:
    """One speed in two columns whose ropes move differently."""
    speeds, name = travel.recording.winch_speed, travel.column(cable)
    for other in range(speeds.shape[1]):
        differ = np.sqrt(np.mean((travel.lengths[:, cable] - travel.lengths[:, other]) ** 2))
        is_copy = np.array_equal(speeds[:, cable], speeds[:, other]) and np.ptp(speeds[:, cable]) > 0.0
        if is_copy and differ > MAX_MISFIT * travel.motion[cable]:
            return f"{name} repeats {travel.column(other)}", f"record {name}"
    return None


def _held(travel: _Travel, cable: int) -> Texts | None:
    """One speed for long while a taut rope's length changes otherwise."""
    speed, name = travel.recording.winch_speed[:, cable], travel.column(cable)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], (np.diff(speed) == 0.0).astype(int), [0]])))
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
            begin, end = (f"{travel.recording.time[row]:.5g}" for row in (first, last))
            cause = f"{travel.speed_name(cable)} stays at {speed[first]:.4g} from {begin} to {end} s"
            return cause, f"record {name}, or cut that part out"
    return None


def _is_taut(tension: Array) -> bool:
    measured = tension[np.isfinite(tension)]
    return bool(measured.size and measured.min() > MIN_TAUT_SHARE * np.median(measured))


def _clipped(travel: _Travel, cable: int) -> Texts | None:
    """A largest or smallest speed in many samples, in which the rope's length changes faster."""
    speed, name = travel.recording.winch_speed[:, cable], travel.column(cable)
    rate = -np.gradient(travel.lengths[:, cable], travel.recording.time[travel.rows])
    for limit in (float(speed.max()), float(speed.min())):
        is_clipped = speed == limit
        seen = rate[is_clipped[travel.rows]]
        is_frequent = bool(np.mean(is_clipped) > MIN_CLIPPED_SHARE and seen.size and limit)
        if is_frequent and np.median(seen) / limit > MIN_CLIPPED_RATIO:
            cause = f"{travel.speed_name(cable)} is clipped at {limit:.4g} in {np.count_nonzero(is_clipped)} samples"
            return cause, f"record {name} in its whole range"
    return None


def _wrapped(travel: _Travel, cable: int) -> Texts | None:
    """A few speeds far beyond all others, as differences of counts that begin anew have them."""
    speed, name = np.abs(travel.recording.winch_speed[:, cable]), travel.speed_name(cable)
    usual = float(np.quantile(speed, SPEED_QUANTILE))
    if not speed.max() > MIN_SPIKE_RATIO * usual > 0.0:
        return None
    cause = f"{name} reaches {speed.max():.3g} m/s, and stays below {usual:.3g} in 99 % of all samples"
    instead = "" if travel.is_length(cable) else f", or record rope_length_{cable + 1}"
    return f"{cause}, as where counts wrap", f"leave these samples empty{instead}"


def _unsigned(travel: _Travel, cable: int) -> Texts | None:
    """No speed below zero though the rope becomes longer on its way."""
    speed, length = travel.recording.winch_speed[:, cable], travel.lengths[:, cable]
    paid_out = float(np.max(length - np.minimum.accumulate(length)))
    if travel.is_length(cable) or np.any(speed < 0.0) or paid_out < travel.motion[cable] or not np.any(speed):
        return None
    name = travel.column(cable)
    return f"{name} is never negative", f"record {name} with its sign, negative where the rope pays out"


def _jump(travel: _Travel, cable: int) -> Texts | None:
    """One step that explains what a rope's length misses, beside a drift."""
    missed = (travel.lengths + travel.wound)[:, cable]
    before, after = (_running_mean(each) for each in (missed, missed[::-1]))
    counts = np.arange(1, len(missed))
    steps = after[::-1][1:] - before[:-1]
    row = int(np.argmax(steps**2 * counts * (len(missed) - counts))) + 1
    is_after = (np.arange(len(missed)) >= row).astype(float)
    if not _is_explained(travel.misfit(cable, travel.drift, is_after), travel.misfit(cable, travel.drift)):
        return None
    length, time = float(steps[row - 1]), travel.recording.time[travel.rows[row]]
    cause = f"its rope is {abs(length):.3g} m {'shorter' if length < 0.0 else 'longer'} from {time:.5g} s on"
    return f"{cause}, as where counts are lost, samples left out or the tracker moved", "cut the recording there"


def _running_mean(values: Array) -> Array:
    return np.asarray(np.cumsum(values) / np.arange(1, len(values) + 1))


def _exit_point(robot: Robot, travel: _Travel, cable: int) -> Texts | None:
    """The exit point with which a rope's length follows its winch; None of a rigid platform, or where a drift does."""
    if robot.platform.is_rigid_body or travel.misfit(cable, travel.drift) <= MAX_MISFIT:
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
    moved = float(np.linalg.norm(fit.x) / np.linalg.norm(declared - robot.platform.start))
    if not (_is_explained(left, travel.misfit(cable)) and MIN_MOVED <= moved <= MAX_MOVED):
        return None
    declared[free] += fit.x
    written = ", ".join(f"{coordinate:.4g}" for coordinate in declared)
    return f"its exit point fits at about [{written}] m", f"correct cable[{cable + 1}].anchor in the robot file"


def _is_explained(left: float, misfit: float) -> bool:
    return left <= min(MAX_MISFIT_LEFT * misfit, MAX_SHARE_LEFT)
