"""Estimation and validation data: the recordings, where each starts, and which samples fit and which judge."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..recordings.recording import Recording
from ..recordings.start_position import start_position
from ..robot.schema import Robot
from .kalman_filter import Noise
from .policy import DEFAULT_POLICY, FitPolicy


@dataclass(frozen=True)
class DataSet:
    """Data set: a recording, where it starts, and which of its samples count: ``rows`` (N,)."""

    recording: Recording
    start: tuple[float, float, float]
    rows: NDArray[np.bool_]

    def head(self, policy: FitPolicy = DEFAULT_POLICY.fit) -> DataSet:
        """The first samples that count, enough to rank hypotheses by: a third, of 800 to 20,000."""
        third = int(np.sum(self.rows)) // policy.head_divisor
        return self.first(min(max(third, policy.min_head_samples), policy.max_head_samples))

    def first(self, count: int) -> DataSet:
        """The first ``count`` samples that count; all where there are no more."""
        indices = np.flatnonzero(self.rows)
        end = int(indices[min(count, len(indices)) - 1]) + 1
        return DataSet(self.recording.first(end), self.start, self.rows[:end])


@dataclass(frozen=True)
class DataSplit:
    """Estimation data that fits and validation data that judges; never the same samples."""

    estimation: DataSet
    validation: DataSet
    notes: tuple[str, ...]


def split_data(robot: Robot, noise: Noise, fit: Recording, check: Recording | None) -> DataSplit:
    """Split into estimation and validation data: the check recording validates, or the second half of the only one."""
    fit_start, notes = start_position(robot, noise.position, fit)
    all_rows = np.ones(len(fit.time), dtype=bool)
    if check is not None:
        check_start, check_notes = start_position(robot, noise.position, check)
        return DataSplit(
            DataSet(fit, fit_start, all_rows),
            DataSet(check, check_start, np.ones(len(check.time), dtype=bool)),
            notes + check_notes,
        )
    first_half = np.arange(len(fit.time)) < len(fit.time) // 2
    note = "no check recording: fitted on the first half of the recording, validated on the second"
    return DataSplit(DataSet(fit, fit_start, first_half), DataSet(fit, fit_start, ~first_half), (*notes, note))
