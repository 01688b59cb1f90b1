"""Ctrl-C and SIGTERM end a trace that is inside foreign code, which returns to no signal handler."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tautwire.estimation.worker_pool import WorkerLostError, WorkerPool
from tests.cli.test_interrupted_commands import FIT, INTERRUPTED, ROBOT, descendants, names, parents, until
from tests.support.progress import without_progress_lines

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks at processes as Linux lists them")

# Well above the second that is promised, for a machine with much else to do.
MAX_SECONDS = 3.0
# Every compiled function begins by running for ever; the parent tells that it does by a file.
TRACE_WITH_AN_ENDLESS_CALL = """
import ctypes, os, sys
from pathlib import Path
from tautwire.estimation.native_functions import CompiledFunction
import tautwire.estimation
import numpy as np

def call_for_ever(self, count, *arguments):
    room = np.zeros(10**6)
    pointers = (ctypes.c_void_p * 50)(*[room.ctypes.data] * 48, self._constants.ctypes.data, room.ctypes.data)
    Path("inside").touch()
    self._native_run(0, 2**62, pointers, (ctypes.c_int64 * 50)())

if __name__ == "__main__":
    tautwire.estimation.processors = lambda: 1
    CompiledFunction.__call__ = call_for_ever
    from tautwire.cli import main
    main()
"""


@pytest.mark.validate
def test_an_interrupt_ends_a_trace_inside_a_compiled_call(tmp_path: Path) -> None:
    (tmp_path / "scratch").mkdir()
    (tmp_path / "endless.py").write_text(TRACE_WITH_AN_ENDLESS_CALL)
    process = subprocess.Popen(
        [sys.executable, "endless.py", "trace", ROBOT, FIT, "--out", "out"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env={**os.environ, "TMPDIR": str(tmp_path / "scratch")},
        text=True,
    )
    try:
        assert until((tmp_path / "inside").exists)
        others = descendants(process.pid)
        sent_at = time.monotonic()
        process.send_signal(signal.SIGINT)
        stdout, stderr = process.communicate(timeout=60)
        assert time.monotonic() - sent_at < MAX_SECONDS
    finally:
        process.kill()
    assert (without_progress_lines(stderr), stdout, process.returncode) == (INTERRUPTED, "", 1)
    assert until(lambda: not others & parents().keys(), MAX_SECONDS)
    assert names(tmp_path) == ["endless.py", "inside", "scratch"]
    assert names(tmp_path / "scratch") == []


def test_a_worker_ends_at_sigterm_inside_a_long_call() -> None:
    with WorkerPool(2) as workers:
        (number,) = {workers.submit(os.getpid).result()}
        hung = [workers.submit(time.sleep, 1000.0) for _ in range(2)]
        sent_at = time.monotonic()
        os.kill(number, signal.SIGTERM)
        with pytest.raises(WorkerLostError):
            hung[0].result()
        assert time.monotonic() - sent_at < MAX_SECONDS
