"""Holds Ctrl-C back while foreign code runs, and lets other requests to end be like it.

Inside an FMU it would end the process, inside CasADi it would become another error.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

# Ways to ask a process to end; some systems lack the last.
ENDING = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


def end_like_interrupts() -> None:
    """Let what else asks this process to end raise KeyboardInterrupt, as Ctrl-C does; not what it is to ignore."""
    for number in ENDING:
        if signal.getsignal(number) is signal.SIG_DFL:
            signal.signal(number, signal.default_int_handler)


def as_by_default() -> None:
    """Let this process be ended as any other; Ctrl-C is for the one that started it."""
    for number in ENDING:
        signal.signal(number, signal.SIG_IGN if number == signal.SIGINT else signal.SIG_DFL)


@contextmanager
def interrupts_held() -> Iterator[Callable[[], None]]:
    """Within the block Ctrl-C, and what is like it, is only noted.

    Call what the block gets, where nothing foreign is running, to have KeyboardInterrupt raised there. Only the main
    thread receives signals; elsewhere nothing is changed. What the process ignores stays ignored.
    """
    if threading.current_thread() is not threading.main_thread():
        yield lambda: None
        return
    noted = []

    def note(number: int, frame: FrameType | None) -> None:
        noted.append(number)

    def raise_noted() -> None:
        if noted:
            raise KeyboardInterrupt

    before = {number: signal.getsignal(number) for number in ENDING}
    heard = [n for n in ENDING if before[n] is not signal.SIG_IGN]
    held = [n for n in heard if n == signal.SIGINT or before[n] is signal.default_int_handler]
    for number in held:
        signal.signal(number, note)
    try:
        yield raise_noted
    finally:
        for number in held:
            signal.signal(number, before[number])
