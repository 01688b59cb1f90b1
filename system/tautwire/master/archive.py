"""FMUs as archives that others made: looked through before anything in them is unpacked or taken for what it says.

What is refused: a way out of the folder, what is no plain file, what would grow beyond bounds, and XML that defines
entities or has no bounds. fmpy gets no file that was not looked through here.
"""

from __future__ import annotations

import stat
from collections.abc import Iterator, Sequence
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

from ..errors import InputError, shown

DESCRIPTION = "modelDescription.xml"
SYSTEM = "SystemStructure.ssd"
MOST_ENTRIES = 20_000
LARGEST_DIRECTORY = 2**22  # bytes, of names and places of all entries
LARGEST_TOTAL = 2**31  # bytes, unpacked
LARGEST_DESCRIPTION = 2**26  # bytes
LARGEST_GROWTH = 200.0
SMALL = 2**24  # bytes; whatever unpacks to less may be packed as tightly as it likes
LONGEST_NAME = 255  # bytes, of one folder or file
LONGEST_PATH = 1024
LONGEST_ATTRIBUTE = 2**20
DEEPEST = 64
CHUNK = 2**16
LONGEST_REASON = 200
EXPORT = "name an FMI 2.0 or 3.0 co-simulation FMU"
TRUST = "get it from where you trust, or export it anew"


class ArchiveError(InputError):
    """An FMU that is no sound archive; ``problem`` goes on from "the file"."""


def description_of(path: Path, whole: bool = False) -> ModelDescription:
    """What an FMU says of itself.

    Raises ArchiveError where it is no sound archive, see :func:`require_sound`, else what fmpy raises.
    """
    require_sound(path, whole)
    return fmpy.read_model_description(str(path))


def unpack(path: Path, folder: Path) -> None:
    """Unpack an FMU into a folder; raises ArchiveError before anything is written where it is no sound archive."""
    require_sound(path)
    fmpy.extract(str(path), str(folder))


def require_sound(path: Path, whole: bool = False) -> None:
    """Raises ArchiveError where an FMU must not be unpacked, or its description not be read.

    With ``whole`` every entry is also read through, so that damage shows.
    """
    with _opened(path) as archive:
        entries = archive.infolist()
        _require_size(path, entries)
        for entry in entries:
            _require_plain(path, entry)
        _require_apart(path, [entry.filename for entry in entries])
        _require_description(path, archive)
        if whole:
            damaged = archive.testzip()
            if damaged is not None:
                raise ArchiveError(str(path), f"has a damaged entry {shown(damaged)}", "copy it here anew")


class _Bounded(BufferedReader):
    """A file of which no more is read at once than a directory may have; zipfile reads that as a whole."""

    def read(self, size: int | None = -1, /) -> bytes:
        if size is not None and size > LARGEST_DIRECTORY:
            raise ValueError(f"it lists more than {MOST_ENTRIES} entries")
        return super().read(size)


@contextmanager
def _opened(path: Path) -> Iterator[ZipFile]:
    if not path.is_file():
        raise ArchiveError(str(path), "is no file", "check the path")
    try:
        with _Bounded(FileIO(path)) as file, ZipFile(file) as archive:
            yield archive
    except InputError:
        raise
    # zipfile, the decompressors and the parser each raise what they like.
    except Exception as error:
        said = error.getMessage() if isinstance(error, SAXParseException) else str(error)
        reason = shown(" ".join(said.split()) or type(error).__name__, LONGEST_REASON)
        raise ArchiveError(str(path), f"cannot be read as an FMU ({reason})", EXPORT) from error


def _require_size(path: Path, entries: Sequence[ZipInfo]) -> None:
    packed, total = path.stat().st_size, sum(entry.file_size for entry in entries)
    if len(entries) > MOST_ENTRIES:
        problem = f"has {len(entries)} entries, at most {MOST_ENTRIES} are unpacked"
    elif total > LARGEST_TOTAL:
        problem = f"would unpack to {total} bytes, at most {LARGEST_TOTAL} are"
    elif total > SMALL and total > LARGEST_GROWTH * packed:
        problem = f"would unpack from {packed} to {total} bytes, {LARGEST_GROWTH:g} times as many at most are"
    elif sum(entry.compress_size for entry in entries) > packed:
        problem = "has entries that overlap"
    else:
        return
    raise ArchiveError(str(path), problem, TRUST)


def _require_plain(path: Path, entry: ZipInfo) -> None:
    problem = _way_out(entry.orig_filename) or _no_plain_file(entry)
    if problem:
        raise ArchiveError(str(path), f"has an entry {shown(entry.orig_filename)} that {problem}", TRUST)


def _way_out(name: str) -> str | None:
    """How the name of an entry, as the archive has it, leads elsewhere than into the folder."""
    parts = name.removesuffix("/").split("/")
    if not name.isprintable():
        return "has unprintable characters"
    if "\\" in name:
        return "has a backslash"
    if name.startswith("/"):
        return "is an absolute path"
    if ":" in name:
        return "has a colon, as drives have"
    if ".." in parts:
        return "leads out of the folder"
    if "" in parts or "." in parts:
        return "is no plain path"
    if len(name) > LONGEST_PATH or any(len(part.encode("utf-8", "replace")) > LONGEST_NAME for part in parts):
        return "is longer than file systems take"
    return None


def _no_plain_file(entry: ZipInfo) -> str | None:
    kind = stat.S_IFMT(entry.external_attr >> 16)
    if kind == stat.S_IFLNK:
        return "is a symbolic link"
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        return "is neither a file nor a folder"
    if entry.flag_bits & 1:
        return "is encrypted"
    if entry.compress_type not in (ZIP_STORED, ZIP_DEFLATED):
        return "is neither stored nor deflated, as FMI wants"
    return None


def _require_apart(path: Path, names: Sequence[str]) -> None:
    """Refuse entries that would take each other's place, also where letter case does not count."""
    taken: dict[str, str] = {}
    for name in names:
        key = name.removesuffix("/").casefold()
        if key in taken:
            problem = f"has two entries for one file, {shown(taken[key])} and {shown(name)}"
            raise ArchiveError(str(path), problem, TRUST)
        taken[key] = name
    for name in names:
        for end in (at for at, character in enumerate(name[:-1]) if character == "/"):
            above = taken.get(name[:end].casefold(), "/")
            if not above.endswith("/"):
                raise ArchiveError(str(path), f"has {shown(above)} as a file and as a folder", TRUST)


def _require_description(path: Path, archive: ZipFile) -> None:
    names = archive.namelist()
    if DESCRIPTION not in names:
        problem = f"cannot be read as an FMU (it has no {DESCRIPTION})"
        if SYSTEM in names:
            raise ArchiveError(str(path), "is an SSP archive, not an FMU", "name one of the FMUs inside it")
        raise ArchiveError(str(path), problem, EXPORT)
    size = archive.getinfo(DESCRIPTION).file_size
    if size > LARGEST_DESCRIPTION:
        problem = f"has a {DESCRIPTION} of {size} bytes, at most {LARGEST_DESCRIPTION} are read"
        raise ArchiveError(str(path), problem, TRUST)
    parser = make_parser()
    parser.forbid_dtd = True
    parser.setContentHandler(_Bounds(path))
    try:
        with archive.open(DESCRIPTION) as file:
            while chunk := file.read(CHUNK):
                parser.feed(chunk)
        parser.close()
    except DefusedXmlException as error:
        problem = f"has a {DESCRIPTION} with a document type, which may define entities"
        raise ArchiveError(str(path), problem, TRUST) from error


class _Bounds(ContentHandler):
    """Refuses XML that nests or writes without end, and a library that lies elsewhere than in the FMU."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._path = path
        self._depth = 0

    def startElement(self, name: str, attrs: AttributesImpl) -> None:  # noqa: N802
        self._depth += 1
        if self._depth > DEEPEST:
            self._refuse(f"nested more than {DEEPEST} deep")
        for key, value in attrs.items():
            if len(value) > LONGEST_ATTRIBUTE:
                self._refuse(f"with an attribute {shown(key)} of {len(value)} characters, {LONGEST_ATTRIBUTE} at most")
            if key == "modelIdentifier" and (_way_out(value) or "/" in value):
                self._refuse(f"whose modelIdentifier {shown(value)} is no name")

    def endElement(self, name: str) -> None:  # noqa: N802
        self._depth -= 1

    def _refuse(self, problem: str) -> None:
        raise ArchiveError(str(self._path), f"has a {DESCRIPTION} {problem}", TRUST)
