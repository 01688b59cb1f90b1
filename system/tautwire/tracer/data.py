"""What a trace is judged on: the recordings, where each starts, and which samples fit and which judge."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..recordings.recording import Recording
from ..robots.robot import Robot
from ..runs.start import start_of
from .filter_step import Noise

HEAD_SHARE = 3
FEWEST_IN_HEAD, MOST_IN_HEAD = 800, 20_000


@dataclass(frozen=True)
class Sample:
    """Samples of a recording from one place: ``rows`` (N,) tells which of them count."""

    recording: Recording
    start: tuple[float, float, float]
    rows: NDArray[np.bool_]

    @property
    def head(self) -> Sample:
        """The beginning of the samples that count, long enough to rank hypotheses by: a third, of 800 to 20,000."""
        third = int(np.sum(self.rows)) // HEAD_SHARE
        return self.beginning(min(max(third, FEWEST_IN_HEAD), MOST_IN_HEAD))

    def beginning(self, count: int) -> Sample:
        """The first so many samples that count, all where there are no more."""
        places = np.flatnonzero(self.rows)
        last = int(places[min(count, len(places)) - 1]) + 1
        return Sample(self.recording.first(last), self.start, self.rows[:last])


@dataclass(frozen=True)
class Evidence:
    """What fits and what judges; never the same samples."""

    fit: Sample
    judge: Sample
    notes: tuple[str, ...]


def split(robot: Robot, noise: Noise, fit: Recording, check: Recording | None) -> Evidence:
    """Judge on the check recording, or on the second half of the only one."""
    fit_start, notes = start_of(robot, noise.position, fit)
    everything = np.ones(len(fit.time), dtype=bool)
    if check is not None:
        check_start, check_notes = start_of(robot, noise.position, check)
        return Evidence(
            Sample(fit, fit_start, everything),
            Sample(check, check_start, np.ones(len(check.time), dtype=bool)),
            notes + check_notes,
        )
    first = np.arange(len(fit.time)) < len(fit.time) // 2
    said = "no check recording: the second half of the recording judged what the first half fitted"
    return Evidence(Sample(fit, fit_start, first), Sample(fit, fit_start, ~first), (*notes, said))
