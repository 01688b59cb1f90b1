"""Dask preload of the worker processes of a local cluster: leaves Ctrl-C to the main process."""

from __future__ import annotations

import signal
from typing import Any


def dask_setup(worker: Any) -> None:
    """Ignore Ctrl-C, which a terminal sends to all processes: the main process handles it and ends the workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
