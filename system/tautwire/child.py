"""Worker processes that exit with the process that started them."""

from __future__ import annotations

import os
import shutil
import threading
from multiprocessing import parent_process
from multiprocessing.connection import wait
from pathlib import Path


def exit_with_parent(temporary_folder: Path) -> None:
    """Exits this process as soon as its parent is gone, and removes the folder of its temporary files."""
    threading.Thread(target=_exit_after_parent, args=(temporary_folder,), daemon=True).start()


def _exit_after_parent(temporary_folder: Path) -> None:
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        shutil.rmtree(temporary_folder, ignore_errors=True)
        os._exit(1)
