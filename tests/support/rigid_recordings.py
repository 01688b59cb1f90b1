"""Recordings of rigid platforms, made by their textbook equations with white noise on each sensor."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tautwire.recordings.recording import Recording
from tautwire.robot.rigid_equilibrium import static_equilibrium
from tautwire.robot.schema import Robot
from tests.support.rigid_motion import integrated

Array = NDArray[np.float64]

POSITION_NOISE, TENSION_NOISE, ROTATION_NOISE, SPEED_NOISE = 1e-4, 1.0, 2e-4, 1e-5


def with_noise(robot: Robot) -> Robot:
    """The robot whose file declares the noise of these recordings."""
    sensors = replace(
        robot.sensors,
        position_noise=POSITION_NOISE,
        tension_noise=TENSION_NOISE,
        orientation_noise=ROTATION_NOISE,
        winch_speed_noise=SPEED_NOISE,
    )
    return replace(robot, sensors=sensors)


@lru_cache
def rigid_recording(robot: Robot, count: int = 150, interval: float = 0.01, seed: int = 0) -> Recording:
    """What sensors show of a robot whose winches begin to swing, each in its own way."""
    time = interval * np.arange(count)
    generator = np.random.default_rng(seed)
    numbers = np.arange(robot.cable_count)
    speeds = 0.03 * np.sin(np.outer(time, 2.0 + 0.7 * numbers)) * np.cos(1.3 * numbers + seed)
    equilibrium = static_equilibrium(robot)
    motion = integrated(robot, (np.array(equilibrium.orientation), equilibrium.tensions), time, speeds)
    errors = Rotation.from_rotvec(generator.normal(0.0, ROTATION_NOISE, (count, 3)))
    turned = errors * Rotation.from_matrix(motion.rotation)

    def with_errors(values: Array, deviation: float) -> Array:
        return values + generator.normal(0.0, deviation, values.shape)

    return Recording(
        "rigid",
        time,
        with_errors(speeds, SPEED_NOISE),
        with_errors(motion.tension, TENSION_NOISE),
        with_errors(motion.position, POSITION_NOISE),
        orientation=np.roll(turned.as_quat(canonical=True), 1, axis=1),
    )
