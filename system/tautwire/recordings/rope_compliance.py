"""Compliance of the ropes against the declared one, told by tensions, positions and winch travel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import Robot
from .clock_fit import JACKKNIFE_BLOCKS
from .geometry_reading import GeometryReading, recorded_poses
from .motion_regression import MIN_ROWS, moving_rows
from .recording import Recording

Array = NDArray[np.float64]

# Ropes that were measured poorly, that creep or stiffen, stay within; and the deviation is at most such a share.
MAX_RATIO, MAX_DEVIATION_SHARE = 3.0, 0.1
# Of what lengths miss: stretch explains 0.7 or more of it on the shipped robots, 0.2 where pulleys are missing.
MIN_EXPLAINED_SHARE = 0.5
# Standard deviations of a modulus that is declared as uncertain.
UNCERTAINTY_SIGMAS = 3.0


@dataclass(frozen=True)
class RopeCompliance:
    """Compliance that was seen over the declared one, with its standard deviation by the block jackknife.

    ``explained_share`` is that of the mean square of what the lengths miss.
    """

    ratio: float
    deviation: float
    explained_share: float


def rope_compliance(robot: Robot, recording: Recording) -> RopeCompliance | None:
    """The common factor on the elongations ``T_i L_i / (E_i A_i)`` with which ropes stretch; None where it is not seen.

    Least squares of each geometric length plus what was wound on the elongation, beside constant, drift and a drum's
    scale of its own.
    """
    rows = moving_rows(robot, recording)
    if rows is None:
        return None
    rows = rows[np.isfinite(recording.tension[rows]).all(axis=1)]
    if len(rows) < MIN_ROWS * JACKKNIFE_BLOCKS:
        return None
    lengths = GeometryReading().directions(robot, recorded_poses(recording, rows))[0]
    wound, time = recording.wound_lengths()[rows], recording.time[rows] - recording.time[rows[0]]
    if not np.isfinite(lengths).all():
        return None
    blocks = np.zeros((3, JACKKNIFE_BLOCKS))
    for index, cable in enumerate(robot.cables):
        elongation = recording.tension[rows, index] * lengths[:, index] / (cable.modulus * cable.area)
        others = np.linalg.qr(np.column_stack([np.ones_like(time), time, wound[:, index]]))[0]
        missed = lengths[:, index] + wound[:, index]
        missed, elongation = (signal - others @ (others.T @ signal) for signal in (missed, elongation))
        products = np.array_split(np.column_stack([missed * elongation, elongation**2, missed**2]), JACKKNIFE_BLOCKS)
        blocks += np.array([product.sum(axis=0) for product in products]).T
    moments, energies, misses = blocks
    if not (energies.sum() > 0.0 and misses.sum() > 0.0):
        return None
    left_out = (moments.sum() - moments) / np.maximum(energies.sum() - energies, np.finfo(float).tiny)
    deviation = np.sqrt((JACKKNIFE_BLOCKS - 1) / JACKKNIFE_BLOCKS * np.sum((left_out - left_out.mean()) ** 2))
    ratio = float(moments.sum() / energies.sum())
    return RopeCompliance(ratio, float(deviation), ratio * float(moments.sum() / misses.sum()))


def is_other_rope(robot: Robot, compliance: RopeCompliance) -> bool:
    """Whether the ropes cannot be those that are declared, within what their moduli are uncertain by."""
    ratio = compliance.ratio
    is_seen = ratio > 0.0 and compliance.deviation <= MAX_DEVIATION_SHARE * ratio
    if not is_seen or compliance.explained_share < MIN_EXPLAINED_SHARE:
        return False
    if 1.0 / MAX_RATIO <= ratio <= MAX_RATIO:
        return False
    errors = [
        abs(cable.modulus / ratio - cable.modulus) > UNCERTAINTY_SIGMAS * cable.modulus_uncertainty
        for cable in robot.cables
    ]
    return all(errors)
