"""Compilers of native FMUs."""

from __future__ import annotations

import importlib.util
import shutil
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from tautwire.errors import ArgumentError
from tautwire.fmus.native import c_toolchain, native_archive
from tautwire.fmus.native.c_toolchain import (
    PLATFORMS,
    THIS_PLATFORM,
    NativeBuildError,
    Toolchain,
    compile_library,
    target_platforms,
)
from tautwire.fmus.native.component_sources import EQUATIONS_FILE
from tautwire.fmus.packaging import build_fmus
from tautwire.machine_code_cache import CACHE_VARIABLE
from tests.support.effect_cases import CASES
from tests.support.effects import with_effects
from tests.support.native import both_runs, largest_difference
from tests.support.robots import LIMITED, example, gentle_speeds, with_winch

SYSTEM_COMPILER = Toolchain(("cc",), "cc", is_cross_compiler=False)
UNIVERSAL = b"\xca\xfe\xba\xbe"
MAGIC = {".so": b"\x7fELF", ".dll": b"MZ", ".dylib": b"\xcf\xfa\xed\xfe"}


def test_unknown_platforms_are_refused() -> None:
    with pytest.raises(ArgumentError, match=r"'amiga' is none.*linux64"):
        target_platforms(["linux64", "amiga"], SYSTEM_COMPILER)


def test_the_systems_compiler_compiles_for_this_platform_only() -> None:
    assert [platform.name for platform in target_platforms([], SYSTEM_COMPILER)] == [THIS_PLATFORM]
    other = next(name for name in PLATFORMS if name != THIS_PLATFORM)
    with pytest.raises(NativeBuildError, match=r"cc does not compile for .*ziglang|tautwire\[native\]"):
        target_platforms([other], SYSTEM_COMPILER)


def test_what_a_compiler_refuses_is_told_in_one_line() -> None:
    platform = PLATFORMS[THIS_PLATFORM]
    sources = {"code.c": "int x = ;", "start_values.c": "", "mark.c": str(Path(__file__))}
    with pytest.raises(NativeBuildError, match=r"cannot compile.*error") as caught:
        compile_library(sources, platform, SYSTEM_COMPILER)
    assert "\n" not in str(caught.value)


def test_cables_that_differ_in_numbers_alone_are_compiled_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compiled = []

    def run(command: Sequence[str], sources: Mapping[str, Any], *_: str) -> bytes:
        if "-c" in command:
            compiled.append(sources[EQUATIONS_FILE])
        return b"machine code"

    monkeypatch.setenv(CACHE_VARIABLE, str(tmp_path / "cache"))
    monkeypatch.setattr(c_toolchain, "_run", run)
    monkeypatch.setattr(native_archive, "find_toolchain", lambda: SYSTEM_COMPILER)
    cable, other = build_fmus(example("three"), tmp_path / "fmus", native=True).cables[1:]
    assert len({fmu.read_bytes() for fmu in (cable, other)}) == 2
    assert len(compiled) == 2 and compiled[0] != compiled[1]


@pytest.mark.validate
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_fmus_by_the_systems_compiler_run_as_those_of_python(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(native_archive, "find_toolchain", lambda: SYSTEM_COMPILER)
    robot = example("three")
    time, speed = gentle_speeds(robot, 0.2, 0.02)
    python, native = both_runs(robot, tmp_path, time, speed)
    assert largest_difference(python, native) < 1e-10


@pytest.mark.validate
@pytest.mark.skipif(importlib.util.find_spec("ziglang") is None, reason="no ziglang")
def test_one_archive_holds_all_platforms(tmp_path: Path) -> None:
    robot = with_winch(with_effects(example("three"), *CASES), LIMITED)
    fmus = build_fmus(robot, tmp_path, native=True, platforms=["all"])
    for path in fmus.paths:
        with zipfile.ZipFile(path) as archive:
            libraries = {name: archive.read(name) for name in archive.namelist() if name.startswith("binaries/")}
        assert [name.split("/")[1] for name in libraries] == list(PLATFORMS)
        assert b"KERNEL32" not in libraries[f"binaries/win64/{path.stem}.dll"]
        for name, content in libraries.items():
            assert content.startswith(UNIVERSAL if "darwin64" in name else MAGIC[Path(name).suffix])
