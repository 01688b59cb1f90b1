"""pythonfmu's FmuBuilder as it is installed, whatever FMUs this process has loaded.

An FMU contains a copy of pythonfmu without binaries and puts it first on the path of the process that loads it, and so
of those that this process spawns. FMUs built by such a copy have no library.
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

PYTHONFMU = "pythonfmu"
# File that pythonfmu puts beside the modules inside every FMU.
FMU_RESOURCE_MARKER = "slavemodule.txt"


class FmuLibraryError(TautwireError):
    """The installed pythonfmu has no wrapper library for this machine; carries its folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        super().__init__(
            f"pythonfmu in {folder} has no binaries for this machine, so it cannot build FMUs: install it again "
            "(pip install --force-reinstall pythonfmu)"
        )


@contextmanager
def installed_builder(scratch: Path, names: Collection[str]) -> Iterator[Any]:
    """Context with the installed library's ``FmuBuilder``.

    Modules and packages of these names are imported from ``scratch`` within it. Path and modules are restored
    afterwards. Raises FmuLibraryError where the library cannot build FMUs.
    """
    path, modules = list(sys.path), dict(sys.modules)
    reimported_packages = {*names} if _is_installed(modules.get(PYTHONFMU)) else {*names, PYTHONFMU}
    for name in modules:
        if name.partition(".")[0] in reimported_packages:
            del sys.modules[name]
    sys.path[:] = [str(scratch), *(entry for entry in path if not (Path(entry) / FMU_RESOURCE_MARKER).is_file())]
    try:
        yield _checked_builder(importlib.import_module(f"{PYTHONFMU}.builder"))
    finally:
        sys.path[:] = path
        for name in set(sys.modules) - set(modules):
            origin = getattr(sys.modules[name], "__file__", None)
            if origin is not None and Path(origin).is_relative_to(scratch):
                del sys.modules[name]
        sys.modules.update(modules)


def _is_installed(library: ModuleType | None) -> bool:
    folder = Path((library and library.__file__) or ".").parent
    return folder.is_dir() and not (folder.parent / FMU_RESOURCE_MARKER).exists()


def _checked_builder(module: ModuleType) -> Any:
    if not module.FmuBuilder.has_binary():
        raise FmuLibraryError(Path(module.__file__ or ".").parent)
    return module.FmuBuilder
