"""pythonfmu's FmuBuilder as it is installed, and a patch of its wrapper library.

An FMU contains a copy of pythonfmu without binaries and puts it first on the path of the process that loads it, and so
of those that this process spawns. FMUs built by such a copy have no library.

The wrapper of pythonfmu 0.7.0 ends with ``finalizePythonInterpreter``, which gives up a reference that the library's
own destructors have given up and freed before it. The process then writes into freed memory as it exits, and with
some eight FMUs or more it now and then ends in an abort ("corrupted double-linked list"). All that the function does
has been done by then, so it is patched to return at once.
"""

from __future__ import annotations

import importlib
import io
import sys
import zipfile
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from copy import copy
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection

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
    importlib.invalidate_caches()
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


WRAPPER_FOLDER = "binaries/linux64/"
FINALIZE_FUNCTION = "finalizePythonInterpreter"
ELF_MACHINE = "EM_X86_64"
RETURN_INSTRUCTION = b"\xc3"


def patch_wrapper_exit(fmu: Path, target: Path, additions: Mapping[str, bytes] | None = None) -> None:
    """Write ``fmu`` to ``target`` with its wrapper's finalizer patched out; all else stays byte for byte.

    ``additions`` are the contents of further files by their paths in the archive.
    """
    with zipfile.ZipFile(fmu) as source_archive, zipfile.ZipFile(target, "w") as target_archive:
        for entry in source_archive.infolist():
            content = source_archive.read(entry)
            if entry.filename.startswith(WRAPPER_FOLDER):
                content = with_immediate_return(content)
            target_archive.writestr(copy(entry), content)
        for name, content in (additions or {}).items():
            target_archive.writestr(name, content, zipfile.ZIP_DEFLATED)


@lru_cache(maxsize=4)
def with_immediate_return(library: bytes) -> bytes:
    """An x86-64 ELF library whose ``finalizePythonInterpreter`` returns at once; any other file as it is."""
    offset = _function_offset(library)
    if offset is None:
        return library
    return library[:offset] + RETURN_INSTRUCTION + library[offset + len(RETURN_INSTRUCTION) :]


def _function_offset(library: bytes) -> int | None:
    """File offset of the finalizer; None where there is no such function."""
    if not library.startswith(b"\x7fELF"):
        return None
    elf = ELFFile(io.BytesIO(library))
    symbols = elf.get_section_by_name(".dynsym")
    if not isinstance(symbols, SymbolTableSection) or elf["e_machine"] != ELF_MACHINE:
        return None
    matching_symbols = symbols.get_symbol_by_name(FINALIZE_FUNCTION)
    if not matching_symbols:
        return None
    address = int(matching_symbols[0]["st_value"])
    return next((int(offset) for offset in elf.address_offsets(address)), None)
