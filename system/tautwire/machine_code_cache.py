"""Cache of machine code on disk, by the content that it was compiled from: what one run compiled, the next one loads.

It lies in the user's cache folder (``$XDG_CACHE_HOME`` or ``~/.cache``), in ``tautwire``; ``TAUTWIRE_CACHE`` names
another folder, or none where it is empty. A file that is damaged is replaced; where nothing can be written, nothing is
kept. Processes may share it: files appear by renaming, complete or not at all.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
import zlib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

CACHE_VARIABLE = "TAUTWIRE_CACHE"
# Bytes that the folder may hold; those files go first that have not been used for longest.
MAX_BYTES = 500_000_000
# One write in so many looks for what to remove, which takes as long as hundreds of files do.
WRITES_PER_CLEANING = 16
DIGEST_BYTES = 32


def cached_machine_code(content: bytes, compile_content: Callable[[], bytes], max_bytes: int = MAX_BYTES) -> bytes:
    """Machine code of some content, compiled only where the cache has none.

    ``content`` has to tell everything that the code depends on, the processor included.
    """
    folder = _folder()
    if folder is None:
        return compile_content()
    name = hashlib.sha256(content).hexdigest()
    code = _read(folder / name)
    if code is None:
        code = compile_content()
        with suppress(OSError):
            _write(folder / name, code)
            if int(name, 16) % WRITES_PER_CLEANING == 0:
                _remove_oldest(folder, max_bytes)
    return code


def _folder() -> Path | None:
    """The folder, which need not exist; None where there is to be none."""
    named = os.environ.get(CACHE_VARIABLE)
    if named is not None:
        return Path(named) / "machine-code" if named else None
    try:
        user_cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:
        return None
    return user_cache / "tautwire" / "machine-code"


def _read(file: Path) -> bytes | None:
    """Code that was kept, marked as used; None where there is none, or not all of it."""
    try:
        packed = file.read_bytes()
        code = zlib.decompress(packed[DIGEST_BYTES:])
    except (OSError, zlib.error):
        return None
    if hashlib.sha256(code).digest() != packed[:DIGEST_BYTES]:
        return None
    with suppress(OSError):
        os.utime(file)
    return code


def _write(file: Path, code: bytes) -> None:
    # What is kept here is executed: nobody else may write it.
    file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    number, scratch = tempfile.mkstemp(dir=file.parent)
    try:
        with open(number, "wb") as opened:
            opened.write(hashlib.sha256(code).digest() + zlib.compress(code, 1))
        os.replace(scratch, file)
    except BaseException:
        os.unlink(scratch)
        raise


def _remove_oldest(folder: Path, max_bytes: int) -> None:
    """Remove what has not been used for longest, until a tenth is free: scratch files of killed processes too."""
    entries = sorted(((entry.stat(), entry.path) for entry in os.scandir(folder)), key=lambda e: e[0].st_mtime)
    excess = sum(status.st_size for status, _ in entries) - max_bytes
    if excess <= 0:
        return
    for status, path in entries:
        if excess <= -0.1 * max_bytes:
            break
        # Another process may have removed it.
        with suppress(OSError):
            os.unlink(path)
        excess -= status.st_size
