"""Whether a recording can be one of a robot at all."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError
from ..recordings.recording import Recording
from ..robots.robot import Robot

Array = NDArray[np.float64]

# Shares of the robot's size: a start nearer than FAR, or ropes reeled by less than LEAST, tell nothing.
FAR, LEAST = 0.1, 1e-3
# Of what was reeled. Stretch, wrong drums and drift stay far below, another robot's ropes are wrong by all of it.
APART = 0.5
LOOKED_AT = 60.0  # s
# Rows at rest at the start, and the share of all rows that counts: a tracker may jump now and then.
FIRST, COUNTED = 5, 0.95
MEND = "give a recording of this robot, with positions in m in the robot file's frame, or correct the robot file"


def start_told(robot: Robot, start: Array) -> str:
    """How far a start is from the robot file's, in words."""
    return f"{_gap(robot, start):.3g} m from where the robot file starts it, at [{_place(robot.platform.start)}] m"


def require_near(robot: Robot, start: Array, where: str) -> None:
    """Raises RecordingError where a start is farther from the robot file's than the robot is large."""
    size = size_of(robot)
    if _gap(robot, start) > size:
        raise RecordingError(where, f"{_begin(robot, start)}, and the robot is no larger than {size:.3g} m", MEND)


def require_ropes(robot: Robot, recording: Recording, start: Array, where: str) -> None:
    """Refuse a recording that starts far away, with ropes that are not reeled as its winch speeds say.

    Their lengths are ``|a_i - p|``. Raises RecordingError.
    """
    size = size_of(robot)
    if _gap(robot, start) < FAR * size:
        return
    reeled, missed = reeled_and_missed(robot, recording)
    if reeled > LEAST * size and missed > APART * reeled:
        told = f"ropes there would not be reeled so: {reeled:.2g} m were, {missed:.2g} m do not fit (rms)"
        raise RecordingError(where, f"{_begin(robot, start)}, and {told}", MEND)


def reeled_and_missed(robot: Robot, recording: Recording) -> tuple[float, float]:
    """Rope reeled by the winches, and what of it the lengths at the recorded positions do not show; rms in m.

    Without the rows at which most is missed, which may be outliers.
    """
    time, speeds = recording.time, recording.winch_speed
    reeled = np.zeros_like(speeds)
    np.cumsum(0.5 * (speeds[1:] + speeds[:-1]) * np.diff(time)[:, None], axis=0, out=reeled[1:])
    rows = np.isfinite(recording.position).all(axis=1) & (time <= time[0] + LOOKED_AT)
    if not rows.any():
        return 0.0, 0.0
    lengths = np.linalg.norm(np.array(robot.anchors) - recording.position[rows][:, None], axis=2)
    wound = reeled[rows] - reeled[rows][0]
    errors = wound + lengths - np.median(lengths[:FIRST], axis=0)
    missed = np.mean(errors**2, axis=1)
    kept = missed <= np.quantile(missed, COUNTED)
    return _rms(wound[kept]), _rms(errors[kept])


def size_of(robot: Robot) -> float:
    """The largest distance between two of the exit points and the start, in m."""
    places = np.array([*robot.anchors, robot.platform.start])
    return float(np.max(np.linalg.norm(places[:, None] - places[None], axis=2)))


def _gap(robot: Robot, start: Array) -> float:
    return float(np.linalg.norm(start - np.array(robot.platform.start)))


def _begin(robot: Robot, start: Array) -> str:
    return f"they begin at [{_place(start)}] m, {start_told(robot, start)}"


def _place(position: Sequence[float] | Array) -> str:
    return ", ".join(f"{coordinate:.5g}" for coordinate in position)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))
