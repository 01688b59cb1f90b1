"""FMU archives are checked before anything in them is unpacked or trusted.

Refused are paths out of the folder, entries that are no regular files, archives that unpack beyond bounds (zip bombs),
and XML that defines entities or is unbounded. fmpy gets no file that was not checked here.
"""

from __future__ import annotations

import stat
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from io import BufferedReader, FileIO
from pathlib import Path
from xml.sax import ContentHandler, SAXParseException
from xml.sax.xmlreader import AttributesImpl
from zipfile import ZIP_DEFLATED, ZIP_STORED, ZipFile, ZipInfo

import fmpy
from defusedxml import DefusedXmlException
from defusedxml.sax import make_parser
from fmpy.model_description import ModelDescription

from ..errors import InputError, format_value

DESCRIPTION_FILE = "modelDescription.xml"
SYSTEM_STRUCTURE_FILE = "SystemStructure.ssd"
MAX_ENTRIES = 20_000
MAX_DIRECTORY_BYTES = 2**22  # bytes, of the central directory
MAX_UNPACKED_BYTES = 2**31  # bytes, unpacked
MAX_DESCRIPTION_BYTES = 2**26  # bytes
MAX_COMPRESSION_RATIO = 200.0
COMPRESSION_CHECK_BYTES = 2**24  # bytes; below it the compression ratio is not limited
MAX_NAME_BYTES = 255  # bytes, of one folder or file
MAX_PATH_LENGTH = 1024
MAX_ATTRIBUTE_LENGTH = 2**20
MAX_XML_DEPTH = 64
XML_CHUNK_BYTES = 2**16
MAX_REASON_LENGTH = 200
EXPORT_HINT = "name an FMI 2.0 or 3.0 co-simulation FMU"
TRUST_HINT = "get it from a trusted source, or export it again"


class ArchiveError(InputError):
    """An FMU is not a valid archive; ``problem`` continues "the file"."""


def read_model_description(path: Path, check_contents: bool = False) -> ModelDescription:
    """Read the model description of an FMU.

    Raises ArchiveError where it is not a valid archive, see :func:`require_valid_archive`, else what fmpy raises.
    """
    require_valid_archive(path, check_contents)
    return fmpy.read_model_description(str(path))


def put_atomically(transfer: Callable[[Path, Path], object], source: Path, target: Path) -> Path:
    """Copies or moves a file to ``target``, which is replaced at once."""
    partial_file = target.with_name(f".{target.name}.partial")
    transfer(source, partial_file)
    partial_file.replace(target)
    return target


def unpack(path: Path, folder: Path) -> None:
    """Unpack an FMU into a folder; raises ArchiveError before anything is written where it is not a valid archive."""
    require_valid_archive(path)
    fmpy.extract(str(path), str(folder))


def require_valid_archive(path: Path, check_contents: bool = False) -> None:
    """Raises ArchiveError where an FMU must not be unpacked, or its model description not be read.

    With ``check_contents`` the checksum of every entry is verified too.
    """
    with _open_archive(path) as archive:
        entries = archive.infolist()
        _require_size(path, entries)
        for entry in entries:
            _require_regular_file(path, entry)
        _require_distinct_paths(path, [entry.filename for entry in entries])
        _require_description(path, archive)
        if check_contents:
            damaged = archive.testzip()
            if damaged is not None:
                raise ArchiveError(str(path), f"has a damaged entry {format_value(damaged)}", "copy it here again")


class _BoundedReader(BufferedReader):
    """A file with bounded reads: zipfile reads the central directory as a whole."""

    def read(self, size: int | None = -1, /) -> bytes:
        if size is not None and size > MAX_DIRECTORY_BYTES:
            raise ValueError(f"it lists more than {MAX_ENTRIES} entries")
        return super().read(size)


@contextmanager
def _open_archive(path: Path) -> Iterator[ZipFile]:
    if not path.is_file():
        raise ArchiveError(str(path), "is not a file", "check the path")
    try:
        with _BoundedReader(FileIO(path)) as file, ZipFile(file) as archive:
            yield archive
    except InputError:
        raise
    # zipfile, the decompressors and the parser each raise errors of their own.
    except Exception as error:
        message = error.getMessage() if isinstance(error, SAXParseException) else str(error)
        reason = format_value(" ".join(message.split()) or type(error).__name__, MAX_REASON_LENGTH)
        raise ArchiveError(str(path), f"cannot be read as an FMU ({reason})", EXPORT_HINT) from error


def _require_size(path: Path, entries: Sequence[ZipInfo]) -> None:
    packed_bytes, unpacked_bytes = path.stat().st_size, sum(entry.file_size for entry in entries)
    if len(entries) > MAX_ENTRIES:
        problem = f"has {len(entries)} entries, at most {MAX_ENTRIES} are unpacked"
    elif unpacked_bytes > MAX_UNPACKED_BYTES:
        problem = f"would unpack to {unpacked_bytes} bytes, at most {MAX_UNPACKED_BYTES} are"
    elif unpacked_bytes > COMPRESSION_CHECK_BYTES and unpacked_bytes > MAX_COMPRESSION_RATIO * packed_bytes:
        problem = (
            f"would unpack from {packed_bytes} to {unpacked_bytes} bytes, {MAX_COMPRESSION_RATIO:g} times "
            "as many at most are"
        )
    elif sum(entry.compress_size for entry in entries) > packed_bytes:
        problem = "has entries that overlap"
    else:
        return
    raise ArchiveError(str(path), problem, TRUST_HINT)


def _require_regular_file(path: Path, entry: ZipInfo) -> None:
    problem = _path_problem(entry.orig_filename) or _file_type_problem(entry)
    if problem:
        raise ArchiveError(str(path), f"has an entry {format_value(entry.orig_filename)} that {problem}", TRUST_HINT)


def _path_problem(name: str) -> str | None:
    """Why the path of an entry, as the archive has it, is refused; None where it stays inside the folder."""
    parts = name.removesuffix("/").split("/")
    if not name.isprintable():
        return "has unprintable characters"
    if "\\" in name:
        return "has a backslash"
    if name.startswith("/"):
        return "is an absolute path"
    if ":" in name:
        return "has a colon, as in drive letters"
    if ".." in parts:
        return "leads out of the folder"
    if "" in parts or "." in parts:
        return "is not a plain path"
    if len(name) > MAX_PATH_LENGTH or any(len(part.encode("utf-8", "replace")) > MAX_NAME_BYTES for part in parts):
        return "is longer than file systems take"
    return None


def _file_type_problem(entry: ZipInfo) -> str | None:
    kind = stat.S_IFMT(entry.external_attr >> 16)
    if kind == stat.S_IFLNK:
        return "is a symbolic link"
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        return "is neither a file nor a folder"
    if entry.flag_bits & 1:
        return "is encrypted"
    if entry.compress_type not in (ZIP_STORED, ZIP_DEFLATED):
        return "is neither stored nor deflated, as FMI requires"
    return None


def _require_distinct_paths(path: Path, names: Sequence[str]) -> None:
    """Refuse entries that would overwrite each other, also on case-insensitive file systems."""
    names_by_key: dict[str, str] = {}
    for name in names:
        key = name.removesuffix("/").casefold()
        if key in names_by_key:
            problem = f"has two entries for one file, {format_value(names_by_key[key])} and {format_value(name)}"
            raise ArchiveError(str(path), problem, TRUST_HINT)
        names_by_key[key] = name
    for name in names:
        for end in (index for index, character in enumerate(name[:-1]) if character == "/"):
            parent = names_by_key.get(name[:end].casefold(), "/")
            if not parent.endswith("/"):
                raise ArchiveError(str(path), f"has {format_value(parent)} as a file and as a folder", TRUST_HINT)


def _require_description(path: Path, archive: ZipFile) -> None:
    names = archive.namelist()
    if DESCRIPTION_FILE not in names:
        problem = f"cannot be read as an FMU (it has no {DESCRIPTION_FILE})"
        if SYSTEM_STRUCTURE_FILE in names:
            raise ArchiveError(str(path), "is an SSP archive, not an FMU", "name one of the FMUs inside it")
        raise ArchiveError(str(path), problem, EXPORT_HINT)
    size = archive.getinfo(DESCRIPTION_FILE).file_size
    if size > MAX_DESCRIPTION_BYTES:
        problem = f"has a {DESCRIPTION_FILE} of {size} bytes, at most {MAX_DESCRIPTION_BYTES} are read"
        raise ArchiveError(str(path), problem, TRUST_HINT)
    parser = make_parser()
    parser.forbid_dtd = True
    parser.setContentHandler(_BoundedXmlHandler(path))
    try:
        with archive.open(DESCRIPTION_FILE) as file:
            while chunk := file.read(XML_CHUNK_BYTES):
                parser.feed(chunk)
        parser.close()
    except DefusedXmlException as error:
        problem = f"has a {DESCRIPTION_FILE} with a document type, which may define entities"
        raise ArchiveError(str(path), problem, TRUST_HINT) from error


class _BoundedXmlHandler(ContentHandler):
    """Refuses XML with unbounded nesting or attributes, and a modelIdentifier that leads out of the FMU."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._path = path
        self._depth = 0

    def startElement(self, name: str, attrs: AttributesImpl) -> None:  # noqa: N802
        self._depth += 1
        if self._depth > MAX_XML_DEPTH:
            self._refuse(f"nested more than {MAX_XML_DEPTH} deep")
        for key, value in attrs.items():
            if len(value) > MAX_ATTRIBUTE_LENGTH:
                self._refuse(
                    f"with an attribute {format_value(key)} of {len(value)} characters, {MAX_ATTRIBUTE_LENGTH} at most"
                )
            if key == "modelIdentifier" and (_path_problem(value) or "/" in value):
                self._refuse(f"whose modelIdentifier {format_value(value)} is not a valid name")

    def endElement(self, name: str) -> None:  # noqa: N802
        self._depth -= 1

    def _refuse(self, problem: str) -> None:
        raise ArchiveError(str(self._path), f"has a {DESCRIPTION_FILE} {problem}", TRUST_HINT)
