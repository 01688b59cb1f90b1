"""Preprocessing of recordings for estimation: cleaning, noise and the uncertainty of their initial state."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from ...recordings.recording import Recording, require_outputs
from ...robots.robot import Robot
from ..filter_step import Noise
from .gaps import without_gaps
from .motion_at_start import with_motion_at_start
from .noise import estimate_noise
from .noise_check import check_noise
from .outliers import without_outliers
from .silent import without_dead_channels
from .start_state import self_stress_deviation

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
