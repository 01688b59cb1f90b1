"""What the sensors add: from the robot file, else from the recording's own roughness."""

from __future__ import annotations

from math import comb, sqrt

import numpy as np
from numpy.typing import NDArray

from ..recording import Recording
from ..robot import Robot
from .filter_step import Noise

Array = NDArray[np.float64]

DIFFERENCES = 6
NORMAL_MEDIAN = 0.6745
START_SPREAD = 3.0
START_UNSEEN = 1e-3
# Files carry some seven digits: nothing is known better than that.
RESOLUTION = 1e-7


def noise_of(robot: Robot, recording: Recording) -> Noise:
    """Standard deviations as declared; one that is not declared, or zero, is measured on the recording.

    A winch speed may be declared free of noise; no position or tension is.
    """
    sensors = robot.sensors
    position = sensors.position_noise
    tension = sensors.tension_noise
    speed = sensors.winch_speed_noise
    position = position or roughness(recording.position)
    return Noise(
        position=position,
        tension=tension or roughness(recording.tension),
        winch_speed=roughness(recording.winch_speed) if speed is None else speed,
        start=START_SPREAD * position if recording.has_position else START_UNSEEN,
    )


def roughness(samples: Array) -> float:
    """Standard deviation of white noise on smooth signals, shape (N, k); the mean over columns, 1 where unseen.

    The median of ``|D^6 y|`` over ``0.6745 sqrt(C(12, 6))``: differencing six times takes away what is smooth
    from one sample to the next, and the median passes over outliers.
    """
    differences = np.abs(np.diff(samples, DIFFERENCES, axis=0))
    seen = np.isfinite(differences)
    deviations = [
        float(np.median(column[there])) / (NORMAL_MEDIAN * sqrt(comb(2 * DIFFERENCES, DIFFERENCES)))
        for column, there in zip(differences.T, seen.T, strict=True)
        if np.any(there)
    ]
    if not deviations:
        return 1.0
    return max(float(np.sqrt(np.mean(np.square(deviations)))), RESOLUTION * float(np.nanmax(np.abs(samples))))
