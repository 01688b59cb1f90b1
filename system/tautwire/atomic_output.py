"""Atomic output: files and folders are written beside their target and renamed into place.

Unfinished output lies in a hidden staging folder beside its target, with a file lock that ends with the process. So a
second run to the same target is refused; the staging folder of a killed run is recognised by its free lock, and removed
by the next run that writes there. Where files cannot be locked, runs do not see each other: the last one's files stay.
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
from typing import IO, Any, BinaryIO

from .errors import DiskFullError, InputError

if sys.platform != "win32":
    import fcntl

CAN_LOCK_FILES = sys.platform != "win32"
STAGING_PREFIX = ".tautwire-"
LOCK_NAME = "lock"
SCRATCH_NAME = "new"
# What other programs would open as something else than it is.
DATA_SUFFIXES = (
    *(".csv", ".tsv", ".json", ".parquet", ".feather", ".h5", ".hdf5", ".mat", ".mdf", ".mf4", ".mcap", ".db3"),
    *(".ods", ".pdf", ".png", ".svg", ".xls", ".xlsm", ".xlsx"),
)
DISK_FULL_ERRNOS = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
# s; a run that removes stale staging folders holds their locks meanwhile.
LOCK_TIMEOUT = 1.0
LOCK_POLL_INTERVAL = 0.05


@contextmanager
def atomic_folder(target: Path) -> Iterator[Path]:
    """Context manager for a scratch folder whose files move into ``target`` on success and are deleted otherwise.

    A new folder is created by one rename. In an existing one, files of the same names are replaced one by one, each
    atomically; other files are left alone.

    Raises InputError where ``target`` cannot be a folder to write in, or another run writes there; DiskFullError.
    """
    with _staging_folder(_nearest_existing_folder(target), target) as scratch:
        yield scratch
        _publish(scratch, target)


def refuse_overwriting_inputs(inputs: Iterable[Path], outputs: Iterable[Path]) -> None:
    """Raises InputError where an output would overwrite an input."""
    input_paths = {os.path.realpath(path) for path in inputs}
    for output in outputs:
        if os.path.realpath(output) in input_paths:
            raise InputError(str(output), "is an input, and the output would replace it", "choose another --out")


def refuse_other_formats(out: Path | None, *written: str, option: str = "--out") -> None:
    """Raises InputError where a result's name promises another format of data than those ``written``."""
    suffix = "" if out is None else out.suffix.lower()
    if suffix in DATA_SUFFIXES and suffix not in written:
        names = " or ".join(f"{out.stem if out else ''}{each}" for each in written)
        raise InputError(str(out), f"ends in {suffix}, which is not written here", f"give {option} {names}")


def refuse_same_output(out: Path | None, other: Path | None, option: str = "--report") -> None:
    """Raises InputError where a page or figure would overwrite the result that the same run writes."""
    if out is not None and other is not None and os.path.realpath(out) == os.path.realpath(other):
        raise InputError(option, f"{other} is what --out writes", f"choose another {option}")


@contextmanager
def atomic_file(target: Path) -> Iterator[Path]:
    """Context manager for a scratch file that becomes ``target`` on success and is deleted otherwise.

    Raises InputError where ``target`` cannot be written, or another run writes it; DiskFullError.
    """
    if target.is_dir():
        raise InputError(str(target), "is a folder", "give the name of a file with --out")
    if target.exists() and not target.is_file():
        raise InputError(str(target), "is not a regular file", "give the name of a file with --out")
    with _staging_folder(_nearest_existing_folder(target.parent), target) as scratch:
        yield scratch / target.name
        _publish(scratch, target.parent)


def acquire_lock(file: IO[Any]) -> bool:
    """Acquires an exclusive file lock, which ends with the process; False if the file was removed meanwhile.

    Raises BlockingIOError where another process holds it. Without effect where :data:`CAN_LOCK_FILES` is false.
    """
    if sys.platform != "win32":
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    return os.fstat(file.fileno()).st_nlink > 0


def _nearest_existing_folder(target: Path) -> Path:
    for ancestor in (target, *target.absolute().parents):
        if ancestor.is_dir():
            return ancestor
        if ancestor.exists():
            raise InputError(str(ancestor), "is a file", "give the name of a folder with --out")
        if ancestor.is_symlink():
            raise InputError(str(ancestor), "is a broken link", "remove it, or choose another --out")
    return Path(target.absolute().anchor)


def _publish(scratch: Path, target: Path) -> None:
    if not target.exists():
        target.parent.mkdir(parents=True, exist_ok=True)
        scratch.rename(target)
        return
    for file in sorted(scratch.iterdir()):
        if (target / file.name).is_dir():
            raise InputError(str(target / file.name), "is a folder, a file belongs there", "move it away")
    for file in sorted(scratch.iterdir()):
        file.replace(target / file.name)


@contextmanager
def _staging_folder(parent: Path, target: Path) -> Iterator[Path]:
    """Context manager for the staging folder of ``target``, locked by this process and removed when the block ends."""
    try:
        _remove_stale_staging(parent)
        staging, lock = _lock_staging(parent, target)
    except OSError as error:
        raise InputError(str(target), f"cannot write there: {error.strerror}", "choose another --out") from error
    with ExitStack() as stack:
        if lock is not None:
            stack.enter_context(lock)
        stack.callback(remove_staging, staging)
        shutil.rmtree(staging / SCRATCH_NAME, ignore_errors=True)
        (staging / SCRATCH_NAME).mkdir()
        try:
            yield staging / SCRATCH_NAME
        except OSError as error:
            error_number = _disk_full_errno(error)
            if error_number is None:
                raise
            raise DiskFullError(str(target), os.strerror(error_number), tempfile.gettempdir()) from error


def _disk_full_errno(error: OSError) -> int | None:
    """The errno of a full disk, else None; errors that shutil collects hold it in their texts only."""
    if isinstance(error, shutil.Error):
        return next(
            (error_number for error_number in DISK_FULL_ERRNOS if f"[Errno {error_number}]" in str(error)), None
        )
    return error.errno if error.errno in DISK_FULL_ERRNOS else None


def _lock_staging(parent: Path, target: Path) -> tuple[Path, BinaryIO | None]:
    """Creates and locks the staging folder of a target; the lock is None where files cannot be locked."""
    digest = hashlib.sha256(os.fsencode(os.path.realpath(target))).hexdigest()[:12]
    staging = parent / f"{STAGING_PREFIX}{digest}"
    deadline = time.monotonic() + LOCK_TIMEOUT
    while CAN_LOCK_FILES:
        staging.mkdir(exist_ok=True)
        # A process that finishes may remove the folder at any time.
        with suppress(FileNotFoundError), ExitStack() as stack:
            lock = stack.enter_context((staging / LOCK_NAME).open("ab"))
            try:
                if acquire_lock(lock):
                    stack.pop_all()
                    return staging, lock
            except BlockingIOError:
                if time.monotonic() > deadline:
                    hint = "wait until it is done, or choose another --out"
                    raise InputError(str(target), "another run is writing there", hint) from None
            except OSError:
                break
        time.sleep(LOCK_POLL_INTERVAL)
    return Path(tempfile.mkdtemp(prefix=STAGING_PREFIX, dir=parent)), None


def _remove_stale_staging(parent: Path) -> None:
    """Removes staging folders of killed runs."""
    for lock_file in parent.glob(f"{STAGING_PREFIX}*/{LOCK_NAME}") if CAN_LOCK_FILES else ():
        with suppress(OSError), lock_file.open("rb") as lock:
            if acquire_lock(lock):
                remove_staging(lock_file.parent)


def remove_staging(staging: Path) -> None:
    """Removes a staging folder that this process has locked; the lock file goes last, to exclude others until then."""
    shutil.rmtree(staging / SCRATCH_NAME, ignore_errors=True)
    with suppress(OSError):
        (staging / LOCK_NAME).unlink(missing_ok=True)
        staging.rmdir()
