"""Recordings as they are, made fit for judging: what is done to them, and what is not known of their start."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from ...recordings.recording import Recording, require_outputs
from ...robots.robot import Robot
from ..filter_step import Noise
from .gaps import without_gaps
from .motion_at_start import with_motion_at_start
from .noise import noise_of
from .noise_check import checked_noise
from .outliers import without_outliers
from .silent import without_silent
from .start_state import self_stress_of

Cleaning = Callable[[Recording], tuple[Recording, tuple[str, ...]]]

CLEANINGS: tuple[Cleaning, ...] = (without_silent, without_outliers)


@dataclass(frozen=True)
class Prepared:
    """What a trace works on, with notes of all that was done to it."""

    fit: Recording
    check: Recording | None
    noise: Noise
    notes: tuple[str, ...]


def prepare(robot: Robot, fit: Recording, check: Recording | None) -> Prepared:
    """Clean both recordings, and hold the declared noise against them.

    Raises RecordingError where a recording has no output that shows something, or is not to be trusted.
    """
    recordings: list[Recording] = []
    notes: tuple[str, ...] = ()
    for recording in (fit,) if check is None else (fit, check):
        cleaned = recording
        for cleaning in CLEANINGS:
            cleaned, said = cleaning(cleaned)
            notes += said
        require_outputs(cleaned)
        cleaned, said = without_gaps(robot, noise_of(robot, cleaned), cleaned)
        recordings.append(cleaned)
        notes += said
    checked = checked_noise(robot, noise_of(robot, recordings[0]), tuple(recordings))
    self_stress, said = self_stress_of(robot, checked.recordings)
    noise = replace(checked.noise, self_stress=self_stress)
    noise, moving = with_motion_at_start(robot, noise, checked.recordings)
    first, *others = checked.recordings
    return Prepared(first, others[0] if others else None, noise, (*notes, *checked.notes, *said, *moving))
