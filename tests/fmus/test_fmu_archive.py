"""Hostile FMUs: refused in one line before anything in them is unpacked, and before fmpy sees them."""

from __future__ import annotations

import gzip
import stat
import struct
import tempfile
import time
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import pytest

from tautwire.cli import run
from tautwire.cosimulation import Component
from tautwire.fmus import fmu_archive as archive
from tautwire.fmus.fmu_archive import ArchiveError, read_model_description, require_valid_archive, unpack
from tautwire.fmus.packaging import RobotFmus
from tests.support.own_fmus import DESCRIPTION, packed
from tests.support.robots import EXAMPLES

ROBOT = EXAMPLES / "three" / "robot.toml"
SPEEDS = EXAMPLES / "three" / "fit.csv"
Make = Callable[[Path], Path]


def with_entry(name: str, content: bytes = b"", **fields: Any) -> Make:
    """A sound FMU with one more entry."""

    def make(path: Path) -> Path:
        packed(path, b"library")
        entry = zipfile.ZipInfo("placeholder")
        entry.filename = name
        for key, value in fields.items():
            setattr(entry, key, value)
        with warnings.catch_warnings(), zipfile.ZipFile(path, "a") as content_of:
            warnings.simplefilter("ignore", UserWarning)
            content_of.writestr(entry, content, compress_type=fields.get("compress_type"))
        return path

    return make


def described(text: str | bytes) -> Make:
    """An FMU with this model description."""

    def make(path: Path) -> Path:
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as content:
            content.writestr("modelDescription.xml", text)
            content.writestr(f"binaries/{fmpy.platform}/lag_winch.so", b"library")
        return path

    return make


def having(content: bytes) -> Make:
    def make(path: Path) -> Path:
        path.write_bytes(content)
        return path

    return make


def patched(old: bytes, new: bytes, which: int = -1) -> Make:
    """A sound FMU with bytes replaced, by default the last occurrence."""

    def make(path: Path) -> Path:
        content = packed(path, b"library").read_bytes()
        assert len(old) == len(new)
        place = content.rindex(old) if which < 0 else content.index(old)
        path.write_bytes(content[:place] + new + content[place + len(old) :])
        return path

    return make


def encrypted(path: Path) -> Path:
    """The flag of the last entry of the directory says that it is."""
    content = bytearray(packed(path, b"library").read_bytes())
    content[content.rindex(b"PK\x01\x02") + 8] |= 1
    path.write_bytes(content)
    return path


def bomb(path: Path) -> Path:
    return with_entry("resources/zeros", bytes(2**26), compress_type=zipfile.ZIP_DEFLATED)(path)


def claiming(size: int) -> Make:
    """The last entry claims to be so long."""

    def make(path: Path) -> Path:
        content = bytearray(packed(path, b"library").read_bytes())
        struct.pack_into("<L", content, content.rindex(b"PK\x01\x02") + 24, size)
        path.write_bytes(content)
        return path

    return make


def crowd(path: Path) -> Path:
    packed(path, b"library")
    with zipfile.ZipFile(path, "a") as content:
        for number in range(archive.MAX_ENTRIES):
            content.writestr(str(number), b"")
    return path


def vast_directory(path: Path) -> Path:
    """The directory is longer than any with so few entries as are unpacked."""
    content = packed(path, b"library").read_bytes()
    end = bytearray(content[content.rindex(b"PK\x05\x06") :])
    size = 2**23
    struct.pack_into("<HHLL", end, 8, 0xFFFE, 0xFFFE, size, 0)
    with path.open("wb") as file:
        file.seek(size)
        file.write(end)
    return path


def overlapping(path: Path) -> Path:
    """Many entries of the directory lead to one file."""
    with zipfile.ZipFile(path, "w") as content:
        content.writestr("modelDescription.xml", DESCRIPTION)
        kernel = zipfile.ZipInfo("kernel")
        content.writestr(kernel, bytes(2**16))
        for number in range(100):
            twin = zipfile.ZipInfo(f"resources/{number}")
            twin.header_offset, twin.CRC = kernel.header_offset, kernel.CRC
            twin.compress_size, twin.file_size = kernel.compress_size, kernel.file_size
            content.filelist.append(twin)
            content.NameToInfo[twin.filename] = twin
    return path


def twice(first: str, second: str) -> Make:
    """A sound FMU with two more entries."""

    def make(path: Path) -> Path:
        packed(path, b"library")
        with warnings.catch_warnings(), zipfile.ZipFile(path, "a") as content:
            warnings.simplefilter("ignore", UserWarning)
            content.writestr(first, b"1")
            content.writestr(second, b"2")
        return path

    return make


def system(path: Path) -> Path:
    with zipfile.ZipFile(path, "w") as content:
        content.writestr("SystemStructure.ssd", LAUGHS.replace("fmiModelDescription", "SystemStructureDescription"))
    return path


LEVELS = "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10}">' for i in range(1, 10))
LAUGHS = f'<!DOCTYPE a [<!ENTITY l0 "ha">{LEVELS}]><fmiModelDescription fmiVersion="2.0">&l9;</fmiModelDescription>'
EXTERNAL = DESCRIPTION.replace("?>\n", '?>\n<!DOCTYPE a [<!ENTITY e SYSTEM "file:///etc/hostname">]>', 1)
REMOTE = DESCRIPTION.replace("?>\n", '?>\n<!DOCTYPE a SYSTEM "http://127.0.0.1:9/a.dtd">', 1)
UTF_16 = LAUGHS.encode("utf-16")
DEEP = "<a>" * 100_000 + "</a>" * 100_000
WIDE = DESCRIPTION.replace("lag_winch", "a" * (2**20 + 1), 1)
ELSEWHERE = DESCRIPTION.replace('modelIdentifier="lag_winch"', 'modelIdentifier="../../../../tmp/evil"')
LINK = (stat.S_IFLNK | 0o777) << 16
PIPE = (stat.S_IFIFO | 0o644) << 16

HOSTILE: dict[str, tuple[Make, str]] = {
    "parent": (with_entry("../evil"), "'../evil' that leads out of the folder"),
    "deep parent": (with_entry("resources/../../evil"), "leads out of the folder"),
    "absolute": (with_entry("/etc/evil"), "'/etc/evil' that is an absolute path"),
    "drive": (with_entry("C:evil"), "has a colon, as in drive letters"),
    "backslash": (with_entry("resources\\..\\..\\evil"), "has a backslash"),
    "dot": (with_entry("./evil"), "is not a plain path"),
    "zero byte": (with_entry("evil\0.txt"), "unprintable"),
    "line break": (with_entry("evil\ntautwire: all is well"), "unprintable"),
    "long name": (with_entry("a" * 300), "longer than file systems take"),
    "link": (with_entry("resources/link", b"/etc/passwd", external_attr=LINK), "is a symbolic link"),
    "pipe": (with_entry("resources/pipe", external_attr=PIPE), "neither a file nor a folder"),
    "encrypted": (encrypted, "is encrypted"),
    "lzma": (with_entry("resources/a", b"a", compress_type=zipfile.ZIP_LZMA), "neither stored nor deflated"),
    "bomb": (bomb, "200 times as many at most"),
    "claim": (claiming(0xFFFFFFF0), "would unpack to"),
    "damaged": (patched(b"library", b"librarY", 1), "damaged entry"),
    "crowd": (crowd, "at most 20000 are unpacked"),
    "vast directory": (vast_directory, "more than 20000 entries"),
    "overlapping": (overlapping, "overlap"),
    "two descriptions": (twice("a", "modelDescription.xml"), "two entries for one file"),
    "case": (twice("resources/A.txt", "resources/a.TXT"), "'resources/A.txt' and 'resources/a.TXT'"),
    "file as folder": (twice("resources/a", "resources/a/b"), "'resources/a' as a file and as a folder"),
    "no description": (having(b"PK\x05\x06" + bytes(18)), "it has no modelDescription.xml"),
    "system": (system, "is an SSP archive, not an FMU"),
    "laughs": (described(LAUGHS), "document type"),
    "laughs in UTF-16": (described(UTF_16), "document type"),
    "external": (described(EXTERNAL), "document type"),
    "remote": (described(REMOTE), "document type"),
    "deep": (described(DEEP), "nested more than 64 deep"),
    "wide": (described(WIDE), "an attribute 'modelName' of 1048577 characters"),
    "long": (described(DESCRIPTION + " " * 2**26), "at most"),
    "elsewhere": (described(ELSEWHERE), "modelIdentifier '../../../../tmp/evil' is not a valid name"),
    "encoding": (described(DESCRIPTION.replace("UTF-8", "UTF-99")), "cannot be read as an FMU"),
    "no XML": (described("<"), "cannot be read as an FMU"),
    "empty description": (described(""), "cannot be read as an FMU"),
    "empty": (having(b""), "cannot be read as an FMU"),
    "text": (having(b"no archive"), "cannot be read as an FMU"),
    "gzip": (having(gzip.compress(b"no archive")), "cannot be read as an FMU"),
    "cut off": (patched(b"PK\x05\x06", b"PK\x05\x07"), "cannot be read as an FMU"),
}


def forbid_fmpy(monkeypatch: pytest.MonkeyPatch) -> None:
    def reached(*arguments: object, **options: object) -> None:
        raise AssertionError("fmpy was reached")

    for name in ("extract", "read_model_description", "supported_platforms"):
        monkeypatch.setattr(fmpy, name, reached)


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_fmu_is_refused_before_it_is_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], name: str
) -> None:
    make, words = HOSTILE[name]
    fmu = make(tmp_path / "hostile.fmu")
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))
    forbid_fmpy(monkeypatch)
    begun = time.perf_counter()
    arguments = ["simulate", str(ROBOT), "--speeds", str(SPEEDS), "--out", str(tmp_path / "out.csv")]
    assert run([*arguments, "--fmu", f"winch_2={fmu}"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert captured.err.startswith(f"tautwire: {fmu}: cannot be the FMU winch_2: it ")
    assert words in captured.err
    assert time.perf_counter() - begun < 60.0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["hostile.fmu", "scratch"]
    assert list(scratch.iterdir()) == []


@pytest.mark.parametrize("command", ["build", "fmus", "check"])
def test_so_is_one_that_the_robot_file_names(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, command: str
) -> None:
    with_entry("../evil")(tmp_path / "hostile.fmu")
    robot = tmp_path / "robot.toml"
    robot.write_text(ROBOT.read_text(encoding="utf-8") + '\n[fmu]\nplatform = "hostile.fmu"\n', encoding="utf-8")
    forbid_fmpy(monkeypatch)
    assert run([command, str(robot), *(["--out", str(tmp_path / "out")] if command == "build" else [])]) == 2
    captured = capsys.readouterr()
    assert "hostile.fmu" in captured.out + captured.err
    assert "leads out of the folder" in captured.out + captured.err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["hostile.fmu", "robot.toml"]


def test_the_master_refuses_it_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    fmu = with_entry("../evil")(tmp_path / "hostile.fmu")
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))
    for refuse in (read_model_description, lambda path: unpack(path, scratch), lambda path: Component("a", path)):
        with pytest.raises(ArchiveError, match="leads out"):
            refuse(fmu)
    assert list(scratch.iterdir()) == []
    with pytest.raises(ArchiveError, match="is not a file"):
        require_valid_archive(tmp_path)


def test_what_unpacking_leaves_when_the_disk_is_full_is_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fmu = packed(tmp_path / "sound.fmu", b"library")
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))

    def full(*arguments: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(fmpy, "extract", full)
    with pytest.raises(OSError, match="No space"):
        Component("a", fmu)
    assert list(scratch.iterdir()) == []


def test_sound_fmus_pass(tmp_path: Path, three_fmus: RobotFmus) -> None:
    for path in (*three_fmus.paths, packed(tmp_path / "a.fmu", b"library")):
        require_valid_archive(path, check_contents=True)
    tight = tmp_path / "tight.fmu"
    with zipfile.ZipFile(packed(tight, b"library"), "a", zipfile.ZIP_DEFLATED) as content:
        content.writestr("resources/", b"")
        content.writestr("resources/Prüfung (1)/table.csv", bytes(2**23))
    require_valid_archive(tight, check_contents=True)
