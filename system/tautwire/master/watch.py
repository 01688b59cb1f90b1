"""Runs FMUs in a process of their own, so that one that hangs or dies is named and nothing is lost.

On Linux that process is a fork of this one: it starts in milliseconds, and source and system may be anything. A fork
lacks the other threads, whose locks may be held for ever; so it takes none of them: it calls FMUs, writes to a pipe
and a folder of its own, and ends. Elsewhere the process is a fresh Python: it takes half a second to start, and all
that it is given must be picklable.
"""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic, sleep
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import TautwireError
from ..interrupt import interrupts_held
from .apart import ERROR, ROW, Job, System, work
from .audit import Account
from .component import ComponentError
from .journal import Entry, Journal
from .simulation import Progress, Recorder, Source
from .stepping import Stepping
from .wiring import Port

Array = NDArray[np.float64]

PATIENCE = 60.0
POLL = 0.05
GRACE = 2.0
NAP = 0.005


class LostError(ComponentError):
    """An FMU did not come back from a call: it hung, or its process ended there; ``status`` says which."""

    @property
    def outcome(self) -> str:
        """See :class:`ComponentError`."""
        return self.status


class RunLostError(TautwireError):
    """A run hung, or its process ended, while no FMU was being called; carries how, and the time (s)."""

    def __init__(self, status: str, time: float) -> None:
        self.status = status
        self.time = time
        super().__init__(f"outside any FMU the run {status} at {time:.6g} s: look at what drives it")


class ElsewhereError(Exception):
    """Where in the other process an error was raised: the text of its traceback."""


def simulate_watched(
    system: System,
    source: Source,
    times: Array,
    observed: Sequence[Port],
    stepping: Stepping,
    recorder: Recorder,
    progress: Progress | None = None,
    patience: float = PATIENCE,
) -> Account:
    """Co-simulate as :func:`simulate` does, in another process that is watched from this one.

    ``system`` builds the coupling there, with components and input memory from the journal that it is given. The
    recorder and ``progress`` are called here; ``source`` and ``stepping`` work on copies. An FMU that is in the same
    call for ``patience`` seconds hangs. Ctrl-C ends the run within seconds. Returns the books.

    Raises LostError where an FMU hangs or ends its process, RunLostError where the source does, and whatever the run
    raises; the recorder has what came before. No process and no temporary file is left.
    """
    job = Job(system, source, times, tuple(observed), stepping)
    with (
        interrupts_held() as raise_interrupt,
        TemporaryDirectory(prefix="tautwire-run-", ignore_cleanup_errors=True) as folder,
        closing(Journal(Path(folder))) as journal,
        _started(job, Path(folder), journal) as (process, receiver),
    ):
        account, count = None, 0
        for message in _received(process, receiver, journal, patience, raise_interrupt):
            content, kind = message[:-1], message[-1:]
            if kind == ROW:
                recorder.add(float(times[count]), np.frombuffer(content))
                count += 1
                if progress is not None and count > 1:
                    progress((count - 1) / (len(times) - 1))
            elif kind == ERROR:
                error, text = pickle.loads(content)
                raise error from ElsewhereError(text)
            else:
                account = pickle.loads(content)
        lost = journal.last()
        process.join(GRACE)
        if account is None or (process.exitcode != 0 and lost.component is not None):
            raise _loss(lost, _fate(process.exitcode))
        return account


def start_method() -> Literal["fork", "spawn"]:
    """How the process starts on this system, as :mod:`multiprocessing` names it."""
    return "fork" if sys.platform == "linux" else "spawn"


@contextmanager
def _started(job: Job, folder: Path, journal: Journal) -> Iterator[tuple[BaseProcess, Connection]]:
    """The process at work, and the pipe's end at which its messages arrive; it is gone when the block ends."""
    context = multiprocessing.get_context(start_method())
    receiver, sender = context.Pipe(duplex=False)
    process: BaseProcess = context.Process(target=work, args=(job, folder, sender))  # type: ignore[attr-defined]
    with warnings.catch_warnings():
        # Python 3.12 warns of any fork beside threads; why this one is safe stands at the top.
        warnings.simplefilter("ignore", DeprecationWarning)
        process.start()
    sender.close()
    try:
        yield process, receiver
    finally:
        journal.stop()
        _end(process, receiver)


def _received(
    process: BaseProcess, receiver: Connection, journal: Journal, patience: float, raise_interrupt: Callable[[], None]
) -> Iterator[bytes]:
    """The process's messages until it is gone; raises where it hangs."""
    idle, mark, more = 0.0, journal.mark(), False
    while True:
        raise_interrupt()
        if more or receiver.poll(POLL):
            try:
                message = receiver.recv_bytes()
            except (EOFError, OSError):
                return
            yield message
            idle, more = 0.0, receiver.poll()
            if not more:
                # Rows in batches: to be woken for each would cost the other process more than to write it.
                sleep(NAP)
        elif not process.is_alive():
            return
        elif journal.mark() != mark:
            idle, mark = 0.0, journal.mark()
        elif idle < (patience if journal.begun else max(patience, PATIENCE)):
            # Not by a clock: that runs on while this process is stopped.
            idle += POLL
        else:
            _kill(process)
            raise _loss(journal.last(), f"did not return for {patience:g} s")


def _loss(entry: Entry, status: str) -> TautwireError:
    if entry.component is None:
        return RunLostError(status, entry.time)
    return LostError(entry.component, entry.call, status, entry.time, entry.inputs, entry.messages)


def _fate(code: int | None) -> str:
    """How a process has ended, in words."""
    if code is None:
        return "closed the pipe of its process"
    if code >= 0:
        return f"ended its process with exit status {code}"
    name = {known.value: known.name for known in signal.Signals}.get(-code, f"signal {-code}")
    return f"ended its process by {name}" + (" (out of memory, or killed by hand)" if name == "SIGKILL" else "")


def _end(process: BaseProcess, receiver: Connection) -> None:
    """Let the process free its FMUs and go; end it, and all that it has started, where it does not."""
    deadline = monotonic() + GRACE
    with receiver:
        while process.is_alive() and monotonic() < deadline:
            # It may be waiting for room in the pipe.
            with suppress(EOFError, OSError):
                if receiver.poll():
                    receiver.recv_bytes()
                    continue
            process.join(0.002)
    if process.exitcode != 0:
        _kill(process)
    process.close()


def _kill(process: BaseProcess) -> None:
    """End a process and all that it has started."""
    if sys.platform != "win32" and process.pid is not None:
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
    process.kill()
    process.join()
