"""Reading files that users supply, with size limits and checks that they are text."""

import codecs
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from .errors import ArgumentError, InputError, describe_value
from .foreign_formats import foreign_format, utf_16_without_mark

HEAD_SIZE = 2**16  # bytes, checked before the rest is read

_UTF_16_MARKS = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


def validate_path(where: str, value: object) -> Path:
    """Converts a text or path-like object to a Path; raises ArgumentError otherwise."""
    if isinstance(value, str | os.PathLike):
        return Path(value)
    raise ArgumentError(where, value, f"is {describe_value(value)}, not a path", "give a text or a pathlib.Path")


def read_bytes(path: str | Path, error_class: type[InputError], max_size: int | None = None) -> bytes:
    """Reads all bytes of a regular file; raises ``error_class`` where there is none or it exceeds ``max_size``."""
    with readable_file(path, error_class) as file:
        size = file.stat().st_size
        if max_size is not None and size > max_size:
            raise error_class(str(path), f"has {size} bytes, at most {max_size} are read", "check the path")
        return file.read_bytes()


def read_text_bytes(
    path: str | Path, error_class: type[InputError], expected_format: str, max_size: int | None = None
) -> bytes:
    """Reads all bytes of a regular file of UTF-8 text; ``expected_format`` names its format in messages.

    Raises ``error_class`` where there is none, it exceeds ``max_size`` bytes, or is not text: if its first bytes show
    that, before the rest is read.
    """
    with readable_file(path, error_class) as file, file.open("rb") as head:
        _refuse_binary(head.read(HEAD_SIZE), str(path), error_class, expected_format)
    content = read_bytes(path, error_class, max_size)
    require_utf8_text(content, str(path), error_class, expected_format)
    return content


def read_encoded_text(
    path: str | Path, error_class: type[InputError], expected_format: str, max_size: int | None = None
) -> tuple[bytes, str]:
    """Reads a text file as UTF-8 without its byte order mark, and names the encoding that it had.

    That is UTF-8, UTF-16 where the file begins with its mark or as ASCII does in it, or else Latin-1, which any bytes
    are: the caller has to limit where it is accepted. Raises ``error_class`` as :func:`read_text_bytes` does.
    """
    with readable_file(path, error_class) as file, file.open("rb") as head_file:
        head = head_file.read(HEAD_SIZE)
    wide = "utf-16" if head.startswith(_UTF_16_MARKS) else utf_16_without_mark(head)
    if wide is None:
        _refuse_binary(head, str(path), error_class, expected_format)
    content = read_bytes(path, error_class, max_size)
    encoding = "UTF-8"
    if wide is not None:
        try:
            content, encoding = content.decode(wide).encode("utf-8"), "UTF-16"
        except UnicodeDecodeError as problem:
            hint = f"save it as {expected_format} in UTF-8"
            raise error_class(str(path), f"is not valid UTF-16 ({problem.reason})", hint) from problem
    _refuse_binary(content, str(path), error_class, expected_format)
    if not content.isascii():
        try:
            content.decode("utf-8")
        except UnicodeDecodeError:
            content, encoding = content.decode("latin-1").encode("utf-8"), "Latin-1"
    while content.startswith(codecs.BOM_UTF8):
        content = content.removeprefix(codecs.BOM_UTF8)
    return content, encoding


@contextmanager
def readable_file(path: str | Path, error_class: type[InputError]) -> Iterator[Path]:
    """Context manager for the path of a regular file.

    Raises ``error_class`` where there is none, or where the block cannot read it.
    """
    where = str(path)
    try:
        file = Path(path)
        if file.is_dir():
            raise error_class(where, "is a folder, not a file", "name a file inside it")
        if not file.exists():
            raise error_class(where, "there is no such file", "check the path")
        if not file.is_file():
            raise error_class(where, "is not a regular file", "copy it to a file first")
        yield file
    except (OSError, ValueError) as os_error:
        reason = getattr(os_error, "strerror", None) or str(os_error)
        raise error_class(where, f"cannot be read ({reason})", "check the path and its permissions") from os_error


def require_utf8_text(content: bytes, where: str, error_class: type[InputError], expected_format: str) -> None:
    """Raises ``error_class`` unless the bytes are UTF-8 text; ``expected_format`` names the format in messages."""
    _refuse_binary(content, where, error_class, expected_format)
    if content.isascii():
        return
    try:
        content.decode("utf-8")
    except UnicodeDecodeError as decode_error:
        location = _line_location(content, where, decode_error.start)
        byte = content[decode_error.start]
        raise error_class(
            location, f"byte 0x{byte:02x} is not UTF-8", f"save it as {expected_format} in UTF-8"
        ) from decode_error


def _refuse_binary(content: bytes, where: str, error_class: type[InputError], expected_format: str) -> None:
    """Raises ``error_class`` where the bytes, or the first of them, show that a file is not text."""
    hint = f"save it as {expected_format} in UTF-8"
    if foreign := foreign_format(content[:HEAD_SIZE], expected_format):
        raise error_class(where, *foreign)
    if content.startswith(_UTF_16_MARKS):
        raise error_class(where, "is UTF-16, not UTF-8", hint)
    null_index = content.find(b"\0")
    if null_index >= 0:
        raise error_class(_line_location(content, where, null_index), "is binary (it has a zero byte), not text", hint)


def _line_location(content: bytes, where: str, position: int) -> str:
    preceding = content[:position].replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    line_breaks = preceding.count(b"\n")
    return f"{where}: line {line_breaks + 1}"
