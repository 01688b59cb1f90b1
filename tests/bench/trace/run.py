"""Runs cases that have no line yet, each in a process of its own, and keeps their lines as they come."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from .cases import Case
from .line import Line, line_from, read_lines
from .sizes import strengths

PATIENCE = 1800.0
ONE = "tests.bench.trace.one"
ALONE = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def run(
    cases: Sequence[Case],
    folder: Path,
    code: str,
    jobs: int,
    tell: Callable[[Case, Line], None],
    kept: Sequence[Line] = (),
) -> dict[str, Line]:
    """A line for each case, by its name: those that are ``kept`` or in results.jsonl of the folder, and new ones.

    Old lines serve while neither the recordings nor the code have changed; cases that no version of the tracer has
    answered come first. A process that ends without a line, or takes more than half an hour, leaves a line that says
    so.
    """
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "results.jsonl"
    _drop_cut_line(path)
    lines = (*kept, *read_lines(path))
    done, answered = finished(cases, lines, code), finished(cases, lines)
    waiting = sorted((case for case in cases if case.key not in done), key=lambda case: case.key in answered)
    with path.open("a", encoding="utf-8") as file, ThreadPoolExecutor(jobs) as pool:
        futures = {pool.submit(_alone, case, folder, code): case for case in waiting}
        try:
            for future in as_completed(futures):
                line = future.result()
                file.write(line.text() + "\n")
                file.flush()
                done[line.key] = line
                tell(futures[future], line)
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return done


def finished(cases: Sequence[Case], lines: Sequence[Line], code: str | None = None) -> dict[str, Line]:
    """The newest line of each case on the recordings of today, by one version of the tracer or by any."""
    fingerprints = {case.key: case.fingerprint(case.effects(strengths(case))) for case in cases}
    by_version = (line for line in lines if code in (None, line.code))
    return {line.key: line for line in by_version if fingerprints.get(line.key) == line.fingerprint}


def _alone(case: Case, folder: Path, code: str) -> Line:
    command = [sys.executable, "-m", ONE, case.key, str(folder / "recordings"), code]
    # One case, one core: several at once do not slow each other down.
    alone = {**os.environ, **dict.fromkeys(ALONE, "1")}
    fingerprint = case.fingerprint(case.effects(strengths(case)))
    try:
        answer = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, env=alone, check=False)
    except subprocess.TimeoutExpired:
        return Line(case.key, fingerprint, code, failure=f"no answer in {PATIENCE:.0f} s")
    if answer.returncode != 0 or not answer.stdout.strip():
        failure = answer.stderr.strip() or f"ended with status {answer.returncode}"
        return Line(case.key, fingerprint, code, failure=failure)
    return line_from(answer.stdout.splitlines()[-1])


def _drop_cut_line(path: Path) -> None:
    """So that the next line begins in the first column."""
    if path.exists():
        text = path.read_text(encoding="utf-8")
        if text and not text.endswith("\n"):
            path.write_text(text[: text.rfind("\n") + 1], encoding="utf-8")
