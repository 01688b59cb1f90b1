"""Co-simulates a robot over the winch speeds of a recording."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from .cosimulation import Motion, cosimulate
from .errors import RecordingError
from .packaging import build_fmus
from .recording import read_recording
from .robot import Robot
from .roughness import roughness
from .start import placed, start_of


def simulate_recording(
    robot: Robot,
    path: Path,
    step: float,
    tolerance: float | None,
    until: float | None,
    progress: Callable[[str, float], None],
) -> tuple[Motion, tuple[str, ...]]:
    """The run at the recording's times, up to ``until`` (s), and what the user should know of it.

    Raises RecordingError where fewer than two samples lie before ``until``.
    """
    recording = read_recording(path, robot.cable_count)
    noise = robot.sensors.position_noise or roughness(recording.position)
    start, notes = start_of(robot, noise, recording)
    count = len(recording.time) if until is None else int(np.searchsorted(recording.time, until, side="right"))
    if count < 2:
        raise RecordingError(
            str(path),
            f"fewer than two samples up to {until:g} s",
            f"give --until after {recording.time[1]:g}",
        )
    with TemporaryDirectory(prefix="tautwire-simulate-") as folder:
        fmus = build_fmus(placed(robot, start), Path(folder))
        motion = cosimulate(
            fmus,
            recording.time[:count],
            recording.winch_speed[:count],
            step,
            tolerance,
            lambda done: progress("co-simulating", done),
        )
    warning = motion.account.warning()
    return motion, notes if warning is None else (*notes, warning)
