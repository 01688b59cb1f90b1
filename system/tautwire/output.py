"""Writes results so that nothing is ever left half written: beside first, then renamed into place.

What is being written lies in a hidden folder beside its target, with a lock that ends with the process. So a second
run to the same target is refused; and what a killed run has left is known by its free lock, and removed by the next run
that writes there. Where files cannot be locked, runs do not see each other: the last one's files stay.
"""

from __future__ import annotations

import errno
import hashlib
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

from .errors import DiskFullError, InputError

if sys.platform != "win32":
    import fcntl

HOLDER = ".tautwire-"
LOCK = "lock"
SCRATCH = "new"
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
# s: a run that clears up what others left holds a lock for as long as that takes.
PATIENCE = 1.0
POLL = 0.05


@contextmanager
def folder_in_place(target: Path) -> Iterator[Path]:
    """A scratch folder whose files move into ``target`` when the block ends well, and vanish otherwise.

    A new folder comes as a whole. In one that is there already, files of the same names are replaced one by one, each
    as a whole; others are left alone.

    Raises InputError where ``target`` cannot be a folder to write in, or another run writes there; DiskFullError.
    """
    with _scratch_beside(_existing_parent(target), target) as scratch:
        yield scratch
        _move(scratch, target)


def refuse_inputs(inputs: Iterable[Path], outputs: Iterable[Path]) -> None:
    """Raises InputError where an output would take the place of an input."""
    taken = {os.path.realpath(path) for path in inputs}
    for output in outputs:
        if os.path.realpath(output) in taken:
            raise InputError(str(output), "is an input, the output would take its place", "choose another --out")


def refuse_same(out: Path | None, other: Path | None, option: str = "--report") -> None:
    """Raises InputError where a page or figure would take the place of the result beside which it is written."""
    if out is not None and other is not None and os.path.realpath(out) == os.path.realpath(other):
        raise InputError(option, f"{other} is what --out writes", f"choose another {option}")


@contextmanager
def file_in_place(target: Path) -> Iterator[Path]:
    """A scratch file that becomes ``target`` when the block ends well, and vanishes otherwise.

    Raises InputError where ``target`` cannot be written, or another run writes it; DiskFullError.
    """
    if target.is_dir():
        raise InputError(str(target), "is a folder", "give the name of a file with --out")
    if target.exists() and not target.is_file():
        raise InputError(str(target), "is no regular file", "give the name of a file with --out")
    with _scratch_beside(_existing_parent(target.parent), target) as scratch:
        yield scratch / target.name
        _move(scratch, target.parent)


def _existing_parent(target: Path) -> Path:
    for place in (target, *target.absolute().parents):
        if place.is_dir():
            return place
        if place.exists():
            raise InputError(str(place), "is a file", "give the name of a folder with --out")
        if place.is_symlink():
            raise InputError(str(place), "is a link that leads nowhere", "remove it, or choose another --out")
    return Path(target.absolute().anchor)


def _move(scratch: Path, target: Path) -> None:
    if not target.exists():
        target.parent.mkdir(parents=True, exist_ok=True)
        scratch.rename(target)
        return
    for finished in sorted(scratch.iterdir()):
        if (target / finished.name).is_dir():
            raise InputError(str(target / finished.name), "is a folder, a file belongs there", "move it away")
    for finished in sorted(scratch.iterdir()):
        finished.replace(target / finished.name)


@contextmanager
def _scratch_beside(parent: Path, target: Path) -> Iterator[Path]:
    """A folder for what becomes ``target``, held by this process alone; nothing of it is left when the block ends."""
    try:
        _clear_leftovers(parent)
        holder, lock = _held(parent, target)
    except OSError as error:
        raise InputError(str(target), f"cannot write there: {error.strerror}", "choose another --out") from error
    with ExitStack() as stack:
        if lock is not None:
            stack.enter_context(lock)
        stack.callback(_remove, holder)
        shutil.rmtree(holder / SCRATCH, ignore_errors=True)
        (holder / SCRATCH).mkdir()
        try:
            yield holder / SCRATCH
        except OSError as error:
            number = _full(error)
            if number is None:
                raise
            raise DiskFullError(str(target), os.strerror(number), tempfile.gettempdir()) from error


def _full(error: OSError) -> int | None:
    """Which of ``FULL`` an error is, if it is one; of those that shutil gathers only the texts are left."""
    if isinstance(error, shutil.Error):
        return next((number for number in FULL if f"[Errno {number}]" in str(error)), None)
    return error.errno if error.errno in FULL else None


def _held(parent: Path, target: Path) -> tuple[Path, BinaryIO | None]:
    """The hidden folder of a target and the lock that this process has on it, None where nothing can be locked."""
    digest = hashlib.sha256(os.fsencode(os.path.realpath(target))).hexdigest()[:12]
    holder = parent / f"{HOLDER}{digest}"
    deadline = time.monotonic() + PATIENCE
    while sys.platform != "win32":
        holder.mkdir(exist_ok=True)
        # Whoever leaves may remove the folder at any time.
        with suppress(FileNotFoundError), ExitStack() as stack:
            lock = stack.enter_context((holder / LOCK).open("ab"))
            try:
                if _locked(lock):
                    stack.pop_all()
                    return holder, lock
            except BlockingIOError:
                if time.monotonic() > deadline:
                    mend = "wait until it is done, or choose another --out"
                    raise InputError(str(target), "another run is writing there", mend) from None
            except OSError:
                break
        time.sleep(POLL)
    return Path(tempfile.mkdtemp(prefix=HOLDER, dir=parent)), None


def _locked(lock: BinaryIO) -> bool:
    """Whether a lock is this process's now, and still there; raises BlockingIOError where it is another's."""
    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    return os.fstat(lock.fileno()).st_nlink > 0


def _clear_leftovers(parent: Path) -> None:
    """Remove what runs that were killed have left in a folder."""
    for left in parent.glob(f"{HOLDER}*/{LOCK}") if sys.platform != "win32" else ():
        with suppress(OSError), left.open("rb") as lock:
            if _locked(lock):
                _remove(left.parent)


def _remove(holder: Path) -> None:
    """Remove a hidden folder whose lock this process has; the lock goes last, so that nobody comes in between."""
    shutil.rmtree(holder / SCRATCH, ignore_errors=True)
    with suppress(OSError):
        (holder / LOCK).unlink(missing_ok=True)
        holder.rmdir()
