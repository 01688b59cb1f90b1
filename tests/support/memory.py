"""The memory of processes, as Linux tells it."""

import os
from multiprocessing import active_children
from pathlib import Path

STATUS = "/proc/{}/statm"
TOLD = Path(STATUS.format("self")).exists()


def resident_memory() -> tuple[float, float]:
    """What is in memory of this process now, and of those that it has started, in MB; shared pages count in both."""
    return _resident("self"), sum(_resident(child.pid) for child in active_children())


def _resident(process: object) -> float:
    return int(Path(STATUS.format(process)).read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
