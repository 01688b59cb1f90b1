"""Preprocessing of recordings: cleaned, cut at gaps, limited in length, with their noise checked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from ..recordings.dead_channels import without_dead_channels
from ..recordings.outliers import without_outliers
from ..recordings.recording import Recording, require_outputs
from ..robot.schema import Robot
from .initial_state_prior import self_stress_deviation, with_motion_at_start
from .kalman_filter import Noise
from .measurement_noise import check_noise, estimate_noise

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
        row
        for row in np.flatnonzero(steps > MAX_STEP_INTERVALS * median_step)
        if _interpolation_error(recording, steps[row], median_step) > tolerance
    ]
    if not gaps:
        return recording, ()
    edges = [0, *(row + 1 for row in gaps), recording.sample_count]
    first, last = max(pairwise(edges), key=lambda part: part[1] - part[0])
    part = replace(
        recording,
        time=recording.time[first:last],
        winch_speed=recording.winch_speed[first:last],
        tension=recording.tension[first:last],
        position=recording.position[first:last],
    )
    gap_times = ", ".join(f"{recording.time[row]:.6g} s" for row in gaps[:5]) + (" ..." if len(gaps) > 5 else "")
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


# A fit runs the filter over each recording some hundred times, 30 us a sample.
MAX_SAMPLES = 100_000


def shortened(
    fit: Recording, check: Recording | None, most: int = MAX_SAMPLES
) -> tuple[Recording, Recording | None, tuple[str, ...]]:
    """Two recordings truncated to ``most`` samples, and notes; a single one, which also validates, to twice as many.

    The beginning is used and not every n-th sample: ropes have memory, so a model has to follow a recording from its
    start.
    """
    if check is None:
        short_fit, notes = _truncated(fit, 2 * most)
        return short_fit, None, notes
    (short_fit, notes), (short_check, check_notes) = _truncated(fit, most), _truncated(check, most)
    return short_fit, short_check, (*notes, *check_notes)


def _truncated(recording: Recording, max_samples: int) -> tuple[Recording, tuple[str, ...]]:
    count = recording.sample_count
    if count <= max_samples:
        return recording, ()
    short = recording.first(max_samples)
    description = (
        f"its first {short.duration:.4g} s, {max_samples:,} of {count:,} samples, were traced; give "
        "another part for more"
    )
    return short, (f"{recording.path}: {description}",)


CleaningStep = Callable[[Recording], tuple[Recording, tuple[str, ...]]]

CLEANING_STEPS: tuple[CleaningStep, ...] = (without_dead_channels, without_outliers)


@dataclass(frozen=True)
class PreparedRecordings:
    """Cleaned recordings and their noise, with notes of every step applied."""

    fit: Recording
    check: Recording | None
    noise: Noise
    notes: tuple[str, ...]


def prepare_recordings(robot: Robot, fit: Recording, check: Recording | None) -> PreparedRecordings:
    """Clean both recordings and test the declared noise against them.

    Raises RecordingError where a recording has no output that carries information, or is not to be trusted.
    """
    recordings: list[Recording] = []
    notes: tuple[str, ...] = ()
    for recording in (fit,) if check is None else (fit, check):
        cleaned = recording
        for cleaning in CLEANING_STEPS:
            cleaned, new_notes = cleaning(cleaned)
            notes += new_notes
        require_outputs(cleaned)
        cleaned, new_notes = without_gaps(robot, estimate_noise(robot, cleaned), cleaned)
        recordings.append(cleaned)
        notes += new_notes
    checked = check_noise(robot, estimate_noise(robot, recordings[0]), tuple(recordings))
    self_stress, new_notes = self_stress_deviation(robot, checked.recordings)
    noise = replace(checked.noise, self_stress=self_stress)
    noise, motion_notes = with_motion_at_start(robot, noise, checked.recordings)
    first, *others = checked.recordings
    return PreparedRecordings(
        first, others[0] if others else None, noise, (*notes, *checked.notes, *new_notes, *motion_notes)
    )
