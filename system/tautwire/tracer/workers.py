"""Processes of their own for what a trace can do side by side: fits, co-simulations."""

from __future__ import annotations

import os
import signal
import tempfile
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from types import TracebackType
from typing import Any, Generic, TypeVar

from threadpoolctl import threadpool_limits

from ..child import end_with_parent
from ..errors import TautwireError
from ..interrupt import ENDING

Result = TypeVar("Result")

# Seconds between two looks whether the user wants to stop.
PATIENCE = 0.1


class WorkerLostError(TautwireError):
    """A process that worked for a trace ended before its work did; carries how many there were."""

    def __init__(self, processes: int) -> None:
        self.processes = processes
        super().__init__(
            f"one of {processes} worker processes ended by itself: was it killed, or memory full? Run it again where "
            "more memory is free, or with fewer processors (taskset on Linux)"
        )


def processors() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class Pending(Generic[Result]):
    """A result that is being worked on; ``result`` waits for it."""

    def __init__(
        self, future: Future[Result] | None, now: Callable[[], Result], between: Callable[[], None], processes: int
    ) -> None:
        self._future, self._now, self._between, self._processes = future, now, between, processes

    def result(self) -> Result:
        """The result, or what the work raised. Without a process of its own it is done here."""
        if self._future is None:
            return self._now()
        while not wait([self._future], PATIENCE).done:
            self._between()
        with _loss_told(self._processes):
            return self._future.result()


class Workers:
    """Calls functions with picklable arguments, in so many processes; with one of them, here.

    ``between`` is called while they are waited for. Leaving the context ends the processes, whatever they do, and
    removes what they left in temporary folders. A program that asks for more than one process has to guard its main
    module by ``if __name__ == "__main__"``, as multiprocessing wants.
    """

    def __init__(self, processes: int, between: Callable[[], None] = lambda: None) -> None:
        self.processes = processes
        self.between = between
        self._folder = tempfile.TemporaryDirectory(prefix="tautwire-workers-") if processes > 1 else None
        self._executor: ProcessPoolExecutor | None = None

    def __enter__(self) -> Workers:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._executor is not None:
            # The executor has no public way to end work that has begun.
            running = list((getattr(self._executor, "_processes", None) or {}).values())
            self._executor.shutdown(wait=False, cancel_futures=True)
            for process in running:
                process.kill()
            for process in running:
                process.join()
        if self._folder is not None:
            self._folder.cleanup()

    def begin(self) -> None:
        """Begin the processes, which takes them a while; else the first call does."""
        if self._pool() is not None:
            for _ in range(self.processes):
                self._submit(_begun)

    def start(self, function: Callable[..., Result], *arguments: Any) -> Pending[Result]:
        """Begin a call; its result may be fetched once."""
        future = None if self._pool() is None else self._submit(function, *arguments)
        return Pending(future, lambda: function(*arguments), self.between, self.processes)

    def each(self, function: Callable[..., Result], calls: Sequence[tuple[Any, ...]]) -> Generator[tuple[int, Result]]:
        """Number and result of each call, in the order in which they end; closing it drops those not begun."""
        if self._pool() is None:
            for number, arguments in enumerate(calls):
                yield number, function(*arguments)
            return
        futures = {self._submit(function, *arguments): number for number, arguments in enumerate(calls)}
        waiting = set(futures)
        try:
            while waiting:
                self.between()
                done, waiting = wait(waiting, PATIENCE, FIRST_COMPLETED)
                for future in sorted(done, key=futures.__getitem__):
                    with _loss_told(self.processes):
                        result = future.result()
                    yield futures[future], result
        finally:
            for future in waiting:
                future.cancel()

    def _submit(self, function: Callable[..., Result], *arguments: Any) -> Future[Result]:
        with _interrupts_blocked(), _loss_told(self.processes):
            future: Future[Result] = self._pool().submit(function, *arguments)
            return future

    def _pool(self) -> Any:
        if self.processes > 1 and self._executor is None and self._folder is not None:
            # Not forked: threads of libraries would be missing. No fork server: its socket's path may be too long.
            self._executor = ProcessPoolExecutor(self.processes, get_context("spawn"), _begin, (self._folder.name,))
        return self._executor


@contextmanager
def _loss_told(processes: int) -> Iterator[None]:
    try:
        yield
    except BrokenProcessPool as error:
        raise WorkerLostError(processes) from error


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Processes that are started in the block do not get Ctrl-C and what is like it; here it is only late."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, set(ENDING))
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begun() -> None:
    """Something to do first."""


def _begin(folder: str) -> None:
    """To be ended is the parent's to handle; temporary folders are made where the parent removes them."""
    for number in ENDING:
        signal.signal(number, signal.SIG_IGN)
    end_with_parent(Path(folder))
    tempfile.tempdir = folder
    threadpool_limits(1)
