"""pythonfmu's builder as it is installed, whatever FMUs this process has loaded.

An FMU carries a copy of pythonfmu without binaries and puts it first on the path of the process that loads it, and so
of those that this process spawns. FMUs that such a copy builds have no library.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

from ..errors import TautwireError

LIBRARY = "pythonfmu"
# What pythonfmu lays beside the modules inside every FMU.
MARK = "slavemodule.txt"


class FmuLibraryError(TautwireError):
    """The pythonfmu at hand has no library for FMUs of this machine; carries the folder in which it lies."""

    def __init__(self, place: Path) -> None:
        self.place = place
        super().__init__(
            f"pythonfmu in {place} has no binaries for this machine, so it cannot build FMUs: install it again "
            "(pip install --force-reinstall pythonfmu)"
        )


@contextmanager
def builder(scratch: Path, names: Collection[str]) -> Iterator[Any]:
    """The installed library's ``FmuBuilder``, while modules and packages of these names are imported from ``scratch``.

    Path and modules are afterwards as they were. Raises FmuLibraryError where the library cannot build FMUs.
    """
    path, modules = list(sys.path), dict(sys.modules)
    foreign = {*names} if _is_installed(modules.get(LIBRARY)) else {*names, LIBRARY}
    for name in modules:
        if name.partition(".")[0] in foreign:
            del sys.modules[name]
    sys.path[:] = [str(scratch), *(entry for entry in path if not (Path(entry) / MARK).is_file())]
    try:
        yield _checked(importlib.import_module(f"{LIBRARY}.builder"))
    finally:
        sys.path[:] = path
        for name in set(sys.modules) - set(modules):
            origin = getattr(sys.modules[name], "__file__", None)
            if origin is not None and Path(origin).is_relative_to(scratch):
                del sys.modules[name]
        sys.modules.update(modules)


def _is_installed(library: ModuleType | None) -> bool:
    place = Path((library and library.__file__) or ".").parent
    return place.is_dir() and not (place.parent / MARK).exists()


def _checked(module: ModuleType) -> Any:
    if not module.FmuBuilder.has_binary():
        raise FmuLibraryError(Path(module.__file__ or ".").parent)
    return module.FmuBuilder
