"""Processor time of a whole robot as one FMU over that of its components coupled, all native, in turn."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tautwire.cosimulation import CouplingSolver, Experiment, FixedStep, MemoryRecorder, PiecewiseLinearInput, simulate
from tautwire.cosimulation.robot_cosimulation import instantiate_robot
from tautwire.cosimulation.robot_wiring import recorded_ports
from tautwire.fmus.packaging import RobotFmus, build_fmus, build_whole_fmu
from tautwire.robot.schema import Robot
from tests.support.whole_robots import run_whole

RUNS = 9
Array = NDArray[np.float64]


class WholeRun(NamedTuple):
    """Processor times in s of one FMU and of the components, and the distance of their end positions in m."""

    whole: float
    components: float
    distance: float


def run_in_turn(robot: Robot, time: Array, speeds: Array, step: float, folder: Path) -> WholeRun:
    """The least times of some runs over winch speeds (N, n), linear between ``time``, with steps of one length."""
    fmus, whole = build_fmus(robot, folder, native=True), build_whole_fmu(robot, folder)
    turns = []
    for _ in range(RUNS):
        rows, seconds = _timed(lambda begin: run_whole(whole, robot, time, speeds, step, lambda _: begin()))
        end, other_seconds = _timed(lambda begin: _coupled(fmus, time, speeds, step, begin))
        turns.append((seconds, other_seconds))
    least = np.min(turns, axis=0)
    return WholeRun(float(least[0]), float(least[1]), float(np.linalg.norm(rows[-1, :3] - end)))


def _timed(run: Callable[[Callable[[], None]], Array]) -> tuple[Array, float]:
    """What a run gives, and its time since it called its argument."""
    times = []
    result = run(lambda: times.append(process_time()))
    return result, process_time() - times[0]


def _coupled(fmus: RobotFmus, time: Array, speeds: Array, step: float, begin: Callable[[], None]) -> Array:
    """End position by the components."""
    ports = recorded_ports(len(fmus.cables), is_rigid=fmus.is_rigid)
    experiment = Experiment(PiecewiseLinearInput(time, speeds), time, FixedStep(step))
    with instantiate_robot(fmus) as graph:
        kept = MemoryRecorder(len(time), len(ports))
        coupling = CouplingSolver(graph, FixedStep(step).solver_options)
        begin()
        simulate(coupling, experiment, ports, kept)
        return kept.rows[-1, :3].copy()
