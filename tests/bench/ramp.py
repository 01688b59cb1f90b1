"""The paper's ramp by the laws in memory and by FMUs: end position and wall time."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from time import perf_counter

import numpy as np
from scipy.integrate import solve_ivp

from tautwire.cosimulation import (
    CouplingSolver,
    Experiment,
    MemoryRecorder,
    PiecewiseLinearInput,
    StepSizeControl,
    simulate,
)
from tautwire.cosimulation.robot_cosimulation import instantiate_robot
from tautwire.cosimulation.robot_wiring import recorded_ports
from tautwire.fmus.packaging import RobotFmus
from tautwire.robot.robot_assembly import assemble_robot
from tautwire.robot.schema import Robot
from tautwire_fmu.laws import cable as cable_law
from tautwire_fmu.laws import point_mass as platform_law
from tautwire_fmu.laws.mathematics import REAL

RAMP = np.array([0.3, 0.25, -0.25])
CORNERS = np.array([0.0, 1.0 / 0.3, 4.0, 7.0])


def ramp(time: float) -> np.ndarray:
    return np.clip(RAMP * time, -1.0, 1.0)


def laws_in_memory(robot: Robot) -> Callable[[float, np.ndarray], list[float]]:
    """The laws as one right-hand side in floats, as a user of solve_ivp would write it."""
    assembly = assemble_robot(robot)

    def rates(time: float, state: np.ndarray) -> list[float]:
        numbers = state.tolist()
        position, velocity, lengths = numbers[:3], numbers[3:6], numbers[6:]
        force, slopes = [0.0, 0.0, 0.0], []
        for component, length, speed in zip(assembly.cables, lengths, ramp(time).tolist(), strict=True):
            constants = component.constants
            own = cable_law.CableState(length, 0.0, ())
            line = cable_law.span(REAL, constants, cable_law.CableInputs(position, velocity, speed))
            moving = cable_law.cable_motion(REAL, constants, (), own, line, speed)
            pull = cable_law.cable_outputs(REAL, constants, (), own, moving).force
            force = [a + b for a, b in zip(force, pull, strict=True)]
            slopes.append(cable_law.state_rates(REAL, constants, (), own, moving).unstrained_length)
        pushed = platform_law.acceleration(REAL, assembly.platform, (), (), force)
        return [*velocity, *pushed, *slopes]

    return rates


def by_solve_ivp(
    robot: Robot, method: str, tolerance: float, clock: Callable[[], float] = perf_counter
) -> tuple[np.ndarray, float]:
    """End position and wall time, or that of another clock; begun anew at each corner of the winch speeds."""
    rates = laws_in_memory(robot)
    lengths = [np.linalg.norm(np.array(a) - robot.platform.start) for a in robot.anchors]
    state = np.array([*robot.platform.start, 0.0, 0.0, 0.0, *lengths])
    begun = clock()
    for first, last in pairwise(CORNERS):
        state = solve_ivp(rates, (first, last), state, method=method, rtol=tolerance, atol=tolerance * 1e-2).y[:, -1]
    return state[:3], clock() - begun


def by_fmus(
    fmus: RobotFmus, stepping: StepSizeControl, clock: Callable[[], float] = perf_counter
) -> tuple[np.ndarray, float, int]:
    """End position, wall time of the run, or that of another clock, and macro steps."""
    speeds = np.array([ramp(time) for time in CORNERS])
    experiment = Experiment(PiecewiseLinearInput(CORNERS, speeds), CORNERS, stepping)
    with instantiate_robot(fmus) as graph:
        coupling = CouplingSolver(graph, stepping.solver_options)
        kept = MemoryRecorder(len(CORNERS), len(recorded_ports(3)))
        begun = clock()
        simulate(coupling, experiment, recorded_ports(3), kept)
        return kept.rows[-1, :3], clock() - begun, coupling.statistics.steps
