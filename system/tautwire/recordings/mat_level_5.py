"""Headers of the arrays in a MATLAB file of level 5, which state all sizes, before any array is read."""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import BinaryIO, Protocol

from .mat_array import MAX_ARRAYS, MAX_BYTES, MAX_DEPTH, MatArray, MatFormatError

HEADER_SIZE = 128  # bytes
_MATRIX, _COMPRESSED = 14, 15
_CELL, _STRUCT, _OBJECT, _CHAR, _SPARSE, _FUNCTION, _OPAQUE = 1, 2, 3, 4, 5, 16, 17
_NUMBERS = range(6, 16)
_NUMBER_TYPES = (1, 2, 3, 4, 5, 6, 7, 9, 12, 13)
_TEXT_TYPES = (*_NUMBER_TYPES, 16, 17, 18)
_PIECE = 2**16  # bytes


class _Stream(Protocol):
    def read(self, count: int, /) -> bytes: ...


class _Inflated:
    """A compressed element as a stream, of which a piece is in memory at a time."""

    def __init__(self, file: BinaryIO, size: int) -> None:
        self._file, self._remaining = file, size
        self._inflate, self._compressed = zlib.decompressobj(), b""

    def read(self, count: int, /) -> bytes:
        pieces = []
        while count > 0 and not self._inflate.eof:
            if not self._compressed:
                self._compressed = self._file.read(min(_PIECE, self._remaining))
                self._remaining = self._remaining - len(self._compressed) if self._compressed else 0
            piece = self._inflate.decompress(self._compressed, count)
            self._compressed = self._inflate.unconsumed_tail
            if not piece and not self._compressed and not self._remaining:
                break
            pieces.append(piece)
            count -= len(piece)
        return b"".join(pieces)


@dataclass
class _Reader:
    """A sequential reader of elements, which counts what it reads."""

    stream: _Stream
    order: str
    byte_count: int = 0
    array_count: int = 0
    arrays: list[MatArray] = field(default_factory=list)

    def exactly(self, count: int) -> bytes:
        self._count(count)
        content = self.stream.read(count)
        if len(content) != count:
            raise MatFormatError("it ends within an array")
        return content

    def skip(self, count: int) -> None:
        while count > 0:
            count -= len(self.exactly(min(count, _PIECE)))

    def _count(self, count: int) -> None:
        self.byte_count += count
        if self.byte_count > MAX_BYTES:
            raise MatFormatError(f"it holds more than {MAX_BYTES} bytes")

    def integers(self, content: bytes, code: str = "I") -> tuple[int, ...]:
        return struct.unpack(f"{self.order}{len(content) // 4}{code}", content[: len(content) // 4 * 4])

    def tag(self) -> tuple[int, int, bytes | None]:
        """Type and size of an element, and its content where that is beside them."""
        content = self.exactly(8)
        kind, count = self.integers(content)
        if kind >> 16:
            return kind & 0xFFFF, kind >> 16, content[4 : 4 + min(kind >> 16, 4)]
        return kind, count, None

    def small_element(self, limit: int) -> bytes:
        """The content of an element of at most ``limit`` bytes."""
        _, count, beside = self.tag()
        if beside is not None:
            return beside
        if count > limit:
            raise MatFormatError(f"a name or a shape has {count} bytes")
        return self.exactly(count + -count % 8)[:count]

    def skip_element(self, types: tuple[int, ...]) -> None:
        kind, count, beside = self.tag()
        # scipy crashes on types that are none.
        if kind not in types:
            raise MatFormatError(f"the numbers of an array are of type {kind}")
        if beside is None:
            self.skip(count)
            # Compressed variables may end without padding.
            self.byte_count += len(self.stream.read(-count % 8))


def arrays_of_level_5(file: BinaryIO) -> Iterator[MatArray]:
    """List the arrays of a file of level 5 by their headers, those in structs by their paths, as ``log.time``.

    Raises MatFormatError where an element ends early, or the file claims to hold more than is read.
    """
    header = file.read(HEADER_SIZE)
    reader = _Reader(file, "<" if header[126:128] == b"IM" else ">")
    while tag := file.read(8):
        if len(tag) < 8:
            raise MatFormatError("it ends within an array")
        kind, size = reader.integers(tag)
        following = file.tell() + size
        reader.stream = _Inflated(file, size) if kind == _COMPRESSED else file
        if kind == _COMPRESSED:
            kind, _, _ = reader.tag()
        if kind != _MATRIX:
            raise MatFormatError(f"an element is of type {kind}, not an array")
        _walk_array(reader, "", 0, True)
        file.seek(following)
    yield from reader.arrays


def _walk_array(reader: _Reader, member: str, depth: int, is_listed: bool) -> None:
    """Walk through an array after its tag; ``member`` is its path in a struct, empty where it is a variable."""
    reader.array_count += 1
    if reader.array_count > MAX_ARRAYS or depth > MAX_DEPTH:
        raise MatFormatError(f"it holds more than {MAX_ARRAYS} arrays, or some of them deeper than {MAX_DEPTH}")
    (flags, _) = reader.integers(reader.small_element(8).ljust(8, b"\0"))
    array_class, is_complex = flags & 0xFF, bool(flags & 0x800)
    if array_class == _OPAQUE:
        own_name, _, class_name = (_text(reader.small_element(4096)) for _ in range(3))
        if is_listed and (member or own_name):
            reader.arrays.append(MatArray(member or own_name, (), class_name=class_name or "object"))
        _walk_next(reader, member, depth, False)
        return
    shape = reader.integers(reader.small_element(128), "i")
    if any(size < 0 for size in shape):
        raise MatFormatError(f"an array has the shape {shape}")
    # A variable without a name holds what objects consist of.
    own_name = _text(reader.small_element(4096))
    path = member or own_name
    is_listed = is_listed and bool(path)
    is_struct = array_class == _STRUCT and math.prod(shape) == 1
    class_name = "" if array_class in _NUMBERS else "object" if array_class == _OBJECT else "other"
    array = MatArray(path, shape, is_complex, class_name)
    if is_listed and not is_struct:
        reader.arrays.append(array)
    _walk_content(reader, array_class, array, depth, is_listed and is_struct)


def _walk_content(reader: _Reader, array_class: int, array: MatArray, depth: int, is_listed: bool) -> None:
    if array_class in (*_NUMBERS, _CHAR, _SPARSE):
        for _ in range(1 + array.is_complex + (2 if array_class == _SPARSE else 0)):
            reader.skip_element(_TEXT_TYPES if array_class == _CHAR else _NUMBER_TYPES)
        return
    if array_class == _FUNCTION:
        _walk_next(reader, array.path, depth, False)
        return
    if array_class not in (_CELL, _STRUCT, _OBJECT):
        raise MatFormatError(f"an array is of class {array_class}")
    if array_class == _OBJECT:
        reader.small_element(4096)
    fields = [""] if array_class == _CELL else _field_names(reader)
    if math.prod(array.shape) * max(len(fields), 1) > MAX_ARRAYS:
        raise MatFormatError(f"it holds more than {MAX_ARRAYS} arrays")
    for _ in range(math.prod(array.shape)):
        for name in fields:
            _walk_next(reader, f"{array.path}.{name}", depth, is_listed)


def _walk_next(reader: _Reader, path: str, depth: int, is_listed: bool) -> None:
    kind, count, _ = reader.tag()
    if kind != _MATRIX:
        raise MatFormatError(f"an element is of type {kind}, not an array")
    if count:
        _walk_array(reader, path, depth + 1, is_listed)


def _field_names(reader: _Reader) -> list[str]:
    (length,) = reader.integers(reader.small_element(4).ljust(4, b"\0"))
    content = reader.small_element(2**20)
    if not 1 <= length <= 4096 or len(content) % length:
        raise MatFormatError(f"names of {length} bytes are in {len(content)} bytes")
    return [_text(content[start : start + length]) for start in range(0, len(content), length)]


def _text(content: bytes) -> str:
    return content.partition(b"\0")[0].decode("latin-1")
