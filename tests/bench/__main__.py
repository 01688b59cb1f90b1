"""Speed of the co-simulation: ``python -m tests.bench [PICTURE.svg]``; each time is the best of some runs."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

from tests.support.rigid_robots import crane_robot
from tests.support.robots import paper_robot

from .cables import time_per_step
from .precision import Curve, by_importers, by_tautwire, in_memory, native_speedup, picture, turn_about
from .ramp import CORNERS, RAMP
from .whole import run_in_turn

CRANE_RATES = np.arange(1.0, 9.0) / 4.0
CABLES = (3, 6, 12, 24, 48)
RUNS = 3
MICROMETRE, MILLIMETRE = 1e-6, 1e-3


def main(target: Path | None) -> None:
    with tempfile.TemporaryDirectory() as name:
        ours, memory, theirs = by_tautwire(Path(name) / "ramp"), in_memory(), by_importers(Path(name) / "importers")
        native = by_tautwire(Path(name) / "native", native=True)
        curves = [*ours, *native, *memory, *theirs]
        show(curves)
        ratios(ours, memory, theirs)
        for tolerance in (1e-6, 3e-6):
            result = turn_about(Path(name) / f"turns-{tolerance:g}", 0.145, tolerance)
            text = " and ".join(f"{ratio:.2f}" for ratio in result)
            print(f"145 ms, in turn with DOP853 at rtol {tolerance:g}: {text} times its time, Python and native")
        relaxing = native_speedup(Path(name) / "relaxation", 0.14)
        print(f"140 ms, relaxation in every cable: native FMUs take a {relaxing:.0f}th of the time of those of Python")
        show_whole(Path(name) / "whole")
        if target is not None:
            picture(curves).savefig(target)
        print("\n| cables | time per macro step | per cable |\n| --- | --- | --- |")
        for count in CABLES:
            best = min(time_per_step(count, Path(name) / str(count)) for _ in range(RUNS))
            print(f"| {count} | {1e3 * best:.2f} ms | {1e3 * best / count:.3f} ms |")


def show_whole(folder: Path) -> None:
    """The whole robot as one FMU beside its components: the paper's ramp, and a platform that turns on eight cables."""
    ramp = (paper_robot(), CORNERS, np.clip(RAMP * CORNERS[:, None], -1.0, 1.0))
    turning = (
        crane_robot(),
        np.linspace(0.0, 7.0, 15),
        np.sin(np.outer(np.linspace(0.0, 7.0, 15), CRANE_RATES)) / 50.0,
    )
    for label, (robot, corners, speeds), step in (
        ("three cables", ramp, 0.01),
        ("three cables", ramp, 0.14),
        ("eight cables, turning", turning, 0.01),
    ):
        run = run_in_turn(robot, corners, speeds, step, folder / f"{robot.name}")
        print(
            f"whole robot, {label}, {1e3 * step:g} ms: {1e3 * run.whole:.1f} ms, its components "
            f"{run.components / run.whole:.0f} times as long; ends {run.distance:.1g} m apart"
        )


def show(curves: list[Curve]) -> None:
    """All runs as a table."""
    print("The paper's ramp, 7 s: error of the end position, wall time\n\n| solver | | error | time |")
    print("| --- | --- | --- | --- |")
    for curve in curves:
        for point in curve.points:
            print(f"| {curve.label} | {point.setting} | {1e6 * point.error:.2g} um | {1e3 * point.seconds:.0f} ms |")


def ratios(ours: list[Curve], memory: list[Curve], theirs: list[Curve]) -> None:
    """The least time to an error, ours over solve_ivp's and the importers' over ours."""
    fixed, best = ours[0], min(curve.seconds_to(MICROMETRE) for curve in memory)
    print(f"\nto 1 um: {fixed.seconds_to(MICROMETRE) / best:.1f} times the wall time of the best solve_ivp")
    for curve in theirs:
        for label, error in (("1 mm", MILLIMETRE), ("10 um", 10.0 * MICROMETRE), ("1 um", MICROMETRE)):
            print(f"{curve.label} to {label}: {curve.seconds_to(error) / fixed.seconds_to(error):.1f} times our time")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else None)
