"""Mends pythonfmu's wrapper library inside a built FMU.

The wrapper of pythonfmu 0.7.0 ends with ``finalizePythonInterpreter``, which gives up a reference that the library's
own destructors have given up and freed before it. The process then writes into freed memory as it exits, and with
some eight FMUs or more it now and then ends in an abort ("corrupted double-linked list"). All that the function does
has been done by then, so it returns at once instead.
"""

from __future__ import annotations

import io
import zipfile
from copy import copy
from pathlib import Path

from elftools.elf.elffile import ELFFile
from elftools.elf.sections import SymbolTableSection

LIBRARIES = "binaries/linux64/"
FUNCTION = "finalizePythonInterpreter"
MACHINE = "EM_X86_64"
RETURN = b"\xc3"


def mend_exit(fmu: Path, target: Path) -> None:
    """Write ``fmu`` to ``target`` with its wrapper's last function emptied; all else stays byte for byte."""
    with zipfile.ZipFile(fmu) as packed, zipfile.ZipFile(target, "w") as mended:
        for entry in packed.infolist():
            content = packed.read(entry)
            if entry.filename.startswith(LIBRARIES):
                content = returning_at_once(content)
            mended.writestr(copy(entry), content)


def returning_at_once(library: bytes) -> bytes:
    """An x86-64 ELF library whose ``finalizePythonInterpreter`` returns at once; any other file as it is."""
    place = _place(library)
    if place is None:
        return library
    return library[:place] + RETURN + library[place + len(RETURN) :]


def _place(library: bytes) -> int | None:
    """Where in the file the function begins; None where there is none that is known here."""
    if not library.startswith(b"\x7fELF"):
        return None
    elf = ELFFile(io.BytesIO(library))
    symbols = elf.get_section_by_name(".dynsym")
    if not isinstance(symbols, SymbolTableSection) or elf["e_machine"] != MACHINE:
        return None
    found = symbols.get_symbol_by_name(FUNCTION)
    if not found:
        return None
    address = int(found[0]["st_value"])
    return next((int(offset) for offset in elf.address_offsets(address)), None)
