"""Whether a recording starts in motion, told by its first positions and winch speeds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...errors import RecordingError
from ...recordings.recording import Recording
from ...robots.robot import Robot
from ...runs.start import placed, start_of
from ...statics.equilibrium import directions
from ..filter_step import Noise

Array = NDArray[np.float64]

SIGMAS = 8.0
# What tells the velocity at the start: seconds, twice as many where samples are few, of which there must be so many.
WINDOW, FEWEST = 0.25, 10
# What tells how far the start is from equilibrium, s; and how far it may be, as a share of the shortest rope.
SWING, FAR = 1.0, 0.02
# The filter's deviations, over what was seen.
WIDER = 1.5


@dataclass(frozen=True)
class Beginning:
    """``velocity`` of the platform at the start (m/s), and how far it swings about where the ropes hold it (m)."""

    velocity: float
    swing: float


def with_motion_at_start(robot: Robot, noise: Noise, recordings: Sequence[Recording]) -> tuple[Noise, tuple[str, ...]]:
    """Noise with a start as uncertain as the recordings that begin in motion need, and a note of each of these.

    Raises RecordingError where one is too far from rest for its ropes' reference, the static start, to be found.
    """
    notes: list[str] = []
    for recording in recordings:
        here = placed(robot, start_of(robot, noise.position, recording)[0])
        found = beginning_of(here, noise, recording)
        if found is None:
            continue
        shortest = min(float(np.linalg.norm(np.subtract(a, robot.platform.start))) for a in robot.anchors)
        if found.swing > FAR * shortest:
            problem = f"starts in motion, {found.velocity:.3g} m/s, and swings by {found.swing:.3g} m"
            mend = "start the recording at rest: the ropes' reference is the static start"
            raise RecordingError(recording.path, problem, mend)
        noise = replace(
            noise,
            start_velocity=max(noise.start_velocity, WIDER * found.velocity),
            start_stretch=max(noise.start_stretch, WIDER * found.swing),
        )
        notes.append(
            f"{recording.path} starts in motion, at about {found.velocity:.3g} m/s: where, how fast and under which "
            "tensions was fitted beside every effect; what ropes remember (relaxation, creep) is taken as at rest"
        )
    return noise, tuple(notes)


def beginning_of(robot: Robot, noise: Noise, recording: Recording) -> Beginning | None:
    """How a recording begins; None where at rest as far as is seen.

    Winch speeds alone would move a platform on stiff ropes at ``v`` with ``U' v = V``. What positions do beside that is
    fitted by ``e_0 + e_1 t + e_2 t^2``; the velocity is ``v + e_1``, and counts where it is eight sigma from none.
    """
    time = recording.time - recording.time[0]
    leading = np.linalg.pinv(directions(robot), rcond=1e-9)
    led = recording.winch_speed @ leading
    moved = _integral(time, led)
    begun, line = recording.winch_speed[0], led[0]
    spread = noise.winch_speed * np.linalg.norm(leading, axis=0)
    early = time <= 2.0 * WINDOW
    seen = [axis for axis, column in enumerate(recording.position.T) if np.sum(np.isfinite(column[early])) >= FEWEST]
    if not seen:
        runs = bool(np.any(np.abs(begun) > SIGMAS * noise.winch_speed)) and noise.winch_speed > 0.0
        return Beginning(float(np.linalg.norm(line)), 0.0) if runs else None
    own = noise.of_outputs(recording.cable_count)
    velocity, significant, swings = np.zeros(3), False, [0.0]
    for axis in seen:
        beside = recording.position[:, axis] - moved[:, axis]
        slope, deviation = _slope(time, beside, own[axis])
        velocity[axis] = line[axis] + slope
        significant |= bool(abs(velocity[axis]) > SIGMAS * np.hypot(deviation, spread[axis]))
        swings.append(_swing(time, beside, own[axis]))
    return Beginning(float(np.linalg.norm(velocity)), max(swings)) if significant else None


def _integral(time: Array, rates: Array) -> Array:
    steps = 0.5 * (rates[1:] + rates[:-1]) * np.diff(time)[:, None]
    total: Array = np.vstack([np.zeros((1, rates.shape[1])), np.cumsum(steps, axis=0)])
    return total


def _slope(time: Array, signal: Array, sigma: float) -> tuple[float, float]:
    """Slope at the start of the parabola through the first samples, and its deviation."""
    there = np.flatnonzero(np.isfinite(signal))
    chosen = there[: max(int(np.sum(time[there] <= WINDOW)), FEWEST)]
    powers = np.vander(time[chosen], 3, increasing=True)
    inverse = np.linalg.pinv(powers)
    return float(inverse[1] @ signal[chosen]), sigma * float(np.linalg.norm(inverse[1]))


def _swing(time: Array, signal: Array, sigma: float) -> float:
    """How far a signal is from the parabola that it swings about in its first second, noise apart."""
    chosen = np.flatnonzero(np.isfinite(signal) & (time <= SWING))
    if len(chosen) <= FEWEST:
        return 0.0
    left = signal[chosen] - np.polyval(np.polyfit(time[chosen], signal[chosen], 2), time[chosen])
    return float(np.sqrt(max(2.0 * (float(np.mean(left**2)) - sigma**2), 0.0)))
