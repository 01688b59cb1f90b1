"""Process signals: interrupts deferred while foreign code runs, and workers that exit with their parent process.

Inside an FMU an interrupt would end the process, inside CasADi it would become another error. Python calls handlers
between its own instructions only: foreign code that does not return is ended with the process.
"""

from __future__ import annotations

import multiprocessing.util
import os
import shutil
import signal
import socket
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing import active_children, parent_process
from multiprocessing.connection import wait
from pathlib import Path
from types import FrameType

# Windows lacks SIGHUP.
TERMINATION_SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))

# Seconds that an interrupt waits for foreign code to return, and for worker processes to be gone once they are killed.
INTERRUPT_PATIENCE = 0.3
KILL_PATIENCE = 0.2


def raise_interrupt_on_termination() -> None:
    """Makes termination signals raise KeyboardInterrupt, as Ctrl-C does; ignored signals stay ignored."""
    for number in TERMINATION_SIGNALS:
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, signal.default_int_handler)


def restore_default_signals() -> None:
    """Restores default signal handling in a worker process; Ctrl-C is ignored, it is meant for the parent."""
    for number in TERMINATION_SIGNALS:
        signal.signal(number, signal.SIG_IGN if number == signal.SIGINT else signal.SIG_DFL)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, TERMINATION_SIGNALS)


@contextmanager
def defer_interrupts() -> Iterator[Callable[[], None]]:
    """Context manager that defers Ctrl-C and termination signals: within the block they are only recorded.

    It yields a function that raises KeyboardInterrupt if one was received; call it where no foreign code runs. The
    end of the block calls it too, so none is lost. Only the main thread receives signals; elsewhere nothing changes.
    Ignored signals stay ignored.
    """
    if threading.current_thread() is not threading.main_thread():
        yield lambda: None
        return
    received = []

    def record_signal(number: int, frame: FrameType | None) -> None:
        received.append(number)

    def raise_pending() -> None:
        if received:
            raise KeyboardInterrupt

    previous_handlers = {number: signal.getsignal(number) for number in TERMINATION_SIGNALS}
    not_ignored = [n for n in TERMINATION_SIGNALS if previous_handlers[n] is not signal.SIG_IGN]
    deferred = [n for n in not_ignored if n == signal.SIGINT or previous_handlers[n] is signal.default_int_handler]
    for number in deferred:
        signal.signal(number, record_signal)
    try:
        yield raise_pending
    finally:
        for number in deferred:
            signal.signal(number, previous_handlers[number])
        raise_pending()


@contextmanager
def exit_on_overdue_interrupt(clean_up: Callable[[], None]) -> Iterator[None]:
    """Context manager that ends this process where it is still in the block some time after a termination signal.

    It kills the worker processes, calls ``clean_up``, and exits with status 1; so it is for commands, not for programs
    of others. Only from the main thread; elsewhere nothing changes.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    receiver, sender = socket.socketpair()
    sender.setblocking(False)
    is_over = threading.Event()
    with receiver, sender:
        # Written by the signal handler itself, whatever the main thread does.
        previous = signal.set_wakeup_fd(sender.fileno(), warn_on_full_buffer=False)
        watcher = threading.Thread(target=_exit_on_overdue_interrupt, args=(receiver, is_over, clean_up), daemon=True)
        watcher.start()
        try:
            yield
        finally:
            signal.set_wakeup_fd(previous)
            is_over.set()
            sender.close()
            watcher.join()


def _exit_on_overdue_interrupt(receiver: socket.socket, is_over: threading.Event, clean_up: Callable[[], None]) -> None:
    while received := receiver.recv(64):
        if set(received) & set(TERMINATION_SIGNALS) and not is_over.wait(INTERRUPT_PATIENCE):
            for child in active_children():
                child.kill()
                child.join(KILL_PATIENCE)
            # Semaphores, which otherwise another process removes, with a warning. There is no public way.
            multiprocessing.util._run_finalizers(0)  # type: ignore[attr-defined]
            clean_up()
            os._exit(1)


@contextmanager
def own_temporary_folder() -> Iterator[Path]:
    """Context manager for a folder that holds all temporary files of the block, and is removed after it."""
    previous = tempfile.tempdir
    with tempfile.TemporaryDirectory(prefix="tautwire-", ignore_cleanup_errors=True) as folder:
        tempfile.tempdir = folder
        try:
            yield Path(folder)
        finally:
            tempfile.tempdir = previous


def exit_with_parent(temporary_folder: Path) -> None:
    """Exits this process as soon as its parent is gone, and removes the folder of its temporary files."""
    threading.Thread(target=_exit_after_parent, args=(temporary_folder,), daemon=True).start()


def _exit_after_parent(temporary_folder: Path) -> None:
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        shutil.rmtree(temporary_folder, ignore_errors=True)
        os._exit(1)
