"""What Dask has each worker process of a local cluster do first (a preload)."""

from __future__ import annotations

import signal
from typing import Any


def dask_setup(worker: Any) -> None:
    """Leave Ctrl-C, which a terminal sends to all processes, to the one that has the campaign: it ends the workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
