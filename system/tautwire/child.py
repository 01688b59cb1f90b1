"""What processes do that others started for a part of the work."""

from __future__ import annotations

import os
import shutil
import threading
from multiprocessing import parent_process
from multiprocessing.connection import wait
from pathlib import Path


def end_with_parent(folder: Path) -> None:
    """End this process as soon as the one that started it is gone, and remove the folder of its temporary files."""
    threading.Thread(target=_end_with_parent, args=(folder,), daemon=True).start()


def _end_with_parent(folder: Path) -> None:
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        shutil.rmtree(folder, ignore_errors=True)
        os._exit(1)
