"""Gaps of a recording: the longest part in which no winch can have run unseen."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from .recording import Recording


def without_gaps(
    recording: Recording, max_length_error: float, max_step_intervals: float = 1.5
) -> tuple[Recording, tuple[str, ...]]:
    """The longest part without a gap in which unknown rope may have run, and a note where that is not the whole.

    Winch speeds are interpolated linearly in a gap. The error of rope length that this makes is estimated elsewhere in
    the recording, over as many samples: the root mean square of ``integral of V dt - (V_0 + V_1) t / 2``. A gap is a
    step longer than ``max_step_intervals`` medians of them, in which that error exceeds ``max_length_error`` (m).
    """
    steps = np.diff(recording.time)
    median_step = float(np.median(steps))
    gaps = [
        row
        for row in np.flatnonzero(steps > max_step_intervals * median_step)
        if _interpolation_error(recording, steps[row], median_step) > max_length_error
    ]
    if not gaps:
        return recording, ()
    edges = [0, *(row + 1 for row in gaps), recording.sample_count]
    part = recording.part(*max(pairwise(edges), key=lambda rows: rows[1] - rows[0]))
    gap_times = ", ".join(f"{recording.time[row]:.6g} s" for row in gaps[:5]) + (" ..." if len(gaps) > 5 else "")
    used_part = f"from {part.time[0]:.6g} to {part.time[-1]:.6g} s was used"
    return part, (
        f"{recording.path}: the winch motion in its gaps (at {gap_times}) is unknown: only the part {used_part}",
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
