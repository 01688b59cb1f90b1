"""Process signals: interrupts deferred while foreign code runs, and workers that exit with their parent process.

Inside an FMU an interrupt would end the process, inside CasADi it would become another error.
"""

from __future__ import annotations

import os
import shutil
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing import parent_process
from multiprocessing.connection import wait
from pathlib import Path
from types import FrameType

# Windows lacks SIGHUP.
TERMINATION_SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


def raise_interrupt_on_termination() -> None:
    """Makes termination signals raise KeyboardInterrupt, as Ctrl-C does; ignored signals stay ignored."""
    for number in TERMINATION_SIGNALS:
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, signal.default_int_handler)


def restore_default_signals() -> None:
    """Restores default signal handling in a worker process; Ctrl-C is ignored, it is meant for the parent."""
    for number in TERMINATION_SIGNALS:
        signal.signal(number, signal.SIG_IGN if number == signal.SIGINT else signal.SIG_DFL)


@contextmanager
def defer_interrupts() -> Iterator[Callable[[], None]]:
    """Context manager that defers Ctrl-C and termination signals: within the block they are only recorded.

    It yields a function that raises KeyboardInterrupt if one was received; call it where no foreign code runs. Only
    the main thread receives signals; elsewhere nothing changes. Ignored signals stay ignored.
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


def exit_with_parent(temporary_folder: Path) -> None:
    """Exits this process as soon as its parent is gone, and removes the folder of its temporary files."""
    threading.Thread(target=_exit_after_parent, args=(temporary_folder,), daemon=True).start()


def _exit_after_parent(temporary_folder: Path) -> None:
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        shutil.rmtree(temporary_folder, ignore_errors=True)
        os._exit(1)
