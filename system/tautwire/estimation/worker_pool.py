"""Worker processes: a pool for fits and co-simulations of a trace, and forks for what cannot be pickled."""

from __future__ import annotations

import os
import pickle
import signal
import tempfile
import warnings
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack, contextmanager
from functools import cache, partial
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from types import TracebackType
from typing import Any, Generic, TypeVar

from threadpoolctl import threadpool_limits

from ..cosimulation.isolation import start_method
from ..errors import TautwireError
from ..process_signals import TERMINATION_SIGNALS, exit_with_parent, restore_default_signals

Item = TypeVar("Item")
Result = TypeVar("Result")

# Seconds between two checks whether the user wants to stop.
POLL_INTERVAL = 0.1


class WorkerLostError(TautwireError):
    """A worker process ended before its work did; carries how many there were."""

    def __init__(self, processes: int) -> None:
        self.processes = processes
        super().__init__(
            f"one of {processes} worker processes ended unexpectedly, killed or out of memory: run again with "
            "more free memory, or with fewer processors (taskset on Linux)"
        )


def processors() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class PendingResult(Generic[Result]):
    """A pending result; ``result`` waits for it."""

    def __init__(
        self,
        start: Callable[[], Future[Result]] | None,
        compute: Callable[[], Result],
        poll_interrupts: Callable[[], None],
        processes: int,
    ) -> None:
        self._start, self._compute = start, cache(compute)
        self._poll_interrupts, self._processes = poll_interrupts, processes
        self._future = start() if start else None

    @property
    def is_done(self) -> bool:
        """Whether the result is there, or need not be waited for."""
        return self._future is None or self._future.done()

    def begin(self) -> None:
        """Do the work here and now, unless that was done or a process does it."""
        if self._future is None:
            self._compute()

    def restart(self) -> None:
        """Start the work anew, in another process."""
        if self._start is not None:
            self._future = self._start()

    def result(self) -> Result:
        """The result, or what the work raised. Without a process of its own it is done here."""
        if self._future is None:
            return self._compute()
        while not wait([self._future], POLL_INTERVAL).done:
            self._poll_interrupts()
        with _worker_loss_raised(self._processes, self._poll_interrupts):
            return self._future.result()


class WorkerPool:
    """Pool of worker processes that call functions with picklable arguments; with one process, they run here.

    ``poll_interrupts`` is called while they are waited for. Leaving the context ends the processes, whatever they do,
    and removes what they left in temporary folders. A program that asks for more than one process has to guard its main
    module by ``if __name__ == "__main__"``, as multiprocessing wants.
    """

    def __init__(self, processes: int, poll_interrupts: Callable[[], None] = lambda: None) -> None:
        self.processes = processes
        self.poll_interrupts = poll_interrupts
        self._folder = tempfile.TemporaryDirectory(prefix="tautwire-workers-") if processes > 1 else None
        self._executor: ProcessPoolExecutor | None = None
        self._pending: list[PendingResult[Any]] = []
        self._dropped: list[Future[Any]] = []

    def __enter__(self) -> WorkerPool:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end_processes()
        if self._folder is not None:
            self._folder.cleanup()

    def _end_processes(self) -> None:
        if self._executor is None:
            return
        # The executor has no public way to end work that has begun.
        running = list((getattr(self._executor, "_processes", None) or {}).values())
        self._executor.shutdown(wait=False, cancel_futures=True)
        for process in running:
            process.kill()
        for process in running:
            process.join()
        self._executor = None

    def abandon_calls(self) -> None:
        """End dropped calls that are still in progress; those that were submitted for a result begin anew."""
        if all(future.done() for future in self._dropped):
            return
        self._dropped = []
        unfinished = [pending for pending in self._pending if not pending.is_done]
        self._end_processes()
        for pending in unfinished:
            pending.restart()

    def warm_up(self) -> None:
        """Start the processes, which takes a while; else the first call does."""
        if self._started_executor() is not None:
            for _ in range(self.processes):
                self._submit(_no_operation)

    def submit(self, function: Callable[..., Result], *arguments: Any) -> PendingResult[Result]:
        """Start a call; its result may be fetched once."""
        start = None if self.processes == 1 else partial(self._submit, function, *arguments)
        pending = PendingResult(start, partial(function, *arguments), self.poll_interrupts, self.processes)
        self._pending.append(pending)
        return pending

    def map_unordered(
        self, function: Callable[..., Result], calls: Sequence[tuple[Any, ...]]
    ) -> Generator[tuple[int, Result]]:
        """Number and result of each call, in the order in which they end; closing it drops those not begun."""
        if self._started_executor() is None:
            for number, arguments in enumerate(calls):
                yield number, function(*arguments)
            return
        futures = {self._submit(function, *arguments): number for number, arguments in enumerate(calls)}
        waiting = set(futures)
        try:
            while waiting:
                self.poll_interrupts()
                done, waiting = wait(waiting, POLL_INTERVAL, FIRST_COMPLETED)
                for future in sorted(done, key=futures.__getitem__):
                    with _worker_loss_raised(self.processes, self.poll_interrupts):
                        result = future.result()
                    yield futures[future], result
        finally:
            self._dropped += [future for future in waiting if not future.cancel()]

    def _submit(self, function: Callable[..., Result], *arguments: Any) -> Future[Result]:
        with _interrupts_blocked(), _worker_loss_raised(self.processes, self.poll_interrupts):
            future: Future[Result] = self._started_executor().submit(function, *arguments)
            return future

    def _started_executor(self) -> Any:
        if self.processes > 1 and self._executor is None and self._folder is not None:
            # Not forked: threads of libraries would be missing. No fork server: its socket's path may be too long.
            self._executor = ProcessPoolExecutor(
                self.processes, get_context("spawn"), _initialise_worker, (self._folder.name,)
            )
        return self._executor


@contextmanager
def _worker_loss_raised(processes: int, poll_interrupts: Callable[[], None]) -> Iterator[None]:
    try:
        yield
    except BrokenProcessPool as error:
        # A signal to all processes of a group ends the workers first.
        poll_interrupts()
        raise WorkerLostError(processes) from error


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Processes started in the block receive no Ctrl-C and the like while they start; here it is only delayed."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    previous_mask = signal.pthread_sigmask(signal.SIG_BLOCK, set(TERMINATION_SIGNALS))
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, previous_mask)


def _no_operation() -> None:
    """No operation: makes a process start."""


def _initialise_worker(folder: str) -> None:
    """Leave Ctrl-C to the parent; make temporary folders where the parent removes them."""
    restore_default_signals()
    exit_with_parent(Path(folder))
    tempfile.tempdir = folder
    threadpool_limits(1)


def map_in_forks(
    function: Callable[[Item], Result], items: Sequence[Item], report: Callable[[int], None]
) -> list[Result]:
    """Results of a function of each item, computed here and in forks of this process, which share its memory.

    Items and function need not be picklable, as results must. Where processes are not forked all is done here.
    ``report`` gets about how many items are begun. The function must not wait for other threads: a fork has none.
    Raises what the function raises, or its text where that cannot be pickled, and WorkerLostError where a fork ends
    before it has answered.
    """
    count = min(processors(), len(items)) if start_method() == "fork" else 1
    shares = [items[number::count] for number in range(count)]
    with ExitStack() as stack:
        receivers = [stack.enter_context(_forked(function, share)) for share in shares[1:]]
        results: list[list[Result]] = [[]]
        for number, item in enumerate(shares[0] if shares else []):
            report(number * count)
            results[0].append(function(item))
        try:
            answers = [receiver.recv() for receiver in receivers]
        except EOFError as error:
            raise WorkerLostError(count) from error
        for answer in answers:
            if isinstance(answer, Exception):
                raise answer
            results.append(answer)
    return [results[index % count][index // count] for index in range(len(items))]


@contextmanager
def _forked(function: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[Connection]:
    """A pipe from a fork that sends the results of all items; the fork ends with the block, whatever it does."""
    context = get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_send_results, args=(function, items, sender))
    try:
        with _interrupts_blocked(), warnings.catch_warnings():
            # Python 3.12 warns of any fork beside threads.
            warnings.simplefilter("ignore", DeprecationWarning)
            process.start()
        sender.close()
        with receiver:
            yield receiver
    finally:
        if process.pid is not None:
            process.kill()
            process.join()


def _send_results(function: Callable[[Item], Result], items: Sequence[Item], sender: Connection) -> None:
    restore_default_signals()
    try:
        sender.send([function(item) for item in items])
    except Exception as error:
        sender.send(_picklable(error))


def _picklable(error: Exception) -> Exception:
    """The error, or its text where it cannot be sent between processes."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error
