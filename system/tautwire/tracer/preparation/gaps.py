"""Gaps in time: winch motion in them is unknown, so a long one splits a recording."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...recordings.recording import Recording
from ...robots.robot import Robot
from ..filter_step import Noise

Array = NDArray[np.float64]

# A longer step is a gap; in medians of the sample interval.
MAX_STEP_INTERVALS = 1.5
# Largest admissible interpolation error of rope length, in standard deviations of the best sensor.
MAX_ERROR_SIGMAS = 1.0


def without_gaps(robot: Robot, noise: Noise, recording: Recording) -> tuple[Recording, tuple[str, ...]]:
    """The longest part without a gap in which unknown rope may have run, and a note where that is not the whole.

    Winch speeds are interpolated linearly in a gap. The error of rope length is estimated elsewhere in the recording,
    over as many samples: the root mean square of ``integral of V dt - (V_0 + V_1) t / 2``.
    """
    steps = np.diff(recording.time)
    median_step = float(np.median(steps))
    tolerance = _detectable_length(robot, noise, recording)
    gaps = [
        place
        for place in np.flatnonzero(steps > MAX_STEP_INTERVALS * median_step)
        if _interpolation_error(recording, steps[place], median_step) > tolerance
    ]
    if not gaps:
        return recording, ()
    edges = [0, *(place + 1 for place in gaps), recording.sample_count]
    first, last = max(pairwise(edges), key=lambda part: part[1] - part[0])
    part = replace(
        recording,
        time=recording.time[first:last],
        winch_speed=recording.winch_speed[first:last],
        tension=recording.tension[first:last],
        position=recording.position[first:last],
    )
    gap_times = ", ".join(f"{recording.time[place]:.6g} s" for place in gaps[:5]) + (" ..." if len(gaps) > 5 else "")
    used_part = f"from {part.time[0]:.6g} to {part.time[-1]:.6g} s was used"
    return part, (
        f"{recording.path}: nobody knows what winches did in its gaps (at {gap_times}): only the part {used_part}",
    )


def _interpolation_error(recording: Recording, duration: float, median_step: float) -> float:
    """Error of rope length (m) of linear interpolation over a gap of some duration (s); the largest of any winch."""
    count = round(float(duration) / median_step)
    if recording.sample_count <= 2 * count:
        return float("inf")
    speed = recording.winch_speed
    wound_length = np.vstack(
        [np.zeros(speed.shape[1]), np.cumsum(0.5 * median_step * (speed[1:] + speed[:-1]), axis=0)]
    )
    errors = wound_length[count:] - wound_length[:-count] - 0.5 * count * median_step * (speed[count:] + speed[:-count])
    return float(np.max(np.sqrt(np.mean(errors**2, axis=0))))


def _detectable_length(robot: Robot, noise: Noise, recording: Recording) -> float:
    """Smallest detectable error of rope length, in m: the noise of the best sensor as a length."""
    detectable = [noise.position] if recording.has_position else []
    if recording.has_tension:
        lengths = [float(np.linalg.norm(np.subtract(anchor, robot.platform.start))) for anchor in robot.anchors]
        stiffest = max(c.modulus * c.area / length for c, length in zip(robot.cables, lengths, strict=True))
        detectable.append(noise.tension / stiffest)
    return MAX_ERROR_SIGMAS * min(detectable, default=0.0)
