"""The worker process, which calls FMUs under the watchdog of another process."""

from __future__ import annotations

import gc
import os
import pickle
import sys
import tempfile
import traceback
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..child import exit_with_parent
from ..interrupt import restore_default_signals
from .coupling import Coupling
from .journal import CallJournal
from .simulation import InputSource, simulate
from .stepping import StepSizeControl
from .wiring import Port

Array = NDArray[np.float64]
SystemBuilder = Callable[[CallJournal], AbstractContextManager[Coupling]]

ROW_MESSAGE, STATISTICS_MESSAGE, ERROR_MESSAGE = b"r", b"a", b"e"
TEMPORARY_FOLDER_VARIABLES = ("TMPDIR", "TEMP", "TMP")


@dataclass(frozen=True)
class Job:
    """A co-simulation for a worker process; ``build_system`` is called there, the rest is as for :func:`simulate`."""

    build_system: SystemBuilder
    input_source: InputSource
    times: Array
    observed_outputs: tuple[Port, ...]
    step_size_control: StepSizeControl


class StopRequestedError(Exception):
    """The watchdog has asked the worker to stop."""


def run_worker(job: Job, folder: Path, sender: Connection) -> None:
    """Run a job: rows go to the pipe as they come, then the run statistics or the error.

    Each message ends with its kind. All temporary files go into ``folder``.
    """
    _prepare_process(folder)
    journal = CallJournal(folder)
    with (
        sender,
        suppress(Exception),
        _sending_errors(sender),
        job.build_system(journal) as coupling,
        _sending_errors(sender),
    ):
        simulate(
            coupling,
            _JournalledSource(job.input_source, journal),
            job.times,
            job.observed_outputs,
            job.step_size_control,
            _PipeRecorder(sender),
        )
        sender.send_bytes(pickle.dumps(coupling.statistics) + STATISTICS_MESSAGE)


def _prepare_process(folder: Path) -> None:
    """Prepare this process to leave no temporary files and not to outlive the process that watches it."""
    restore_default_signals()
    if sys.platform != "win32":
        # A process group, so that whatever FMUs start can be ended together with this process.
        os.setpgid(0, 0)
    for name in TEMPORARY_FOLDER_VARIABLES:
        os.environ[name] = str(folder)
    tempfile.tempdir = str(folder)
    # Objects inherited by a fork are the parent's to free.
    gc.freeze()
    # A fork's streams may be locked by a thread that it does not have.
    for number, name in ((1, "stdout"), (2, "stderr")):
        with suppress(OSError):
            setattr(sys, name, open(number, "w", buffering=1, encoding="utf-8", closefd=False))  # noqa: SIM115
    exit_with_parent(folder)


@contextmanager
def _sending_errors(sender: Connection) -> Iterator[None]:
    """Send errors of the block before they are handled any further."""
    try:
        yield
    except Exception as error:
        text = "".join(traceback.format_exception(error))
        try:
            content = pickle.dumps((error, text))
            pickle.loads(content)
        except Exception:
            content = pickle.dumps((RuntimeError(f"{type(error).__name__}: {error}"), text))
        sender.send_bytes(content + ERROR_MESSAGE)
        raise


class _PipeRecorder:
    """A :class:`tautwire.cosimulation.Recorder` that writes rows into a pipe."""

    def __init__(self, sender: Connection) -> None:
        self._sender = sender

    def add(self, time: float, row: Array) -> None:
        self._sender.send_bytes(row.tobytes() + ROW_MESSAGE)


class _JournalledSource:
    """A :class:`tautwire.cosimulation.InputSource` that marks the journal idle: its own time is not an FMU's."""

    def __init__(self, source: InputSource, journal: CallJournal) -> None:
        self._source = source
        self._journal = journal

    def interval(self, index: int, time: float, step: float, outputs: Array) -> tuple[Array, Array]:
        if self._journal.stop_requested:
            raise StopRequestedError
        self._journal.mark_idle(time)
        return self._source.interval(index, time, step, outputs)
