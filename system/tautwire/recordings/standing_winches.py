"""Winches that stand: what their encoders show is noise, and no motion of the rope."""

from __future__ import annotations

import numpy as np

from ..robot.schema import Robot
from .recording import Recording
from .white_noise_estimate import white_noise_deviation

# Ratio of the root mean square to the noise, and travel in standard deviations of what noise alone adds up to.
MAX_NOISE_RATIO, MAX_TRAVEL_SIGMAS = 1.1, 5.0


def without_noise_of_standing_winches(robot: Robot, recording: Recording) -> tuple[Recording, tuple[str, ...]]:
    """The recording with zero winch speeds where a winch stands throughout, and a note of those.

    Otherwise a drum that turns the noise into less rope, and ropes that damp what it sets off, would explain the rest
    of the robot better than the declared ones. A winch stands where its speed, and its travel, are no more than noise.
    """
    noise = robot.sensors.winch_speed_noise or white_noise_deviation(recording.winch_speed)
    steps = np.diff(recording.time, append=recording.time[-1])[:, None]
    travel = np.max(np.abs(np.cumsum(recording.winch_speed * steps, axis=0)), axis=0)
    root_mean_square = np.sqrt(np.mean(recording.winch_speed**2, axis=0))
    is_noise = (root_mean_square <= MAX_NOISE_RATIO * noise) & (root_mean_square > 0.0)
    stands = is_noise & (travel <= MAX_TRAVEL_SIGMAS * noise * float(np.linalg.norm(steps)))
    if not np.any(stands):
        return recording, ()
    winches = ", ".join(str(index + 1) for index in np.flatnonzero(stands))
    note = f"{recording.path}: winches stand, their speeds are noise and were taken as zero: {winches}"
    return recording.with_winch_speed(np.where(stands, 0.0, recording.winch_speed)), (note,)


def all_winches_stand(robot: Robot, recording: Recording) -> bool:
    """Whether no winch turns throughout, as in a ring-down: what they show is zero, or noise."""
    return not np.any(without_noise_of_standing_winches(robot, recording)[0].winch_speed)
