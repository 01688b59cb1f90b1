"""Error against wall time on the paper's ramp: our master, explicit solvers in memory, and other importers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import process_time

import numpy as np
from matplotlib.figure import Figure

from tautwire.cosimulation import AdaptiveStep, FixedStep, StepSizeControl
from tautwire.fmus.packaging import build_fmus
from tests.importers.harness import IMPORTERS, NotInstallableError, exact_end, prepare, run_client
from tests.support.effect_cases import same
from tests.support.effects import with_effects
from tests.support.robots import paper_robot

from .ramp import by_fmus, by_solve_ivp

RUNS, TURNS = 9, 25
STEPS = (0.56, 0.4, 0.2, 0.145, 0.14, 0.1, 0.05, 0.02, 0.01, 0.005)
TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
RELATIVE = (1e-4, 1e-5, 3e-6, 1e-6, 1e-7, 1e-8, 1e-9)
THEIR_STEPS = (0.05, 0.04, 0.02, 0.01, 0.005, 0.002, 0.001)
PLAIN = ("by_fmpy.py", "by_libcosimpy.py", "by_ecospy.py", "by_cofmupy.py", "by_container.py")


@dataclass(frozen=True)
class Point:
    """One run: how it was set, error of the end position in m, wall time in s."""

    setting: str
    error: float
    seconds: float


@dataclass(frozen=True)
class Curve:
    """Runs of one solver."""

    label: str
    points: tuple[Point, ...]

    def seconds_to(self, error: float) -> float:
        """The least wall time with which the error is kept; infinite where none did."""
        return min((point.seconds for point in self.points if point.error <= error), default=np.inf)


def by_tautwire(folder: Path, native: bool = False) -> list[Curve]:
    """Our master, by steps of one length and by a tolerance, with FMUs of Python or native ones."""
    fmus = build_fmus(paper_robot(), folder, native=native)
    exact = exact_end(paper_robot())

    def run(stepping: Callable[[], StepSizeControl], setting: str) -> Point:
        runs = [by_fmus(fmus, stepping()) for _ in range(RUNS)]
        return Point(setting, distance(runs[0][0], exact), min(seconds for _, seconds, _ in runs))

    fixed = tuple(run(partial(FixedStep, step), f"{1e3 * step:g} ms") for step in STEPS)
    chosen = tuple(run(partial(AdaptiveStep, tolerance, 7.0), f"{tolerance:g} m") for tolerance in TOLERANCES)
    kind = "Tautwire, native FMUs" if native else "Tautwire"
    return [Curve(f"{kind}, --step", fixed), Curve(f"{kind}, --tolerance", chosen)]


def in_memory() -> list[Curve]:
    """scipy's explicit methods on the laws as one model in memory."""
    robot = paper_robot()
    exact = exact_end(robot)
    curves = []
    for method in ("DOP853", "RK45"):
        points = []
        for tolerance in RELATIVE:
            runs = [by_solve_ivp(robot, method, tolerance) for _ in range(RUNS)]
            points.append(Point(f"rtol {tolerance:g}", distance(runs[0][0], exact), min(run[1] for run in runs)))
        curves.append(Curve(f"solve_ivp {method}, one model in memory", tuple(points)))
    return curves


def turn_about(folder: Path, step: float, tolerance: float) -> tuple[float, float]:
    """Our processor time with a fixed step over that of DOP853 with a tolerance, in turn; the best of each.

    With FMUs of Python, and with native ones.
    """
    robot = paper_robot()
    python, native = (build_fmus(robot, folder / str(kind), native=kind) for kind in (False, True))
    turns = [
        (
            by_fmus(python, FixedStep(step), process_time)[1],
            by_fmus(native, FixedStep(step), process_time)[1],
            by_solve_ivp(robot, "DOP853", tolerance, process_time)[1],
        )
        for _ in range(TURNS)
    ]
    by_python, by_native, theirs = np.min(turns, axis=0)
    return float(by_python / theirs), float(by_native / theirs)


def native_speedup(folder: Path, step: float) -> float:
    """Processor time with FMUs of Python over that with native ones, with relaxation in every cable, in turn."""
    robot = with_effects(paper_robot(), same("relaxation", modulus=3e10, time=0.5))
    python, native = (build_fmus(robot, folder / str(kind), native=kind) for kind in (False, True))
    turns = [[by_fmus(fmus, FixedStep(step), process_time)[1] for fmus in (python, native)] for _ in range(RUNS)]
    by_python, by_native = np.min(turns, axis=0)
    return float(by_python / by_native)


def by_importers(folder: Path) -> list[Curve]:
    """Other masters with the same FMUs at fixed steps; those that cannot be installed are left out."""
    robot = paper_robot()
    exact = exact_end(robot)
    folder.mkdir()
    prepare(robot, folder)
    curves = []
    for importer in IMPORTERS:
        if importer.client not in PLAIN:
            continue
        try:
            results = [(step, run_client(importer, folder, step)) for step in THEIR_STEPS]
        except NotInstallableError as error:
            print(f"{importer.label}: {str(error).splitlines()[0]}")
            continue
        points = tuple(
            Point(
                f"{1e3 * step:g} ms", distance(result["position"], exact), result["steps"] / result["steps_per_second"]
            )
            for step, result in results
        )
        curves.append(Curve(importer.label, points))
    return curves


def distance(position: Sequence[float] | np.ndarray, exact: np.ndarray) -> float:
    """Of an end position from the exact one, m."""
    return float(np.linalg.norm(np.asarray(position) - exact))


def picture(curves: Sequence[Curve]) -> Figure:
    """Error over wall time, both logarithmic."""
    figure = Figure(figsize=(8.0, 5.0), layout="constrained")
    axes = figure.subplots()
    for curve in curves:
        ours = curve.label.startswith("Tautwire")
        axes.loglog(
            [point.seconds for point in curve.points],
            [point.error for point in curve.points],
            marker="o" if ours else ".",
            linewidth=2.0 if ours else 1.0,
            linestyle="--" if "memory" in curve.label else "-",
            label=curve.label,
        )
    axes.set_xlabel("wall time (s)")
    axes.set_ylabel("error of the end position (m)")
    axes.set_title("The paper's ramp, three cables, 7 s")
    axes.grid(visible=True, which="major", alpha=0.4)
    axes.legend(fontsize="small")
    return figure
