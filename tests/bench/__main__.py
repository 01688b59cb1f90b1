"""Speed of the co-simulation: ``python -m tests.bench``; each figure is the best of some runs."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from functools import partial
from itertools import pairwise
from pathlib import Path
from time import perf_counter

import numpy as np
from scipy.integrate import solve_ivp

from tautwire.assembly import assemble
from tautwire.cosimulation import instantiated, shown_ports
from tautwire.master import AdaptiveStep, FixedStep, Kept, Sampled, Stepping, simulate
from tautwire.packaging import RobotFmus, build_fmus
from tautwire.robot import Cable, Platform, Robot, Sensors
from tautwire_fmu.laws import cable as cable_law
from tautwire_fmu.laws import point_mass as platform_law
from tautwire_fmu.laws.mathematics import REAL
from tests.robots import paper_robot

RAMP = np.array([0.3, 0.25, -0.25])
CORNERS = np.array([0.0, 1.0 / 0.3, 4.0, 7.0])
RUNS = 3


def ramp(time: float) -> np.ndarray:
    return np.clip(RAMP * time, -1.0, 1.0)


def laws_in_memory(robot: Robot) -> Callable[[float, np.ndarray], list[float]]:
    """The laws as one right-hand side in floats, as a user of solve_ivp would write it."""
    assembly = assemble(robot)

    def rates(time: float, state: np.ndarray) -> list[float]:
        numbers = state.tolist()
        position, velocity, lengths = numbers[:3], numbers[3:6], numbers[6:]
        force, slopes = [0.0, 0.0, 0.0], []
        for component, length, speed in zip(assembly.cables, lengths, ramp(time).tolist(), strict=True):
            constants = component.constants
            own = cable_law.CableState(length, 0.0, ())
            line = cable_law.span(REAL, constants, cable_law.CableInputs(position, velocity, speed))
            moving = cable_law.motion(REAL, constants, (), own, line, speed)
            pull = cable_law.reading(REAL, constants, (), own, moving).force
            force = [a + b for a, b in zip(force, pull, strict=True)]
            slopes.append(cable_law.state_rates(REAL, constants, (), own, moving).unstrained_length)
        pushed = platform_law.acceleration(REAL, assembly.platform, (), (), position, velocity, force)
        return [*velocity, *pushed, *slopes]

    return rates


def by_solve_ivp(robot: Robot, method: str, tolerance: float) -> tuple[np.ndarray, float]:
    """End position and wall time, begun anew at each corner of the winch speeds."""
    rates = laws_in_memory(robot)
    lengths = [np.linalg.norm(np.array(a) - robot.platform.start) for a in robot.anchors]
    state = np.array([*robot.platform.start, 0.0, 0.0, 0.0, *lengths])
    begun = perf_counter()
    for first, last in pairwise(CORNERS):
        state = solve_ivp(rates, (first, last), state, method=method, rtol=tolerance, atol=tolerance * 1e-2).y[:, -1]
    return state[:3], perf_counter() - begun


def by_fmus(fmus: RobotFmus, stepping: Stepping) -> tuple[np.ndarray, float, int]:
    """End position, wall time of the run and macro steps."""
    speeds = np.array([ramp(time) for time in CORNERS])
    with instantiated(fmus) as coupling:
        kept = Kept(len(CORNERS), len(shown_ports(3)))
        begun = perf_counter()
        simulate(coupling, Sampled(CORNERS, speeds), CORNERS, shown_ports(3), stepping, kept)
        return kept.rows[-1, :3], perf_counter() - begun, coupling.account.steps


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
    with instantiated(fmus) as coupling:
        kept = Kept(2, len(shown_ports(count)))
        begun = perf_counter()
        simulate(coupling, Sampled(time, speeds), time, shown_ports(count), FixedStep(0.01), kept)
        return (perf_counter() - begun) / coupling.account.steps


def work_and_precision(folder: Path) -> None:
    """The paper's ramp: error at the end against wall time."""
    robot = paper_robot()
    fmus = build_fmus(robot, folder)
    exact, _ = by_solve_ivp(robot, "DOP853", 1e-13)
    print("The paper's ramp, 7 s: error of the end position, wall time\n\n| solver | error | time | steps |")
    print("| --- | --- | --- | --- |")
    for method in ("DOP853", "RK45"):
        for tolerance in (1e-5, 1e-6, 1e-7, 1e-9):
            runs = [by_solve_ivp(robot, method, tolerance) for _ in range(RUNS)]
            tell(f"solve_ivp {method}, {tolerance:g}", runs[0][0] - exact, [run[1] for run in runs], "")
    steppings: list[tuple[str, Callable[[], Stepping]]] = [
        *((f"Tautwire, steps of {1e3 * h:g} ms", partial(FixedStep, h)) for h in (0.05, 0.03, 0.02, 0.01)),
        *((f"Tautwire, tolerance {t:g} m", partial(AdaptiveStep, t, 7.0)) for t in (1e-5, 1e-6)),
    ]
    for label, make in steppings:
        results = [by_fmus(fmus, make()) for _ in range(RUNS)]
        tell(label, results[0][0] - exact, [result[1] for result in results], str(results[0][2]))


def tell(label: str, away: np.ndarray, times: list[float], steps: str) -> None:
    """A row of the table."""
    print(f"| {label} | {1e6 * np.linalg.norm(away):.2g} um | {1e3 * min(times):.0f} ms | {steps} |")


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        work_and_precision(Path(name) / "ramp")
        print("\n| cables | time per macro step | per cable |\n| --- | --- | --- |")
        for count in (3, 6, 12, 24, 48):
            best = min(time_per_step(count, Path(name) / str(count)) for _ in range(RUNS))
            print(f"| {count} | {1e3 * best:.2f} ms | {1e3 * best / count:.3f} ms |")


if __name__ == "__main__":
    main()
