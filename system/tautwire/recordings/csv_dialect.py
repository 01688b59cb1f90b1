"""Dialects of recordings in CSV: encodings, separators, decimal marks, comments, units and clock times."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from io import StringIO
from itertools import islice

from ..errors import RecordingError, format_value
from ..input_files import read_encoded_text
from .clock_time import clock_format
from .column_map import ColumnMap
from .csv_header import CsvHeader, read_header
from .csv_lines import SEPARATORS, split_cells
from .recording_table import Header
from .units import units_in_words

# Lines in which the header and the first sample are looked for.
MAX_HEAD_LINES = 500

# Beginnings of files that name another format.
MARKUPS = {b"<": "HTML or XML", b"{\\rtf": "rich text", b"{": "JSON", b"[{": "JSON", b"[[": "JSON"}
MAX_MARKUP_HEAD = 1000

_LINE = re.compile(rb"[^\r\n]*(?:\r\n|\r|\n|\Z)")
_THOUSANDS = re.compile(rb"[-+]?[1-9][0-9]{0,2},[0-9]{3}")


@dataclass(frozen=True)
class CsvText:
    """A recording in CSV: the header in the first line that is not blank, then one line per sample, in UTF-8.

    Lines that hold neither are blank, so that lines count as in the file. ``header_line`` counts from 1; ``header`` is
    not yet validated.
    """

    content: bytes
    separator: str
    header_line: int
    header: Header


@dataclass(frozen=True)
class _Source:
    """A file as it is written: ``start`` is the byte at which the samples begin, ``first_cells`` those of the first."""

    file: str
    content: bytes
    encoding: str
    header: CsvHeader
    start: int
    separator: str
    first_cells: tuple[str, ...]

    @property
    def has_comments(self) -> bool:
        """Whether there may be comments among the samples: where the first column is not read, it may hold labels."""
        return self.header.names[0] in self.header.known and self.content.find(b"#", self.start) >= 0

    @property
    def is_standard(self) -> bool:
        """Whether nothing has to be rewritten."""
        is_plain = self.encoding == "UTF-8" and self.separator == "," and self.header.is_standard
        return is_plain and self.first_cells[-1:] != ("",) and not self.has_comments


def read_csv_text(file: str, max_size: int, columns: ColumnMap) -> CsvText:
    """Read a recording's CSV in any dialect; raises RecordingError where the dialect is not clear."""
    content, encoding = read_encoded_text(file, RecordingError, "CSV", max_size)
    if not content or content.isspace():
        raise RecordingError(file, "is empty", "write a header line and two or more samples")
    _require_no_markup(content, file)
    lines = [match.group() for match in islice(_LINE.finditer(content), MAX_HEAD_LINES)]
    header = read_header(content, lines, columns, file)
    if encoding == "Latin-1" and not header.is_certain:
        _require_ascii(content, 0, file)
    first_row = lines[header.data_index].decode("utf-8").strip("\r\n") if header.data_index < len(lines) else ""
    separator = _data_separator(first_row, header)
    start = sum(map(len, lines[: header.data_index]))
    source = _Source(file, content, encoding, header, start, separator, tuple(split_cells(first_row, separator)))
    clock = clock_format(dict(zip(header.names, source.first_cells, strict=False)).get("time", ""))
    text = CsvText(
        content,
        separator,
        header.index + 1,
        Header(header.names, (), units=header.units, scales=columns.scales, clock=clock),
    )
    # Nothing is copied of a file in the standard dialect, which may be long.
    text = text if source.is_standard else _rewritten(text, source)
    read_as = replace(text.header, dialect=_in_words(text.header, source))
    return replace(text, header=read_as.with_recorded_columns(read_as))


def _require_no_markup(content: bytes, file: str) -> None:
    """Raises RecordingError where the text is that of another kind of file, as some programs export tables."""
    head = content[:MAX_MARKUP_HEAD].lstrip().lower()
    for mark, kind in MARKUPS.items():
        if head.startswith(mark):
            raise RecordingError(file, f"is {kind}, not a table in CSV", "export it as CSV")


def _rewritten(text: CsvText, source: _Source) -> CsvText:
    """The text with one separator, and blank lines where neither the header nor a sample stands."""
    header, body = source.header, source.content[source.start :]
    if source.has_comments:
        body = _without_comments(body)
    if source.encoding == "Latin-1":
        _require_ascii(body, header.data_index, source.file)
    body, separator, names = _with_columns(body, source)
    head = source.content[: source.start]
    if not (header.is_standard and separator == header.separator and names == header.names):
        head = b"\n" * header.index + _header_row(names, separator) + b"\n" * (header.data_index - header.index)
    is_read = [name in header.known for name in names]
    decimal_mark = _decimal_mark(body, separator, is_read, header.data_index, source.file)
    return replace(
        text,
        content=head + body,
        separator=separator,
        header=replace(text.header, names=names, decimal_mark=decimal_mark),
    )


def _without_comments(body: bytes) -> bytes:
    """The lines with samples, blank where a comment stands; a line inside quotation marks is none."""
    lines, is_quoted = body.splitlines(keepends=True), False
    for index, line in enumerate(lines):
        if not is_quoted and line.lstrip().startswith(b"#"):
            lines[index] = line[len(line.rstrip(b"\r\n")) :]
        else:
            is_quoted ^= line.count(b'"') % 2 == 1
    return b"".join(lines)


def _require_ascii(content: bytes, first_index: int, file: str) -> None:
    """Raises RecordingError where text that was not UTF-8 stands where numbers are read."""
    match = re.search(rb"[\x80-\xff]+", content)
    if match is not None:
        line = first_index + len((content[: match.start()] + b".").splitlines())
        byte = ord(match.group().decode("utf-8")[0])
        problem = f"byte 0x{byte:02x} is not UTF-8"
        raise RecordingError(f"{file}: line {line}", problem, "save it as CSV in UTF-8", line)


def _data_separator(first_row: str, header: CsvHeader) -> str:
    """The separator of the samples; a header that is a comment may have another."""
    fits = {separator: len(split_cells(first_row, separator)) == len(header.names) for separator in SEPARATORS}
    if fits[header.separator] or not header.is_comment:
        return header.separator
    return next((separator for separator, fitting in fits.items() if fitting), header.separator)


def _with_columns(body: bytes, source: _Source) -> tuple[bytes, str, tuple[str, ...]]:
    """Samples with tabs for spaces, and without a separator at the end of each line; their separator, and the names."""
    separator, names = source.separator, source.header.names
    if separator == " ":
        return b"".join(b"\t".join(line.split()) + b"\n" for line in body.splitlines()), "\t", names
    named = names[:-1] if len(names) > 1 and not names[-1] else names
    if len(source.first_cells) == len(names) - 1 > 1 and names[-1] not in source.header.known:
        # LabVIEW's (.lvm) last column is a comment, and only lines that have one have its cell.
        return body, separator, _without_comment_column(body, separator, names)
    if len(source.first_cells) != len(named) + 1 or source.first_cells[-1]:
        return body, separator, names
    lines = [line.rstrip(b" ") for line in body.splitlines()]
    if not all(line.endswith(separator.encode()) or not line for line in lines):
        return body, separator, names
    return b"\n".join(line[:-1] for line in lines), separator, named


def _without_comment_column(body: bytes, separator: str, names: tuple[str, ...]) -> tuple[str, ...]:
    """The names without the last one where no line has a cell for it."""
    lines = [line for line in body.splitlines() if line.strip()]
    is_lacking = all(line.count(separator.encode()) == len(names) - 2 for line in lines)
    return names[:-1] if is_lacking else names


def _header_row(names: tuple[str, ...], separator: str) -> bytes:
    row = StringIO()
    csv.writer(row, delimiter=separator, lineterminator="").writerow(
        [name.replace("\r", " ").replace("\n", " ") for name in names]
    )
    return row.getvalue().encode()


def _decimal_mark(body: bytes, separator: str, is_read: Sequence[bool], first_index: int, file: str) -> str:
    """The decimal mark of the columns that are read; RecordingError where commas may also separate thousands."""
    if separator == "," or b"," not in body:
        return "."
    edge, line_end = separator.encode(), b"\n" if b"\n" in body else b"\r"
    number = re.compile(
        rb'(?<![^\r\n" ' + edge + rb"])([-+]?[0-9]*,[0-9]+(?:[eE][-+]?[0-9]+)?)(?![^\r\n\" " + edge + rb"])"
    )
    first = None
    for match in number.finditer(body):
        column = body.count(edge, body.rfind(line_end, 0, match.start()) + 1, match.start())
        if column < len(is_read) and not is_read[column]:
            continue
        if not _THOUSANDS.fullmatch(match.group(1)):
            return ","
        first = first or match
    if first is None:
        return "."
    line = first_index + len((body[: first.start()] + b".").splitlines())
    problem = f"the comma of {format_value(first.group(1).decode())} may be decimal or separate thousands"
    hint = "write numbers with a decimal point, or one of them with more or fewer decimals"
    raise RecordingError(f"{file}: line {line}", f"{problem}, as in all numbers of this file", hint, line)


def _in_words(read_as: Header, source: _Source) -> str:
    """What differs from the standard dialect; blank where nothing does."""
    header, separator = source.header, source.separator
    parts = [] if source.encoding == "UTF-8" else [f"as {source.encoding}"]
    marks = [SEPARATORS[separator]] if separator != "," else []
    if separator != header.separator:
        marks = [f"{SEPARATORS[separator]} below a header with {SEPARATORS[header.separator]}"]
    marks += ["decimal commas"] if read_as.decimal_mark == "," else []
    parts += [f"with {' and '.join(marks)}"] if marks else []
    if read_as.clock is not None:
        parts.append(f"time is {read_as.clock.style}, in s from the first sample")
    parts += [words] if (words := units_in_words(header.units)) else []
    if header.is_comment:
        parts.append(f"the comment in line {header.index + 1} is the header")
    if header.has_text_above:
        parts.append(f"text above the header in line {header.index + 1} is ignored")
    return "; ".join(parts)
