"""Gaps in time: nobody knows how winches moved in them, so a long one parts a recording in two."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ...recordings.recording import Recording
from ...robots.robot import Robot
from ..filter_step import Noise

Array = NDArray[np.float64]

# In medians of the sample interval.
LONGEST = 1.5
# Of what sensors' noise makes of a length.
KNOWN = 1.0


def without_gaps(robot: Robot, noise: Noise, recording: Recording) -> tuple[Recording, tuple[str, ...]]:
    """The longest part without a gap in which rope may have run that is not known, and a note where that is a part.

    Winch speeds count as linear in a gap. By how much rope they are then wrong is seen elsewhere in the recording, over
    as many samples: the root mean square of ``integral of V dt - (V_0 + V_1) t / 2``.
    """
    steps = np.diff(recording.time)
    usual = float(np.median(steps))
    least = _shortest_seen(robot, noise, recording)
    gaps = [
        place for place in np.flatnonzero(steps > LONGEST * usual) if _unknown(recording, steps[place], usual) > least
    ]
    if not gaps:
        return recording, ()
    ends = [0, *(place + 1 for place in gaps), recording.sample_count]
    first, last = max(pairwise(ends), key=lambda part: part[1] - part[0])
    part = replace(
        recording,
        time=recording.time[first:last],
        winch_speed=recording.winch_speed[first:last],
        tension=recording.tension[first:last],
        position=recording.position[first:last],
    )
    where = ", ".join(f"{recording.time[place]:.6g} s" for place in gaps[:5]) + (" ..." if len(gaps) > 5 else "")
    used = f"from {part.time[0]:.6g} to {part.time[-1]:.6g} s was used"
    return part, (f"{recording.path}: nobody knows what winches did in its gaps (at {where}): only the part {used}",)


def _unknown(recording: Recording, length: float, usual: float) -> float:
    """Rope, in m, that a straight line over a gap of some length (s) misses elsewhere; the most of any winch."""
    count = round(float(length) / usual)
    if recording.sample_count <= 2 * count:
        return float("inf")
    speed = recording.winch_speed
    wound = np.vstack([np.zeros(speed.shape[1]), np.cumsum(0.5 * usual * (speed[1:] + speed[:-1]), axis=0)])
    missed = wound[count:] - wound[:-count] - 0.5 * count * usual * (speed[count:] + speed[:-count])
    return float(np.max(np.sqrt(np.mean(missed**2, axis=0))))


def _shortest_seen(robot: Robot, noise: Noise, recording: Recording) -> float:
    """What a sensor's noise is as a length of rope, in m; the least of those that are there."""
    seen = [noise.position] if recording.has_position else []
    if recording.has_tension:
        lengths = [float(np.linalg.norm(np.subtract(anchor, robot.platform.start))) for anchor in robot.anchors]
        stiffest = max(c.modulus * c.area / length for c, length in zip(robot.cables, lengths, strict=True))
        seen.append(noise.tension / stiffest)
    return KNOWN * min(seen, default=0.0)
