"""Wall time of a macro step over the number of cables."""

from __future__ import annotations

from pathlib import Path
from time import perf_counter

import numpy as np

from tautwire.cosimulation import CouplingSolver, Experiment, FixedStep, MemoryRecorder, PiecewiseLinearInput, simulate
from tautwire.cosimulation.robot_cosimulation import instantiate_robot
from tautwire.cosimulation.robot_wiring import recorded_ports
from tautwire.fmus.packaging import build_fmus
from tautwire.robot.schema import Cable, Platform, Robot, Sensors


def wheel_of_cables(count: int) -> Robot:
    """A robot with any number of cables, all from above."""
    angles = 2.0 * np.pi * np.arange(count) / count
    anchors = [(50.0 * float(np.cos(a)), 50.0 * float(np.sin(a)), 50.0) for a in angles]
    cables = tuple(Cable(anchor, 1e11, 1e-5, 5e8, "logarithmic") for anchor in anchors)
    return Robot(f"{count} cables", 9.81, Platform(100.0 * count, (1.0, 2.0, 5.0)), None, Sensors(), cables)


def time_per_step(count: int, folder: Path) -> float:
    """Wall time of one macro step of 10 ms, s."""
    fmus = build_fmus(wheel_of_cables(count), folder)
    time = np.array([0.0, 1.0])
    speeds = np.vstack([np.zeros(count), np.linspace(-0.1, 0.1, count)])
    with instantiate_robot(fmus) as graph:
        coupling = CouplingSolver(graph)
        experiment = Experiment(PiecewiseLinearInput(time, speeds), time, FixedStep(0.01))
        kept = MemoryRecorder(2, len(recorded_ports(count)))
        begun = perf_counter()
        simulate(coupling, experiment, recorded_ports(count), kept)
        return (perf_counter() - begun) / coupling.statistics.steps
