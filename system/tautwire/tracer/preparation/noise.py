"""What the sensors add: from the robot file, else from the recording's own roughness."""

from __future__ import annotations

from ...recordings.recording import Recording
from ...recordings.roughness import roughness
from ...robots.robot import Robot
from ..filter_step import Noise

START_SPREAD = 3.0
START_UNSEEN = 1e-3


def noise_of(robot: Robot, recording: Recording) -> Noise:
    """Standard deviations as declared; one that is not declared, or zero, is measured on the recording.

    A winch speed may be declared free of noise; no position or tension is.
    """
    position = robot.sensors.position_noise or roughness(recording.position)
    speed = robot.sensors.winch_speed_noise
    return Noise(
        position=position,
        tension=robot.sensors.tension_noise or roughness(recording.tension),
        winch_speed=roughness(recording.winch_speed) if speed is None else speed,
        start=START_SPREAD * position if recording.has_position else START_UNSEEN,
    )
