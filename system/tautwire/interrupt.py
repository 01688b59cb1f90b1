"""Holds Ctrl-C back while foreign code runs.

Inside an FMU it would end the process, inside CasADi it would become another error.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def interrupts_held() -> Iterator[Callable[[], None]]:
    """Within the block Ctrl-C is only noted.

    Call what the block gets, where nothing foreign is running, to have KeyboardInterrupt raised there. Only the main
    thread receives signals; elsewhere nothing is changed.
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

    before = signal.signal(signal.SIGINT, note)
    try:
        yield raise_noted
    finally:
        signal.signal(signal.SIGINT, before)
