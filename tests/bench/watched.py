"""What watching a run costs: ``python -m tests.bench.watched``; the paper's ramp at 10 ms, best of some runs."""

from __future__ import annotations

import tempfile
from pathlib import Path
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage
from time import perf_counter

import numpy as np

from tautwire.cosimulation.robot_cosimulation import cosimulate
from tautwire.fmus.packaging import RobotFmus, build_fmus
from tests.bench.ramp import ramp
from tests.support.robots import paper_robot

RUNS = 20
STEP = 0.01
SHORT, LONG = 1.0, 7.0


def processor_time(whose: int) -> float:
    """What this process or those that it has ended have used, s."""
    usage = getrusage(whose)
    return usage.ru_utime + usage.ru_stime


def cost(fmus: RobotFmus, duration: float, patience: float | None) -> tuple[float, float, float]:
    """Wall time, processor time of this process and of the watched one, in s."""
    time = np.arange(0.0, duration + 0.5 * STEP, STEP)
    speeds = np.array([ramp(moment) for moment in time])
    before = perf_counter(), processor_time(RUSAGE_SELF), processor_time(RUSAGE_CHILDREN)
    cosimulate(fmus, time, speeds, STEP, patience=patience)
    after = perf_counter(), processor_time(RUSAGE_SELF), processor_time(RUSAGE_CHILDREN)
    return after[0] - before[0], after[1] - before[1], after[2] - before[2]


def main() -> None:
    kinds = [(duration, patience) for duration in (SHORT, LONG) for patience in (None, 60.0)]
    with tempfile.TemporaryDirectory() as name:
        fmus = build_fmus(paper_robot(), Path(name))
        runs = [[cost(fmus, *kind) for kind in kinds] for _ in range(RUNS)]
    short_here, short_apart, here, apart = np.min(runs, axis=0)
    steps = round((LONG - SHORT) / STEP)
    print("| run | wall time per step | processor time per step | of the watching process |\n| --- | --- | --- | --- |")
    for label, short, long in (("in this process", short_here, here), ("watched", short_apart, apart)):
        wall, own, child = 1e6 * (long - short) / steps
        watching = "" if label != "watched" else f"{own:.1f} us"
        print(f"| {label} | {wall:.1f} us | {child or own:.1f} us | {watching} |")
    begin = short_apart[0] - short_here[0] - (apart[0] - here[0] - short_apart[0] + short_here[0]) / (LONG - SHORT)
    print(f"\nStart and end of the other process: {1e3 * begin:.0f} ms")


if __name__ == "__main__":
    main()
