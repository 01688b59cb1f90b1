"""Campaigns: runs a minute, what a run costs beside itself, and memory over 100,000 runs.

``python -m tests.bench.campaign [RUNS] [CHEAP]``; Linux only. A run is the paper's robot along a line, about a second
of computing. The bare loop makes the same runs in one process, which has their FMUs and its libraries already, as
workers have once they are prepared; rounds alternate, and each figure is the median of its rounds. What a task costs
beside its run is given as processor time too, which other processes affect less.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from statistics import median
from time import perf_counter, process_time, thread_time

import numpy as np
from psutil import Process
from threadpoolctl import threadpool_limits

from tautwire.campaigns.campaign_dataset import completed_runs, open_dataset
from tautwire.campaigns.campaign_plan import Plan
from tautwire.campaigns.campaign_run import build_context, run_job
from tautwire.campaigns.campaign_runner import planned_jobs, run_campaign
from tautwire.campaigns.dask_cluster import Task, context_future, dask_client, task_results
from tests.support.campaigns import read
from tests.support.memory import resident_memory

RUNS, CHEAP, ROUNDS = 8, 100_000, 3
ALONG = """
robot = "robot.toml"
[sample]
method = "random"
count = {count}
[vary]
cable.modulus = {{normal = [1.022e11, 2.2e9]}}
platform.mass = {{uniform = [280.0, 320.0]}}
[[path]]
end = [29.2, 0.3, 5.5]
duration = 4.0
"""
CHEAPLY = """
robot = "robot.toml"
[sample]
method = "random"
count = {count}
[vary]
platform.mass = {{uniform = [280.0, 320.0]}}
[compute]
modes = false
"""


def bare(plan: Plan, folder: Path) -> float:
    """Seconds for all runs one after the other in this process."""
    shared = build_context(plan, {})
    jobs = list(planned_jobs(plan, np.ones(plan.count, dtype=bool)))
    run_job(shared, jobs[0], folder)
    with threadpool_limits(1):
        begun = perf_counter()
        for job in jobs:
            run_job(shared, job, folder)
        return perf_counter() - begun


def over_workers(plan: Plan, folder: Path, workers: int) -> float:
    """Seconds from when workers are prepared to when all rows are there."""
    begun = 0.0

    def tell(what: str, done: float) -> None:
        nonlocal begun
        if what == "running" and done == 0.0:
            begun = perf_counter()

    with dask_client(None, workers) as client:
        # Each worker imports what it needs, and unpacks its FMUs, in a campaign before.
        before = replace(plan, count=2 * workers)
        with open_dataset(folder / "warm", before):
            run_campaign(before, folder / "warm", client, tell)
        with open_dataset(folder / "rows", plan):
            run_campaign(plan, folder / "rows", client, tell)
            return perf_counter() - begun


def speed(folder: Path, runs: int) -> None:
    """A table of runs a minute, and the overhead of one worker against the bare loop."""
    (folder / "plan").mkdir()
    plan = read(folder / "plan", ALONG.format(count=runs))
    ways: dict[str, Callable[[Path], float]] = {
        "bare loop": lambda place: bare(plan, place),
        "1 worker": lambda place: over_workers(plan, place, 1),
        "2 workers": lambda place: over_workers(plan, place, 2),
    }
    results: dict[str, list[float]] = {way: [] for way in ways}
    for round_ in range(ROUNDS):
        for way, timed in ways.items():
            results[way].append(timed(folder / f"{way} {round_}"))
    print(f"{runs} runs, medians of {ROUNDS} rounds\n\n| | s a run | runs a minute | against the bare loop |")
    print("| --- | --- | --- | --- |")
    loop = median(results["bare loop"])
    for way, seconds in results.items():
        took = median(seconds)
        ratios = [a / b for a, b in zip(seconds, results["bare loop"], strict=True)]
        print(f"| {way} | {took / runs:.3f} | {60.0 * runs / took:.0f} | {median(ratios):.3f} |")
    print(
        f"\noverhead of one worker: {100.0 * (median(results['1 worker']) / loop - 1.0):.1f} % of the bare loop's time"
    )


def busy(seconds: float) -> float:
    """Computes for so long, and returns the processor time that its thread had."""
    until, before = perf_counter() + seconds, thread_time()
    while perf_counter() < until:
        sum(range(1000))
    return thread_time() - before


def cost(folder: Path, tasks: int = 300, seconds: float = 10.0) -> None:
    """What a task costs beside its run, by tasks of one run of less than a millisecond, and what time costs.

    Of one long task: all that this process and its worker do beside it, by their processor time.
    """
    (folder / "little").mkdir()
    plan = read(folder / "little", CHEAPLY.format(count=tasks))
    with dask_client(None, 1) as client:
        workers = Process().children(recursive=True)

        def processor_time() -> tuple[float, float]:
            return process_time(), sum(sum(each.cpu_times()[:2]) for each in workers)

        shared = context_future(client, plan, {})
        jobs = planned_jobs(plan, np.ones(tasks, dtype=bool))
        begun, before = perf_counter(), processor_time()
        made = sum(len(some) for some in task_results(client, shared, plan, (Task((job,)) for job in jobs)))
        wall, after = perf_counter() - begun, processor_time()
        own, others = (1e3 * (b - a) / made for a, b in zip(before, after, strict=True))
        shown = f"processor time {own:.1f} ms here, {others:.1f} ms there"
        print(f"\na task beside its run: {1e3 * wall / made:.1f} ms; {shown}")
        begun, before = perf_counter(), processor_time()
        inside = client.submit(busy, seconds, pure=False).result()
        wall, after = perf_counter() - begun, processor_time()
    own, others = (1e3 * (b - a) / wall for a, b in zip(before, after, strict=True))
    print(f"a second beside its task: processor time {own:.1f} ms here, {others - 1e3 * inside / wall:.1f} ms there")


def memory(folder: Path, runs: int) -> None:
    """A table of memory while many cheap runs are made: of this process, with Dask's scheduler, and of its workers."""
    (folder / "cheap").mkdir()
    plan = read(folder / "cheap", CHEAPLY.format(count=runs))
    print(f"\n{runs} cheap runs on 2 workers\n\n| done | this process | its workers | wall time |")
    print("| --- | --- | --- | --- |")
    begun, tenths = perf_counter(), list(range(1, 11))

    def tell(what: str, done: float) -> None:
        if what == "running" and tenths and done >= 0.1 * tenths[0] - 1e-9:
            own, workers = resident_memory()
            seconds = perf_counter() - begun
            print(f"| {10 * tenths.pop(0)} % | {own:.0f} MB | {workers:.0f} MB | {seconds:.0f} s |", flush=True)

    out = folder / "many"
    with dask_client(None, 2) as client, open_dataset(out, plan):
        run_campaign(plan, out, client, tell)
        assert completed_runs(out, runs).all()
    size = sum(part.stat().st_size for part in out.rglob("*.parquet"))
    print(f"\n{len(list(out.rglob('*.parquet')))} parts, {size / 1e6:.1f} MB on disk")


def main() -> None:
    runs, cheap = (int(each) for each in (*sys.argv[1:], *(str(n) for n in (RUNS, CHEAP)[len(sys.argv) - 1 :])))
    with tempfile.TemporaryDirectory() as name:
        speed(Path(name), runs)
        cost(Path(name))
        memory(Path(name), cheap)


if __name__ == "__main__":
    main()
