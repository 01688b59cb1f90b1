"""Isolation: FMUs run in a worker process under a watchdog, so that one that hangs or crashes is named.

On Linux that process is a fork of this one: it starts in milliseconds, and source and system may be anything. A fork
lacks the other threads, whose locks may be held for ever; so it takes none of them: it calls FMUs, writes to a pipe
and a folder of its own, and ends. Elsewhere the process is a fresh Python: it takes half a second to start, and its
arguments must be picklable.
"""

from __future__ import annotations

import gc
import multiprocessing
import os
import pickle
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, closing, contextmanager, suppress
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic, sleep
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..errors import TautwireError
from ..fmus.component import ComponentError
from ..fmus.fmu_variables import Port
from ..process_signals import defer_interrupts, exit_with_parent, restore_default_signals
from .call_journal import CallEntry, CallJournal
from .coupling_graph import CouplingGraph
from .coupling_solver import CouplingSolver
from .run_statistics import RunStatistics
from .time_loop import Experiment, InputSource, Progress, Recorder, simulate

Array = NDArray[np.float64]
SystemBuilder = Callable[[CallJournal], AbstractContextManager[CouplingGraph]]

ROW_MESSAGE, STATISTICS_MESSAGE, ERROR_MESSAGE = b"r", b"a", b"e"
TEMPORARY_FOLDER_VARIABLES = ("TMPDIR", "TEMP", "TMP")


@dataclass(frozen=True)
class Job:
    """A co-simulation for a worker process; ``build_system`` is called there, the rest is as for :func:`simulate`."""

    build_system: SystemBuilder
    experiment: Experiment
    observed_outputs: tuple[Port, ...]


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
        job.build_system(journal) as graph,
        _sending_errors(sender),
    ):
        experiment = replace(job.experiment, input_source=_JournalledSource(job.experiment.input_source, journal))
        inputs = journal.allocate_inputs(graph.input_ports)
        coupling = CouplingSolver(graph, experiment.step_size_control.solver_options, inputs)
        simulate(coupling, experiment, job.observed_outputs, _PipeRecorder(sender))
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


CALL_TIMEOUT = 60.0
POLL_INTERVAL = 0.05
SHUTDOWN_TIMEOUT = 2.0
BATCH_DELAY = 0.005


class CallAbortedError(ComponentError):
    """An FMU call did not return: it hung, or its process ended there; ``status`` says which."""

    @property
    def outcome(self) -> str:
        """See :class:`ComponentError`."""
        return self.status


class RunAbortedError(TautwireError):
    """A run hung, or its process ended, while no FMU was being called; carries how, the time (s), and ``where``."""

    def __init__(
        self, status: str, time: float, where: str = "outside any FMU", hint: str = "check its external inputs"
    ) -> None:
        self.status = status
        self.time = time
        self.where = where
        super().__init__(f"the run {status} {where} at {time:.6g} s: {hint}")


class RemoteTracebackError(Exception):
    """The traceback of an error in the worker process, as text."""


def simulate_isolated(
    build_system: SystemBuilder,
    experiment: Experiment,
    observed_outputs: Sequence[Port],
    recorder: Recorder,
    progress: Progress | None = None,
    call_timeout: float = CALL_TIMEOUT,
) -> RunStatistics:
    """Co-simulate as :func:`simulate` does, in a worker process under a watchdog.

    ``build_system`` builds the coupling graph there, with components that use its argument, the call journal. The
    recorder and ``progress`` are called here; the experiment is a copy there. An FMU call that takes ``call_timeout``
    seconds is taken to hang. Ctrl-C ends the run within seconds. Returns the run statistics.

    Raises CallAbortedError where an FMU hangs or ends its process, RunAbortedError where the source does, and whatever
    the run raises; the recorder has the rows until then. No process and no temporary file remains.
    """
    job = Job(build_system, experiment, tuple(observed_outputs))
    with (
        defer_interrupts() as raise_interrupt,
        TemporaryDirectory(prefix="tautwire-run-", ignore_cleanup_errors=True) as folder,
        closing(CallJournal(Path(folder))) as journal,
        _worker_process(job, Path(folder), journal) as (process, receiver),
    ):
        messages = _receive_messages(process, receiver, journal, call_timeout, raise_interrupt)
        statistics = _record_rows(messages, experiment.times, recorder, progress)
        last_entry = journal.last_entry()
        process.join(SHUTDOWN_TIMEOUT)
        if statistics is None or (process.exitcode != 0 and last_entry.component is not None):
            raise _aborted_error(last_entry, _exit_reason(process.exitcode))
        return statistics


def _record_rows(
    messages: Iterable[bytes], times: Array, recorder: Recorder, progress: Progress | None
) -> RunStatistics | None:
    """Passes rows on to the recorder; returns the run statistics, None without any, or raises the worker's error."""
    statistics, row_count = None, 0
    for message in messages:
        content, kind = message[:-1], message[-1:]
        if kind == ROW_MESSAGE:
            recorder.add(float(times[row_count]), np.frombuffer(content))
            row_count += 1
            if progress is not None and row_count > 1:
                progress((row_count - 1) / (len(times) - 1))
        elif kind == ERROR_MESSAGE:
            error, text = pickle.loads(content)
            raise error from RemoteTracebackError(text)
        else:
            statistics = pickle.loads(content)
    return statistics


def start_method() -> Literal["fork", "spawn"]:
    """The start method of the worker process on this system, as :mod:`multiprocessing` names it."""
    return "fork" if sys.platform == "linux" else "spawn"


@contextmanager
def _worker_process(job: Job, folder: Path, journal: CallJournal) -> Iterator[tuple[BaseProcess, Connection]]:
    """The worker process and the receiving end of its pipe; the process is ended when the block ends."""
    context = multiprocessing.get_context(start_method())
    receiver, sender = context.Pipe(duplex=False)
    process: BaseProcess = context.Process(target=run_worker, args=(job, folder, sender))  # type: ignore[attr-defined]
    with warnings.catch_warnings():
        # Python 3.12 warns of any fork beside threads; the module docstring says why this one is safe.
        warnings.simplefilter("ignore", DeprecationWarning)
        process.start()
    sender.close()
    try:
        yield process, receiver
    finally:
        journal.request_stop()
        _shut_down(process, receiver)


def _receive_messages(
    process: BaseProcess,
    receiver: Connection,
    journal: CallJournal,
    call_timeout: float,
    raise_interrupt: Callable[[], None],
) -> Iterator[bytes]:
    """Yield the worker's messages until it ends; raises where it hangs."""
    idle, snapshot, has_more = 0.0, journal.snapshot(), False
    while True:
        raise_interrupt()
        if has_more or receiver.poll(POLL_INTERVAL):
            try:
                message = receiver.recv_bytes()
            except (EOFError, OSError):
                return
            yield message
            idle, has_more = 0.0, receiver.poll()
            if not has_more:
                # Rows in batches: waking for each would cost the worker more than writing it.
                sleep(BATCH_DELAY)
        elif not process.is_alive():
            return
        elif journal.snapshot() != snapshot:
            idle, snapshot = 0.0, journal.snapshot()
        elif idle < (call_timeout if journal.has_entries else max(call_timeout, CALL_TIMEOUT)):
            # Counted, not by a clock, which runs on while this process is suspended.
            idle += POLL_INTERVAL
        else:
            _kill(process)
            raise _aborted_error(journal.last_entry(), f"did not return for {call_timeout:g} s")


def _aborted_error(entry: CallEntry, status: str) -> TautwireError:
    if entry.component is None:
        return RunAbortedError(status, entry.time)
    return CallAbortedError(entry.component, entry.call, status, entry.time, entry.inputs, entry.messages)


def _exit_reason(code: int | None) -> str:
    """How a process has ended, in words."""
    if code is None:
        return "closed the pipe of its process"
    if code >= 0:
        return f"ended its process with exit status {code}"
    name = {known_signal.value: known_signal.name for known_signal in signal.Signals}.get(-code, f"signal {-code}")
    return f"ended its process by {name}" + (" (out of memory, or killed by hand)" if name == "SIGKILL" else "")


def _shut_down(process: BaseProcess, receiver: Connection) -> None:
    """Let the worker free its FMUs and exit; kill it, and all that it has started, where it does not."""
    deadline = monotonic() + SHUTDOWN_TIMEOUT
    with receiver:
        while process.is_alive() and monotonic() < deadline:
            # The worker may be blocked on a full pipe.
            with suppress(EOFError, OSError):
                if receiver.poll():
                    receiver.recv_bytes()
                    continue
            process.join(0.002)
    if process.exitcode != 0:
        _kill(process)
    process.close()


def _kill(process: BaseProcess) -> None:
    """Kill a process and all that it has started."""
    if sys.platform != "win32" and process.pid is not None:
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
    process.kill()
    process.join()
