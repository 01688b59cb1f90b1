"""FMUs by pythonfmu: its FmuBuilder as it is installed, and a patch of its wrapper library.

An FMU contains a copy of pythonfmu without binaries and puts it first on the path of the process that loads it, and so
of those that this process spawns. FMUs built by such a copy have no library.

The wrapper of pythonfmu 0.7.0 ends with ``finalizePythonInterpreter``, which gives up a reference that the library's
own destructors have given up and freed before it. The process then writes into freed memory as it exits, and with
some eight FMUs or more it now and then ends in an abort ("corrupted double-linked list"). All that the function does
has been done by then, so it is patched to return at once.
"""

from __future__ import annotations

import hashlib
import importlib
import io
import json
import shutil
import sys
import tempfile
import zipfile
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from copy import copy
from functools import lru_cache, partial
from pathlib import Path
from types import ModuleType
from typing import Any
from uuid import NAMESPACE_URL, uuid5

from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection

import tautwire_fmu

from .. import __version__
from ..errors import TautwireError
from ..process_signals import defer_interrupts
from .fmu_archive import put_atomically, read_model_description
from .fmu_documentation import documentation_files

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
    # Scripts may be younger than the listings of their folder.
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


# pythonfmu 0.7.0 runs the script at every instantiation and then releases a reference to its globals that it does
# not own; without the one taken here the second instance gets an empty module.
LAUNCHER = """import ctypes

from {package}.slaves import {base}

ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))
"""
FMU_OPTIONS = {
    "needsExecutionTool": False,
    "canGetAndSetFMUstate": True,
    "canSerializeFMUstate": True,
    "canInterpolateInputs": False,
}

# Writes the FMU of a component into a folder: module and class of its slave, its name, its resource.
FmuWriter = Callable[[str, str, str, dict[str, Any], Path], Path]


@contextmanager
def pythonfmu_writer() -> Iterator[FmuWriter]:
    """Context with a function that writes FMUs by pythonfmu, and imports what travels inside once for all of them."""
    sources = Path(tautwire_fmu.__file__).parent
    package = f"tautwire_fmu_{_digest(sources)}"
    with ExitStack() as stack:
        # An interrupt within one of the many imports may be raised in a callback, where it is lost.
        with defer_interrupts():
            scratch = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="tautwire-build-")))
            shutil.copytree(sources, scratch / package, ignore=shutil.ignore_patterns("__pycache__", "*.pyc"))
            stack.enter_context(installed_builder(scratch, (package,)))
            importlib.import_module(f"{package}.slaves")
        yield partial(_write_python_fmu, scratch / package)


def _write_python_fmu(package: Path, module: str, base: str, name: str, data: dict[str, Any], folder: Path) -> Path:
    scratch, data = package.parent, data | {"model_name": name, "version": __version__}
    guid = str(uuid5(NAMESPACE_URL, package.name + module + json.dumps(data, sort_keys=True)))
    with defer_interrupts() as raise_interrupt:
        resource = scratch / f"{module}.json"
        resource.write_text(json.dumps(data | {"guid": guid}), encoding="utf-8")
        script = scratch / f"{name}_{guid.replace('-', '')[:12]}.py"
        script.write_text(LAUNCHER.format(package=package.name, base=base), encoding="utf-8")
        unpatched_fmu = scratch / "built" / f"{name}.fmu"
        with installed_builder(scratch, (script.stem,)) as fmu_builder:
            fmu_builder.build_FMU(script, dest=unpatched_fmu, project_files=[package, resource], **FMU_OPTIONS)
        patched_fmu = scratch / f"{name}.fmu"
        additions = documentation_files(module, data, read_model_description(unpatched_fmu))
        patch_wrapper_exit(unpatched_fmu, patched_fmu, additions)
        raise_interrupt()
        return put_atomically(shutil.move, patched_fmu, folder / f"{name}.fmu")


def _digest(sources: Path) -> str:
    digest = hashlib.sha256()
    for path in sorted(sources.rglob("*.py")):
        digest.update(path.relative_to(sources).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


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
