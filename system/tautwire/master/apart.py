"""What the process does that calls FMUs while another one watches it."""

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

from ..child import end_with_parent
from ..interrupt import as_by_default
from .coupling import Coupling
from .journal import Journal
from .simulation import Source, simulate
from .stepping import Stepping
from .wiring import Port

Array = NDArray[np.float64]
System = Callable[[Journal], AbstractContextManager[Coupling]]

ROW, ACCOUNT, ERROR = b"r", b"a", b"e"
TEMPORARY = ("TMPDIR", "TEMP", "TMP")


@dataclass(frozen=True)
class Job:
    """A co-simulation for another process; ``system`` builds it there, the rest is as for :func:`simulate`."""

    system: System
    source: Source
    times: Array
    observed: tuple[Port, ...]
    stepping: Stepping


class StoppedError(Exception):
    """The watching process wants no more."""


def work(job: Job, folder: Path, sender: Connection) -> None:
    """Do a job: rows go to the pipe as they come, then the account or the error.

    Each message ends with its kind. All temporary files go into ``folder``.
    """
    _settle_in(folder)
    journal = Journal(folder)
    with sender, suppress(Exception), _told(sender), job.system(journal) as coupling, _told(sender):
        simulate(coupling, _Noted(job.source, journal), job.times, job.observed, job.stepping, _Sent(sender))
        sender.send_bytes(pickle.dumps(coupling.account) + ACCOUNT)


def _settle_in(folder: Path) -> None:
    """Make this process one that leaves no trace and does not outlive the one that watches it."""
    as_by_default()
    if sys.platform != "win32":
        # With what FMUs may start, so that all of it can be ended together.
        os.setpgid(0, 0)
    for name in TEMPORARY:
        os.environ[name] = str(folder)
    tempfile.tempdir = str(folder)
    # What a fork inherits is the other process's to free.
    gc.freeze()
    # A fork's streams may be locked by a thread that it does not have.
    for number, name in ((1, "stdout"), (2, "stderr")):
        with suppress(OSError):
            setattr(sys, name, open(number, "w", buffering=1, encoding="utf-8", closefd=False))  # noqa: SIM115
    end_with_parent(folder)


@contextmanager
def _told(sender: Connection) -> Iterator[None]:
    """Errors of the block are sent before anything else is done about them."""
    try:
        yield
    except Exception as error:
        text = "".join(traceback.format_exception(error))
        try:
            content = pickle.dumps((error, text))
            pickle.loads(content)
        except Exception:
            content = pickle.dumps((RuntimeError(f"{type(error).__name__}: {error}"), text))
        sender.send_bytes(content + ERROR)
        raise


class _Sent:
    """See :class:`tautwire.master.Recorder`; the rows go into a pipe."""

    def __init__(self, sender: Connection) -> None:
        self._sender = sender

    def add(self, time: float, row: Array) -> None:
        self._sender.send_bytes(row.tobytes() + ROW)


class _Noted:
    """See :class:`tautwire.master.Source`; time that a source takes is not an FMU's."""

    def __init__(self, source: Source, journal: Journal) -> None:
        self._source = source
        self._journal = journal

    def interval(self, index: int, time: float, step: float, shown: Array) -> tuple[Array, Array]:
        if self._journal.stopped:
            raise StoppedError
        self._journal.rest(time)
        return self._source.interval(index, time, step, shown)
