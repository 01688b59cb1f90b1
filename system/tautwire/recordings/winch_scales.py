"""Scale of each winch: by how much geometric rope lengths change for what the drum is said to have wound."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import Robot
from .clock_fit import JACKKNIFE_BLOCKS, OUTLIER_RATIO, ClockFit, Overlap, TrackerClock
from .geometry_reading import GeometryReading, recorded_poses
from .motion_regression import dynamic_amplification, moving_rows
from .recording import Recording

Array = NDArray[np.float64]

# What unstated errors of survey and pulleys make of a scale; a drum is commonly known to a few tenths of a percent.
MIN_ERROR, MIN_SIGMAS, MIN_SURVEY_SIGMAS = 0.015, 5.0, 3.0
# Scale and stretch multiply, and a softer rope overshoots by more.
STRAINS, AMPLIFICATIONS = 2.0, 3.0
# What is no drum's: factors beyond, and with a standard deviation of a larger share.
FACTORS, MAX_DEVIATION_SHARE = (0.2, 5.0), 0.15
# Residual of a cable's length beside its scale: over that without, and over that beside another exit point.
MAX_RESIDUAL_SHARE, MAX_RATIO_TO_EXIT_POINT = 0.5, 2.0


@dataclass(frozen=True)
class WinchScale:
    """Cable, counted from 1, and the factor of its rope's shortening to what was wound with its standard deviation.

    The deviation is that of the block jackknife and of the declared survey together.
    """

    cable: int
    factor: float
    deviation: float


def winch_scales(robot: Robot, recording: Recording, lag: float = 0.0) -> tuple[WinchScale, ...]:
    """The cables whose scale differs from 1 by more than survey, stretch and pulleys make it, and explains the misfit.

    Least squares of each geometric length, less its elongation by the measured tension, on constant, drift and what was
    wound; positions are ``lag`` s late. None of a motion that is not quasi-static, or leads into a pulley.
    """
    rows = moving_rows(robot, recording)
    amplification = np.inf if rows is None else dynamic_amplification(robot, recording, rows)
    if rows is None or not np.isfinite(amplification):
        return ()
    lengths, directions = GeometryReading().directions(robot, recorded_poses(recording, rows))
    if not np.isfinite(lengths).all():
        return ()
    fit = ClockFit(robot, recording, recording.time[rows], lengths)
    overlap = fit.overlap(TrackerClock(float(recording.time[0]) + lag))
    directions = directions[np.isin(recording.time[rows], overlap.times)]
    squares = np.sum(overlap.without_nuisances(overlap.errors) ** 2, axis=1)
    is_inlier = squares <= OUTLIER_RATIO * np.median(squares)
    overlap, directions = overlap.rows(is_inlier), directions[is_inlier]
    bounds = MIN_ERROR + AMPLIFICATIONS * amplification + STRAINS * _strains(robot, fit)
    scales = []
    for cable, bound in enumerate(bounds):
        scale = _scale(overlap, cable, directions[:, cable], _survey_deviation(robot, cable))
        is_drum = scale is not None and FACTORS[0] < scale.factor < FACTORS[1]
        if scale is not None and is_drum and abs(scale.factor - 1.0) > bound and _is_sharp(scale):
            scales.append(scale)
    return tuple(scales)


def _is_sharp(scale: WinchScale) -> bool:
    return scale.deviation <= MAX_DEVIATION_SHARE * scale.factor


def _scale(overlap: Overlap, cable: int, directions: Array, survey_deviation: float) -> WinchScale | None:
    """The scale of a cable, where it is significant and explains the misfit; None otherwise.

    ``directions`` (M, 3) are what its length changes by where the exit point moves, or a pulley is there: where these
    explain far more, it is no scale.
    """
    ramp = np.linalg.qr(np.column_stack([np.ones_like(overlap.times), overlap.times - overlap.times[0]]))[0]
    wound, missed, *turned = np.column_stack([overlap.travel[:, cable], overlap.errors[:, cable], directions]).T
    wound, missed, *turned = (signal - ramp @ (ramp.T @ signal) for signal in (wound, missed, *turned))
    energy = float(wound @ wound)
    if not energy > 0.0:
        return None
    excess = float(wound @ missed) / energy
    residual = missed - excess * wound
    blocks = np.array([block.sum() for block in np.array_split(residual * wound, JACKKNIFE_BLOCKS)])
    sampling = float(np.sqrt(blocks @ blocks * JACKKNIFE_BLOCKS / (JACKKNIFE_BLOCKS - 1))) / energy
    survey = survey_deviation * float(np.linalg.norm([each @ wound for each in turned])) / energy
    shift = np.linalg.lstsq(np.column_stack(turned), missed, rcond=None)[0]
    residual_of_shift = float(np.linalg.norm(missed - np.column_stack(turned) @ shift))
    limit = min(MAX_RESIDUAL_SHARE * float(np.linalg.norm(missed)), MAX_RATIO_TO_EXIT_POINT * residual_of_shift)
    if abs(excess) <= max(MIN_SIGMAS * sampling, MIN_SURVEY_SIGMAS * survey) or np.linalg.norm(residual) > limit:
        return None
    return WinchScale(cable + 1, 1.0 - excess, float(np.hypot(sampling, survey)))


def _survey_deviation(robot: Robot, cable: int) -> float:
    """Standard deviation in m along each axis, of a rope's exit point, its attachment and the tracker together."""
    declared = robot.cables[cable]
    errors = (declared.anchor_uncertainty, declared.attachment_uncertainty, robot.sensors.position_offset_uncertainty)
    return float(np.linalg.norm(errors))


def _strains(robot: Robot, fit: ClockFit) -> Array:
    """Strain of each rope (n,) under the largest of the measured, the preferred and its share of the weight."""
    weight = robot.platform.mass * robot.gravity / robot.cable_count
    preferred = 0.0 if robot.tension is None else robot.tension.preferred
    measured = np.abs(fit.tensions).mean(axis=0)
    return np.asarray(fit.compliances * np.maximum(measured, max(weight, preferred)))
