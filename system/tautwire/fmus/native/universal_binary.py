"""Universal binaries of macOS: libraries for several processors in one file, as FMI 2.0 has one folder for all.

Source: Apple's header mach-o/fat.h.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import NamedTuple

MAGIC = 0xCAFEBABE
# Slices begin at multiples of the largest page, by its power of two.
ALIGNMENT_POWER = 14


class Processor(NamedTuple):
    """Type and subtype of a processor by mach/machine.h."""

    kind: int
    subkind: int


X86_64 = Processor(0x01000007, 3)
ARM_64 = Processor(0x0100000C, 0)


def universal_binary(libraries: Mapping[Processor, bytes]) -> bytes:
    """One file of the libraries of some processors: a header in big-endian numbers, then each library, aligned."""
    alignment = 1 << ALIGNMENT_POWER
    header = struct.pack(">2I", MAGIC, len(libraries))
    body, offset = b"", alignment
    for processor, library in libraries.items():
        header += struct.pack(">5I", *processor, offset, len(library), ALIGNMENT_POWER)
        body += library + b"\0" * (-len(library) % alignment)
        offset = alignment + len(body)
    return header.ljust(alignment, b"\0") + body
