"""Estimation and validation data: the recordings, where each starts, and which samples fit and which judge."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..recordings.quaternion_columns import rotation_vectors
from ..recordings.recording import Recording
from ..recordings.start_position import MAX_START_SAMPLES, START_ROWS, START_SIGNIFICANCE, start_position
from ..robot.measured_start import with_measured_start, with_true_start
from ..robot.schema import Quaternion, Robot
from ..robot.static_equilibrium import start_orientation
from .kalman_filter import Noise
from .measured_outputs import measured_outputs, orientations
from .policy import DEFAULT_POLICY, FitPolicy


@dataclass(frozen=True)
class DataSet:
    """Data set: a recording, where it starts, and which of its samples count: ``rows`` (N,).

    ``orientation`` is that of the start where it is not the robot file's, of a platform that turns.
    """

    recording: Recording
    start: tuple[float, float, float]
    rows: NDArray[np.bool_]
    orientation: Quaternion | None = None

    def placed(self, robot: Robot) -> Robot:
        """The robot at the start of the recording, as the sensors show it."""
        return with_measured_start(robot, self.start, self.orientation)

    def value_count(self, is_rigid: bool) -> int:
        """Number of measured values in the rows that count; ``is_rigid`` where orientations are among them."""
        return int(np.count_nonzero(np.isfinite(measured_outputs(self.recording, is_rigid)[self.rows])))

    def head(self, policy: FitPolicy = DEFAULT_POLICY.fit) -> DataSet:
        """The first samples that count, enough to rank hypotheses by: a third, of 800 to 20,000."""
        third = int(np.sum(self.rows)) // policy.head_divisor
        return self.first(min(max(third, policy.min_head_samples), policy.max_head_samples))

    def first(self, count: int) -> DataSet:
        """The first ``count`` samples that count; all where there are no more."""
        indices = np.flatnonzero(self.rows)
        end = int(indices[min(count, len(indices)) - 1]) + 1
        return replace(self, recording=self.recording.first(end), rows=self.rows[:end])


@dataclass(frozen=True)
class DataSplit:
    """Estimation data that fits and validation data that judges; never the same samples.

    ``has_speeds_between_samples``: whether winch speeds were taken from an encoder's counts or lengths.
    """

    estimation: DataSet
    validation: DataSet
    notes: tuple[str, ...]
    has_speeds_between_samples: bool = False

    @property
    def roles(self) -> tuple[str, ...]:
        """Roles of the recordings: the fit recording alone where it also validates."""
        return ("fit",) if self.estimation.recording is self.validation.recording else ("fit", "check")


def split_data(robot: Robot, noise: Noise, fit: Recording, check: Recording | None) -> DataSplit:
    """Split into estimation and validation data: the check recording validates, or the second half of the only one."""
    whole, notes = whole_recording(robot, noise, fit)
    if check is not None:
        validation, check_notes = whole_recording(robot, noise, check)
        return DataSplit(whole, validation, notes + check_notes)
    first_half = np.arange(len(fit.time)) < len(fit.time) // 2
    note = "no check recording: fitted on the first half of the recording, validated on the second"
    return DataSplit(replace(whole, rows=first_half), replace(whole, rows=~first_half), (*notes, note))


def whole_recording(robot: Robot, noise: Noise, recording: Recording) -> tuple[DataSet, tuple[str, ...]]:
    """All samples of a recording, and notes on where it starts."""
    start, notes = start_position(robot, noise.position, recording)
    orientation, turned_notes = _start_orientation(with_measured_start(robot, start), noise, recording)
    rows = np.ones(len(recording.time), dtype=bool)
    return DataSet(recording, start, rows, orientation), (*notes, *turned_notes)


def _start_orientation(robot: Robot, noise: Noise, recording: Recording) -> tuple[Quaternion | None, tuple[str, ...]]:
    """The first orientation of a recording where it is significantly not that of statics, and a note; else None."""
    if noise.rotation is None:
        return None, ()
    expected = start_orientation(with_true_start(robot))
    rotations = rotation_vectors(recording.orientation[:START_ROWS], expected)
    measured = rotations[np.isfinite(rotations).all(axis=1)][:MAX_START_SAMPLES]
    if not len(measured):
        return None, ()
    mean = np.mean(measured, axis=0)
    if np.all(np.abs(mean) <= START_SIGNIFICANCE * noise.rotation / len(measured) ** 0.5):
        return None, ()
    w, x, y, z = orientations(mean[None, :], expected)[0].tolist()
    angle = float(np.degrees(np.linalg.norm(mean)))
    note = (
        f"{recording.path} starts {angle:.3g} degrees from the robot file's orientation, and the run starts there too"
    )
    return (w, x, y, z), (note,)
