"""Traces one case in a process of its own: ``python -m tests.bench.trace.one CASE FOLDER CODE`` prints its line."""

from __future__ import annotations

import sys
import traceback
from dataclasses import replace
from pathlib import Path
from resource import RUSAGE_CHILDREN, RUSAGE_SELF, getrusage

from tautwire.estimation import trace

from .cases import Case
from .line import Line, Used, line_of
from .recordings import material
from .selection import case_called
from .sizes import strengths


def traced(case: Case, folder: Path, code: str) -> Line:
    """What the tracer says of a case; it gets the robot's file and two recordings, nothing else."""
    fingerprint = case.fingerprint(case.effects(strengths(case)))
    robot, fit, check, truth = material(case, folder)
    begun = processor_time()
    try:
        trace_result = trace(robot, fit, check, lambda what, done: None)
    except Exception:
        return Line(case.key, fingerprint, code, truth=truth, failure=traceback.format_exc())
    used = Used(processor_time() - begun, getrusage(RUSAGE_SELF).ru_maxrss / 1e3)
    return replace(line_of(case.key, fingerprint, code, trace_result, used), truth=truth)


def processor_time() -> float:
    """What this process and those that it has ended have used, s."""
    usages = (getrusage(RUSAGE_SELF), getrusage(RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


def main() -> None:
    key, folder, code = sys.argv[1:]
    print(traced(case_called(key), Path(folder), code).text())


if __name__ == "__main__":
    main()
