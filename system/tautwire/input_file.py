"""Reading files that others wrote."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import ArgumentError, InputError, described

HEAD = 2**16  # bytes that are looked at before all are read

_UTF_16_MARKS = (b"\xff\xfe", b"\xfe\xff")


def path_of(where: str, value: object) -> Path:
    """The path that a text or a path names; raises ArgumentError."""
    if isinstance(value, str | os.PathLike):
        return Path(value)
    raise ArgumentError(where, value, f"is {described(value)}, not a path", "give a text or a pathlib.Path")


def read_bytes(path: str | Path, error: type[InputError], largest: int | None = None) -> bytes:
    """All bytes of a regular file; raises ``error`` where there is none or it is larger than ``largest``."""
    with readable_file(path, error) as file:
        size = file.stat().st_size
        if largest is not None and size > largest:
            raise error(str(path), f"has {size} bytes, at most {largest} are read", "check the path")
        return file.read_bytes()


def read_text(path: str | Path, error: type[InputError], kind: str, largest: int | None = None) -> bytes:
    """All bytes of a regular file of UTF-8 text; ``kind`` is what it should be.

    Raises ``error`` where there is none, it is larger than ``largest``, or is no text: if its beginning tells, before
    the rest of it is read.
    """
    with readable_file(path, error) as file, file.open("rb") as beginning:
        _require_no_binary(beginning.read(HEAD), str(path), error, kind)
    content = read_bytes(path, error, largest)
    require_text(content, str(path), error, kind)
    return content


@contextmanager
def readable_file(path: str | Path, error: type[InputError]) -> Iterator[Path]:
    """The path of a regular file; raises ``error`` where there is none, or where the block cannot read it."""
    where = str(path)
    try:
        file = Path(path)
        if file.is_dir():
            raise error(where, "is a folder, not a file", "name a file inside it")
        if not file.exists():
            raise error(where, "there is no such file", "check the path")
        if not file.is_file():
            raise error(where, "is not a regular file", "copy it to a file first")
        yield file
    except (OSError, ValueError) as problem:
        reason = getattr(problem, "strerror", None) or str(problem)
        raise error(where, f"cannot be read ({reason})", "check the path and its permissions") from problem


def require_text(content: bytes, where: str, error: type[InputError], kind: str) -> None:
    """Raises ``error`` unless the bytes are UTF-8 text; ``kind`` is what the file should be."""
    _require_no_binary(content, where, error, kind)
    if content.isascii():
        return
    try:
        content.decode("utf-8")
    except UnicodeDecodeError as problem:
        line = _line(content, where, problem.start)
        byte = content[problem.start]
        raise error(line, f"byte 0x{byte:02x} is not UTF-8", f"save it as {kind} in UTF-8") from problem


def _require_no_binary(content: bytes, where: str, error: type[InputError], kind: str) -> None:
    """Raises ``error`` where the bytes, or the first of them, show that a file is something else than text."""
    mend = f"save it as {kind} in UTF-8"
    if content.startswith(b"PK\x03\x04"):
        raise error(where, "is a zip archive or a spreadsheet, not text", mend)
    if content.startswith(b"\x1f\x8b"):
        raise error(where, "is packed by gzip, not text", "unpack it first")
    if content.startswith(_UTF_16_MARKS):
        raise error(where, "is UTF-16, not UTF-8", mend)
    zero = content.find(b"\0")
    if zero >= 0:
        raise error(_line(content, where, zero), "is binary (it has a zero byte), not text", mend)


def _line(content: bytes, where: str, position: int) -> str:
    before = content[:position].replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    breaks = before.count(b"\n")
    return f"{where}: line {breaks + 1}"
