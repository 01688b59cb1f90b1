"""Measurement noise of the sensors: from the robot file, else estimated from the recording."""

from __future__ import annotations

from ...recordings.recording import Recording
from ...recordings.roughness import white_noise_deviation
from ...robots.robot import Robot
from ..filter_step import Noise

INITIAL_POSITION_SIGMAS = 3.0
UNMEASURED_INITIAL_DEVIATION = 1e-3


def estimate_noise(robot: Robot, recording: Recording) -> Noise:
    """Standard deviations as declared; one that is not declared, or zero, is estimated from the recording.

    A winch speed may be declared free of noise; no position or tension is.
    """
    position = robot.sensors.position_noise or white_noise_deviation(recording.position)
    speed = robot.sensors.winch_speed_noise
    return Noise(
        position=position,
        tension=robot.sensors.tension_noise or white_noise_deviation(recording.tension),
        winch_speed=white_noise_deviation(recording.winch_speed) if speed is None else speed,
        start_position=INITIAL_POSITION_SIGMAS * position if recording.has_position else UNMEASURED_INITIAL_DEVIATION,
    )
