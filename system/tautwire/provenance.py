"""Provenance of results: version, command, date and SHA-256 of the inputs, made once and written into every output."""

from __future__ import annotations

import hashlib
import json
import os
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from datetime import datetime, timezone
from pathlib import Path
from typing import Any
from urllib.parse import quote

from . import __version__
from .errors import InputError, one_line

PROVENANCE_KEY = "tautwire.provenance"  # in the schema metadata of Parquet files
CSV_METADATA_SUFFIX = "-metadata.json"  # where CSV on the Web looks for the metadata of a table
DATE_VARIABLE = "SOURCE_DATE_EPOCH"
COMMENT_STARTS = ("# Written by Tautwire ", "# command: ", "# input: ")
HASHED_BLOCK_BYTES = 2**20


@dataclass(frozen=True)
class Provenance:
    """Origin of a result: ``version``, ``command`` (None from Python), ``created`` (ISO 8601, UTC), ``inputs``.

    ``inputs`` maps the names of the files that were read to the SHA-256 of their bytes, in hexadecimal digits.
    """

    version: str
    command: str | None
    created: str
    inputs: Mapping[str, str] = field(default_factory=dict)

    def document(self) -> dict[str, Any]:
        """The provenance in JSON types."""
        return {**asdict(self), "inputs": dict(self.inputs)}

    def schema_metadata(self) -> dict[str, str]:
        """Metadata of a Parquet schema: the document as JSON text."""
        return {PROVENANCE_KEY: json.dumps(self.document())}

    def comment(self) -> str:
        """Comment lines for the head of a TOML file, each ended by a line break."""
        written, command, source = COMMENT_STARTS
        lines = [f"{written}{self.version} at {self.created}"]
        lines += [f"{command}{one_line(self.command)}"] if self.command else []
        lines += [f"{source}{one_line(name)} sha256 {digest}" for name, digest in self.inputs.items()]
        return "\n".join(lines) + "\n"

    def csv_metadata(self, file_name: str) -> str:
        """Metadata of a CSV file as W3C's "CSV on the Web" has it: JSON with the provenance among its notes."""
        document = {
            "@context": "http://www.w3.org/ns/csvw",
            "url": quote(file_name, errors="surrogateescape"),
            "notes": [{"provenance": self.document()}],
        }
        return json.dumps(document, indent=1) + "\n"


def csv_metadata_path(table: Path) -> Path:
    """Where the metadata of a CSV file stands: beside it, where "CSV on the Web" looks for it."""
    return table.with_name(table.name + CSV_METADATA_SUFFIX)


def refuse_foreign_csv_metadata(table: Path | None) -> None:
    """Raises InputError where metadata beside a CSV file to be written would replace a file that is not Tautwire's."""
    path = None if table is None else csv_metadata_path(table)
    if path is None or not path.is_file():
        return
    try:
        (note,) = json.loads(path.read_bytes())["notes"]
        is_ours = set(note["provenance"]) >= {"version", "created"}
    except (ValueError, KeyError, TypeError):
        is_ours = False
    if not is_ours:
        raise InputError(str(path), "is not Tautwire's, and metadata would replace it", "choose another --out")


def provenance_of(inputs: Sequence[str | Path] | Mapping[str, Path] = (), command: str | None = None) -> Provenance:
    """Provenance of a result that is about to be computed from files; a mapping gives names to them.

    A folder, such as a ROS bag, stands for the files in it.
    The date is that of the environment variable ``SOURCE_DATE_EPOCH``, in s since 1970, if it is set, else now.

    Raises InputError where that is no date, OSError where a file cannot be read.
    """
    named = inputs if isinstance(inputs, Mapping) else {str(path): Path(path) for path in inputs}
    files = {name: file for key, path in named.items() for name, file in _files_of(key, path)}
    return Provenance(__version__, command, _utc_date(), {name: _sha256(file) for name, file in files.items()})


def command_text(arguments: Sequence[str]) -> str:
    """The command line of an argument list, quoted for a shell."""
    return shlex.join(["tautwire", *arguments])


def _utc_date() -> str:
    text = os.environ.get(DATE_VARIABLE)
    try:
        date = datetime.now(timezone.utc) if text is None else datetime.fromtimestamp(int(text), timezone.utc)
    except (ValueError, OverflowError, OSError) as error:
        hint = "give whole seconds since 1970, such as 1700000000, or unset it"
        raise InputError(DATE_VARIABLE, f"{text!r} is not a date", hint) from error
    return date.strftime("%Y-%m-%dT%H:%M:%SZ")


def _files_of(name: str, path: Path) -> Iterator[tuple[str, Path]]:
    """A file with its name, or the files of a folder with theirs after the folder's."""
    if not path.is_dir():
        yield name, path
        return
    for file in sorted(path.iterdir()):
        if file.is_file():
            yield f"{name.rstrip('/')}/{file.name}", file


def _sha256(path: Path) -> str:
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(HASHED_BLOCK_BYTES):
            digest.update(block)
    return digest.hexdigest()
