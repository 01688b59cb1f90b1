"""Patches pythonfmu's wrapper library inside a built FMU.

The wrapper of pythonfmu 0.7.0 ends with ``finalizePythonInterpreter``, which gives up a reference that the library's
own destructors have given up and freed before it. The process then writes into freed memory as it exits, and with
some eight FMUs or more it now and then ends in an abort ("corrupted double-linked list"). All that the function does
has been done by then, so it is patched to return at once.
"""

from __future__ import annotations

import io
import zipfile
from copy import copy
from pathlib import Path

from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection

WRAPPER_FOLDER = "binaries/linux64/"
FINALIZE_FUNCTION = "finalizePythonInterpreter"
ELF_MACHINE = "EM_X86_64"
RETURN_INSTRUCTION = b"\xc3"


def patch_wrapper_exit(fmu: Path, target: Path) -> None:
    """Write ``fmu`` to ``target`` with its wrapper's finalizer patched out; all else stays byte for byte."""
    with zipfile.ZipFile(fmu) as source_archive, zipfile.ZipFile(target, "w") as target_archive:
        for entry in source_archive.infolist():
            content = source_archive.read(entry)
            if entry.filename.startswith(WRAPPER_FOLDER):
                content = with_immediate_return(content)
            target_archive.writestr(copy(entry), content)


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
