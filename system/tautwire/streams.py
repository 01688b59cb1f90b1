"""Standard streams that may be closed, full, or without a reader."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from typing import TextIO


def open_closed_streams() -> None:
    """Opens closed standard streams on the null device, so that no other file takes their descriptors."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            # The system assigns the lowest free descriptor, which is the missing one.
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, "w" if number else "r", encoding="utf-8", closefd=False))  # noqa: SIM115


def print_error(text: str) -> None:
    """Prints a line to standard error, if it can be written."""
    try:
        print(text, file=sys.stderr, flush=True)
    except OSError:
        flush_or_discard(sys.stderr)


def flush_or_discard(stream: TextIO) -> None:
    """Flushes a stream; where that fails redirects it to the null device, since Python would flush again at exit."""
    with suppress(OSError):
        try:
            stream.flush()
            return
        except OSError:
            pass
        null_device = os.open(os.devnull, os.O_WRONLY)
        os.dup2(null_device, stream.fileno())
        os.close(null_device)
