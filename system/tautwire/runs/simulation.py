"""Co-simulates a robot over the winch speeds of a recording."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ..errors import RecordingError
from ..fmus.packaging import build_fmus
from ..fmus.slots import notes_on_unstated_units
from ..master import PiecewiseLinearInput, Recorder, RunStatistics, StepSizeControl
from ..recordings.recording import Recording, read_recording
from ..recordings.roughness import white_noise_deviation
from ..robots.robot import Robot
from .cosimulation import record_cosimulation, step_size_control_for, wire_fmus
from .halving import FirstPositionsRecorder, step_doubling_note
from .start import start_position, with_start
from .wiring import RobotWiring


def simulate_recording(
    robot: Robot,
    path: Path,
    recorder: Recorder,
    step: float,
    tolerance: float | None,
    until: float | None,
    progress: Callable[[str, float], None],
    call_timeout: float | None = None,
) -> tuple[RunStatistics, tuple[str, ...]]:
    """Record a run at the recording's times, up to ``until`` (s); returns its statistics and notes for the user.

    ``call_timeout`` is as for :func:`record_cosimulation`.

    Raises RecordingError where fewer than two samples lie before ``until``, ComponentError where an FMU fails: the
    recorder has what came before.
    """
    recording = read_recording(path, robot.cable_count)
    noise = robot.sensors.position_noise or white_noise_deviation(recording.position)
    start, notes = start_position(robot, noise, recording)
    count = _sample_count(recording, until)
    time, winch_speed = recording.time[:count], recording.winch_speed[:count]
    # The start is known; measurements need not stay in memory through a long run.
    del recording
    if robot.winch_numbers:
        notes = (*notes, f"{path}: winch speeds are what the winches are asked for")
    notes = (*notes, *notes_on_unstated_units(robot.fmus, robot.cable_count))
    with TemporaryDirectory(prefix="tautwire-simulate-") as folder:
        fmus = build_fmus(with_start(robot, start), Path(folder), partial(progress, "building"))
        source, first_positions = PiecewiseLinearInput(time, winch_speed), FirstPositionsRecorder(count, recorder)

        def run(
            rows: int, stepping: StepSizeControl, target: Recorder, activity: str = "estimating the error"
        ) -> RunStatistics:
            return record_cosimulation(
                fmus, source, time[:rows], stepping, target, partial(progress, activity), call_timeout
            )

        statistics = run(count, step_size_control_for(step, tolerance, time), first_positions, "co-simulating")
        notes = (*notes, *missing_column_notes(wire_fmus(fmus)), *statistics.fallback_notes())
        if statistics.fallback_notes() and tolerance is None:
            notes = (*notes, step_doubling_note(run, time, step, first_positions.positions))
    return statistics, (*notes, *statistics.warnings())


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


def missing_column_notes(wiring: RobotWiring) -> tuple[str, ...]:
    """A note on outputs that no FMU provides, so that the result has no column for them."""
    return (
        (f"not in the result, no FMU shows it: {', '.join(wiring.missing_columns)}",) if wiring.missing_columns else ()
    )
