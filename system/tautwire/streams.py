"""Standard streams that may be closed, or full, or read by nobody."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from typing import TextIO


def open_missing() -> None:
    """Open closed standard streams on nothing, so that no file of ours takes their place and gets their text."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            # The lowest free number is the one that is missing.
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, "w" if number else "r", encoding="utf-8", closefd=False))  # noqa: SIM115


def say(text: str) -> None:
    """Print a line to standard error, if anybody can get it."""
    try:
        print(text, file=sys.stderr, flush=True)
    except OSError:
        flush_or_drop(sys.stderr)


def flush_or_drop(stream: TextIO) -> None:
    """Write what a stream still holds; where that fails let it go nowhere, Python would try again at the end."""
    with suppress(OSError):
        try:
            stream.flush()
            return
        except OSError:
            pass
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)
