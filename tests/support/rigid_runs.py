"""Made-up runs and recordings of rigid platforms, for the tests of pages; nothing is simulated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from tautwire.cosimulation import RunStatistics
from tautwire.cosimulation.robot_cosimulation import CosimulationResult
from tautwire.cosimulation.robot_wiring import result_columns
from tautwire.estimation.trace_result import Comparison, Errors, Trace
from tautwire.recordings.recording import Recording
from tautwire.reports.run_overview import ReportedRun, RunOverview
from tautwire.robot.schema import Robot
from tests.support.traces import made_trace


def made_rigid_recording(robot: Robot, samples: int) -> Recording:
    """A platform that wanders and turns, with noise on all that is measured."""
    time, count = np.linspace(0.0, 40.0, samples), robot.cable_count
    random = np.random.default_rng(3)
    waves = np.sin(np.outer(time, np.linspace(0.3, 1.1, 6)))
    position = np.array(robot.platform.start) + 0.2 * waves[:, :3] + random.normal(0.0, 1e-4, (samples, 3))
    orientation = np.roll(Rotation.from_rotvec(0.1 * waves[:, 3:]).as_quat(canonical=True), 1, axis=1)
    tension = 600.0 + 50.0 * waves[:, :1] + random.normal(0.0, 2.0, (samples, count))
    speed = 0.05 * np.cos(np.outer(time, np.linspace(0.3, 1.1, count)))
    return Recording("rigid.csv", time, speed, tension, position, orientation=orientation)


def made_rigid_run(robot: Robot, samples: int) -> ReportedRun:
    """A run along that recording, with every column of a result file whose winches are FMUs."""
    recording = made_rigid_recording(robot, samples)
    columns = tuple(column.name for column in result_columns(robot.cable_count, robot.cable_numbers, is_rigid=True)[1:])
    random = np.random.default_rng(4)
    rows = random.normal(0.0, 0.01, (samples, len(columns)))
    known = {f"tension_{i}": recording.tension[:, i - 1] for i in robot.cable_numbers}
    known |= dict(zip(("x", "y", "z"), recording.position.T, strict=True))
    known |= dict(zip(("qw", "qx", "qy", "qz"), recording.orientation.T, strict=True))
    for name, values in known.items():
        rows[:, columns.index(name)] += values
    overview = RunOverview()
    for time, row in zip(recording.time, rows, strict=True):
        overview.add(float(time), row)
    statistics = RunStatistics(steps=samples, iterations=17, energy_residual=1e-7, energy_exchanged=250.0)
    return ReportedRun(robot, columns, overview, recording, statistics)


def made_rigid_trace(robot: Robot, samples: int) -> Trace:
    """A trace of that recording, which both models follow to the noise."""
    recording = made_rigid_recording(robot, samples)
    nothing = np.zeros_like(recording.tension)
    motion = CosimulationResult(
        recording.time,
        recording.position,
        np.zeros_like(recording.position),
        recording.tension,
        *(nothing, nothing, nothing),
        orientation=recording.orientation,
    )
    trace = made_trace(check=False, samples=100)
    errors = Errors(1e-4, 2.0, np.full(3, 1e-4), np.full(robot.cable_count, 2.0), 1e-4, np.full(3, 1e-4))
    comparison = Comparison("fit", recording, motion, motion, errors, errors)
    return replace(trace, robot_before=robot, robot_after=robot, comparisons=(comparison,), noise_floor=errors)
