"""Co-simulates a robot over a recording's winch speeds, with an error estimate by step doubling."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError
from ..fmus.fmu_slots import notes_on_user_fmus
from ..fmus.packaging import RobotFmus, build_fmus
from ..recordings.recording import Recording, read_recording
from ..recordings.start_position import at_recorded_start
from ..robot.rigid_equilibrium import orientation_notes
from ..robot.schema import Robot
from . import (
    ComponentError,
    Experiment,
    FixedStep,
    PiecewiseCubicInput,
    PiecewiseLinearInput,
    Recorder,
    RunStatistics,
    StepSizeControl,
)
from .robot_cosimulation import record_cosimulation, step_size_control_for, wire_fmus
from .run_arguments import SimulationOptions

Array = NDArray[np.float64]
Run = Callable[[int, StepSizeControl, Recorder], RunStatistics]

MAX_COMPARED_ROWS = 5000
# Error of the first run over its difference to the second, for a method of first order.
FIRST_ORDER_FACTOR = 2.0


class FirstPositionsRecorder:
    """A recorder that keeps the positions of the first rows, shape (N, 3), and passes every row on."""

    def __init__(self, count: int, recorder: Recorder | None = None) -> None:
        self._rows = np.empty((min(count, MAX_COMPARED_ROWS), 3))
        self._recorder = recorder
        self._count = 0

    def add(self, time: float, row: Array) -> None:
        """See :class:`tautwire.cosimulation.Recorder`."""
        if self._count < len(self._rows):
            self._rows[self._count] = row[:3]
            self._count += 1
        if self._recorder is not None:
            self._recorder.add(time, row)

    @property
    def positions(self) -> Array:
        """The positions recorded so far."""
        return self._rows[: self._count]


def step_doubling_note(run: Run, time: Array, step: float, positions: Array) -> str:
    """A note on the error of ``positions`` (N, 3), recorded at ``time`` (N or more,) in steps of ``step``.

    ``run(count, step_size_control, recorder)`` repeats the run, up to ``count`` of its times. The error is twice the
    difference of the two, as for a method of first order; for one of second order, where the error is 4/3 of the
    difference, this estimate is 50 % too large.
    """
    recorder = FirstPositionsRecorder(len(positions))
    try:
        run(len(positions), FixedStep(step, subdivision=2), recorder)
    except ComponentError as error:
        return f"no error estimate: with half the step, {error}"
    position_error = FIRST_ORDER_FACTOR * float(np.max(np.abs(positions - recorder.positions), initial=0.0))
    period = "" if len(positions) == len(time) else f" over the first {time[len(positions) - 1]:g} s"
    return f"estimated error of the position{period}: {position_error:.2g} m, from a second run with half the step"


@dataclass(frozen=True, eq=False)
class RecordedInputs:
    """The robot at the start of a recording, the recorded winch speeds, and notes for the user on both.

    Measurements are no part of it, so that they need not stay in memory through a long run.
    """

    robot: Robot
    inputs: PiecewiseLinearInput
    notes: tuple[str, ...]


def recorded_input(recording: Recording) -> PiecewiseLinearInput | PiecewiseCubicInput:
    """The winch speeds of a recording: linear between samples, or cubic where it has their rates."""
    if recording.winch_acceleration is None:
        return PiecewiseLinearInput(recording.time, recording.winch_speed)
    return PiecewiseCubicInput(recording.time, recording.winch_speed, recording.winch_acceleration)


def read_recorded_inputs(robot: Robot, path: Path, until: float | None = None) -> RecordedInputs:
    """Read the winch speeds of a recording up to ``until`` (s); RecordingError where these are fewer than two."""
    recording = read_recording(path, robot.cable_count, robot.recorded_columns)
    started, notes = at_recorded_start(robot, recording)
    count = _sample_count(recording, until)
    inputs = PiecewiseLinearInput(recording.time[:count], recording.winch_speed[:count])
    if robot.winch_numbers:
        notes = (*notes, f"{path}: winch speeds are taken as commands of the winches")
    notes = (*recording.notes, *notes, *notes_on_user_fmus(robot))
    return RecordedInputs(started, inputs, (*notes, *orientation_notes(started)))


def simulate_recording(
    recorded: RecordedInputs,
    recorder: Recorder,
    options: SimulationOptions,
    progress: Callable[[str, float], None],
) -> tuple[RunStatistics, tuple[str, ...]]:
    """Record a run at the recording's times; returns its statistics and notes for the user.

    Raises ComponentError where an FMU fails: the recorder has what came before.
    """
    with TemporaryDirectory(prefix="tautwire-simulate-") as folder:
        fmus = build_fmus(recorded.robot, Path(folder), partial(progress, "building"), native=options.native)
        statistics, run_notes = _run_with_error_estimate(fmus, recorded.inputs, recorder, options, progress)
    return statistics, (*recorded.notes, *run_notes, *statistics.warnings())


def _run_with_error_estimate(
    fmus: RobotFmus,
    inputs: PiecewiseLinearInput,
    recorder: Recorder,
    options: SimulationOptions,
    progress: Callable[[str, float], None],
) -> tuple[RunStatistics, tuple[str, ...]]:
    """Run over the samples of the inputs; the notes estimate the error where FMUs lack a capability."""
    time, first_positions = inputs.time, FirstPositionsRecorder(len(inputs.time), recorder)

    def run(
        rows: int, step_size_control: StepSizeControl, target: Recorder, activity: str = "estimating the error"
    ) -> RunStatistics:
        experiment = Experiment(inputs, time[:rows], step_size_control)
        return record_cosimulation(fmus, experiment, target, partial(progress, activity), options.call_timeout)

    step_size_control = step_size_control_for(options.step, options.tolerance, time)
    statistics = run(len(time), step_size_control, first_positions, "co-simulating")
    notes = (*missing_column_notes(wire_fmus(fmus).missing_columns), *statistics.fallback_notes())
    if statistics.fallback_notes() and options.tolerance is None:
        notes = (*notes, step_doubling_note(run, time, options.step, first_positions.positions))
    return statistics, notes


def _sample_count(recording: Recording, until: float | None) -> int:
    """Number of samples up to ``until``."""
    count = len(recording.time) if until is None else int(np.searchsorted(recording.time, until, side="right"))
    if count < 2:
        raise RecordingError(
            recording.path,
            f"fewer than two samples up to {until:g} s",
            f"give --until after {recording.time[1]:g}",
        )
    return count


def missing_column_notes(missing_columns: Sequence[str]) -> tuple[str, ...]:
    """A note on columns that the result lacks, as no FMU outputs them."""
    return (f"not in the result, as no FMU outputs it: {', '.join(missing_columns)}",) if missing_columns else ()
