"""Co-simulates a robot over the winch speeds of a recording."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from ..errors import RecordingError
from ..fmus.packaging import build_fmus
from ..fmus.slots import unstated_units
from ..master import Account, Recorder, Sampled, Stepping
from ..recordings.recording import Recording, read_recording
from ..recordings.roughness import roughness
from ..robots.robot import Robot
from .cosimulation import record, stepping_by, wired
from .halving import Beginning, error_by_halving
from .start import placed, start_of
from .wiring import RobotWiring


def simulate_recording(
    robot: Robot,
    path: Path,
    recorder: Recorder,
    step: float,
    tolerance: float | None,
    until: float | None,
    progress: Callable[[str, float], None],
    patience: float | None = None,
) -> tuple[Account, tuple[str, ...]]:
    """Record a run at the recording's times, up to ``until`` (s); returns its books and what the user should know.

    ``patience`` is as for :func:`tautwire.runs.cosimulation.record`.

    Raises RecordingError where fewer than two samples lie before ``until``, ComponentError where an FMU fails: the
    recorder has what came before.
    """
    recording = read_recording(path, robot.cable_count)
    noise = robot.sensors.position_noise or roughness(recording.position)
    start, notes = start_of(robot, noise, recording)
    count = _count(recording, until)
    time, winch_speed = recording.time[:count], recording.winch_speed[:count]
    # Where a long run starts is known; what was measured need not stay in memory all through it.
    del recording
    if robot.winch_numbers:
        notes = (*notes, f"{path}: winch speeds are what the winches are asked for")
    notes = (*notes, *unstated_units(robot.fmus, robot.cable_count))
    with TemporaryDirectory(prefix="tautwire-simulate-") as folder:
        fmus = build_fmus(placed(robot, start), Path(folder), partial(progress, "building"))
        source, begun = Sampled(time, winch_speed), Beginning(count, recorder)

        def run(rows: int, stepping: Stepping, into: Recorder, what: str = "estimating the error") -> Account:
            return record(fmus, source, time[:rows], stepping, into, partial(progress, what), patience)

        account = run(count, stepping_by(step, tolerance, time), begun, "co-simulating")
        notes = (*notes, *lacking_notes(wired(fmus)), *account.fallbacks())
        if account.fallbacks() and tolerance is None:
            notes = (*notes, error_by_halving(run, time, step, begun.positions))
    return account, (*notes, *account.warnings())


def _count(recording: Recording, until: float | None) -> int:
    """How many samples lie before ``until``."""
    count = len(recording.time) if until is None else int(np.searchsorted(recording.time, until, side="right"))
    if count < 2:
        raise RecordingError(
            recording.path,
            f"fewer than two samples up to {until:g} s",
            f"give --until after {recording.time[1]:g}",
        )
    return count


def lacking_notes(wiring: RobotWiring) -> tuple[str, ...]:
    """What some FMU does not show, so that the result has no column for it."""
    return (f"not in the result, no FMU shows it: {', '.join(wiring.unrecorded)}",) if wiring.unrecorded else ()
