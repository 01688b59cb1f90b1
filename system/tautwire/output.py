"""Writes results so that nothing is ever left half written: beside first, then renamed into place."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import InputError


@contextmanager
def folder_in_place(target: Path) -> Iterator[Path]:
    """A scratch folder whose files move into ``target`` when the block ends well, and vanish otherwise.

    Files of the same names in ``target`` are replaced; others there are left alone.

    Raises InputError where ``target`` cannot be a folder to write in.
    """
    parent = _existing_parent(target)
    try:
        scratch = Path(tempfile.mkdtemp(prefix=".tautwire-", dir=parent))
    except OSError as error:
        raise InputError(str(target), f"cannot write there: {error.strerror}", "choose another --out") from error
    try:
        yield scratch
        target.mkdir(parents=True, exist_ok=True)
        for finished in sorted(scratch.iterdir()):
            if (target / finished.name).is_dir():
                raise InputError(str(target / finished.name), "is a folder, a file belongs there", "move it away")
        for finished in sorted(scratch.iterdir()):
            finished.replace(target / finished.name)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def refuse_inputs(inputs: Iterable[Path], outputs: Iterable[Path]) -> None:
    """Raises InputError where an output would take the place of an input."""
    taken = {path.resolve() for path in inputs}
    for output in outputs:
        if output.resolve() in taken:
            raise InputError(str(output), "is an input, the output would take its place", "choose another --out")


@contextmanager
def file_in_place(target: Path) -> Iterator[Path]:
    """A scratch file that becomes ``target`` when the block ends well, and vanishes otherwise.

    Raises InputError where ``target`` cannot be written.
    """
    if target.is_dir():
        raise InputError(str(target), "is a folder", "give the name of a file with --out")
    with folder_in_place(target.parent) as scratch:
        yield scratch / target.name


def _existing_parent(target: Path) -> Path:
    for place in (target, *target.absolute().parents):
        if place.is_dir():
            return place
        if place.exists():
            raise InputError(str(place), "is a file", "give the name of a folder with --out")
    return Path(target.absolute().anchor)
