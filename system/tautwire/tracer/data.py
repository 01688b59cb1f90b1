"""What a trace is judged on: the recordings, where each starts, and which samples fit and which judge."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..recording import AXES, Recording
from ..robot import Robot
from .filter_step import Noise

START_SIGNIFICANCE = 6.0
# The robot starts at rest: its first samples are of one place.
START_ROWS, START_SAMPLES = 10, 5


@dataclass(frozen=True)
class Sample:
    """Samples of a recording from one place: ``rows`` (N,) tells which of them count."""

    recording: Recording
    start: tuple[float, float, float]
    rows: NDArray[np.bool_]


@dataclass(frozen=True)
class Evidence:
    """What fits and what judges; never the same samples."""

    fit: Sample
    judge: Sample
    notes: tuple[str, ...]


def split(robot: Robot, noise: Noise, fit: Recording, check: Recording | None) -> Evidence:
    """Judge on the check recording, or on the second half of the only one."""
    fit_start, notes = start_of(robot, noise, fit)
    everything = np.ones(len(fit.time), dtype=bool)
    if check is not None:
        check_start, check_notes = start_of(robot, noise, check)
        return Evidence(
            Sample(fit, fit_start, everything),
            Sample(check, check_start, np.ones(len(check.time), dtype=bool)),
            notes + check_notes,
        )
    first = np.arange(len(fit.time)) < len(fit.time) // 2
    said = "no check recording: the second half of the recording judged what the first half fitted"
    return Evidence(Sample(fit, fit_start, first), Sample(fit, fit_start, ~first), (*notes, said))


def start_of(robot: Robot, noise: Noise, recording: Recording) -> tuple[tuple[float, float, float], tuple[str, ...]]:
    """Where a recording starts: where it says, if that differs significantly from the robot file."""
    declared = np.array(robot.platform.start)
    away, spread = np.zeros(3), np.full(3, np.inf)
    for axis, column in enumerate(recording.position[:START_ROWS].T):
        seen = column[np.isfinite(column)][:START_SAMPLES]
        if len(seen):
            away[axis], spread[axis] = float(np.mean(seen)) - declared[axis], noise.position / len(seen) ** 0.5
    if np.all(np.abs(away) <= START_SIGNIFICANCE * spread):
        return robot.platform.start, ()
    start = declared + away
    shown = ", ".join(f"{axis} {value:.6g}" for axis, value in zip(AXES, start, strict=True))
    note = f"{recording.path} starts at {shown} m, not at the robot file's start; the run starts where it says"
    return (float(start[0]), float(start[1]), float(start[2])), (note,)


def placed(robot: Robot, start: tuple[float, float, float]) -> Robot:
    """The robot at another start."""
    return robot if start == robot.platform.start else replace(robot, platform=replace(robot.platform, start=start))
