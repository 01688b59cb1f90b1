"""Universal binaries, read back number by number."""

from __future__ import annotations

import struct

from tautwire.fmus.native.universal_binary import ARM_64, X86_64, universal_binary


def test_each_processor_finds_its_library_where_the_header_says() -> None:
    libraries = {X86_64: b"intel" * 5000, ARM_64: b"arm" * 7}
    binary = universal_binary(libraries)
    magic, count = struct.unpack_from(">2I", binary)
    assert (magic, count) == (0xCAFEBABE, 2)
    for index, (processor, library) in enumerate(libraries.items()):
        kind, subkind, offset, size, power = struct.unpack_from(">5I", binary, 8 + 20 * index)
        assert (kind, subkind) == processor
        assert offset % (1 << power) == 0
        assert binary[offset : offset + size] == library
