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


def noise_of(robot: Robot, recording: Recording) -> Noise:
    """Standard deviations as declared; one that is not declared is measured on the recording."""
    sensors = robot.sensors
    position = sensors.position_noise
    tension = sensors.tension_noise
    speed = sensors.winch_speed_noise
    position = roughness(recording.position) if position is None else position
    return Noise(
        position=position,
        tension=roughness(recording.tension) if tension is None else tension,
        winch_speed=roughness(recording.winch_speed) if speed is None else speed,
        start=START_SPREAD * position,
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
    smallest = np.finfo(float).tiny
    return max(float(np.sqrt(np.mean(np.square(deviations)))), smallest) if deviations else 1.0
