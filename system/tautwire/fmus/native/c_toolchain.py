"""Compilation of native FMUs: by ziglang for every platform, else by the system's C compiler for this machine.

Machine code is kept by the content that it was compiled from, see :mod:`tautwire.machine_code_cache`.
"""

from __future__ import annotations

import importlib.util
import json
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import fmpy

from ...errors import ArgumentError, ToolchainError
from ...machine_code_cache import cached_machine_code
from ..c_hosts import CHostError, find_compiler
from .component_sources import CODE_FILE, ENTRY_FILE, START_FILE

# No contraction to fused operations, so that all compilers round alike; nothing visible but the functions of FMI. Zig
# would add debug information by itself, which linking strips.
COMPILER_FLAGS = ("-std=c99", "-O2", "-g0", "-ffp-contract=off", "-fPIC", "-fvisibility=hidden", "-w")
# The FMI standard's own header files, as fmpy has them.
HEADERS = Path(fmpy.__file__).parent / "c-code"
ZIG_HINT = 'pip install "tautwire[native]"'
WINDOWS_RUNTIME, WINDOWS_IMPORTS, IMPORT_LIBRARY = "windows_runtime.c", "ucrtbase.def", "ucrtbase.lib"
WINDOWS_LINK_FLAGS = ("-nostdlib", WINDOWS_RUNTIME, IMPORT_LIBRARY, "-Wl,-e,DllMainCRTStartup")


@dataclass(frozen=True)
class TargetPlatform:
    """A platform: the target of ziglang, and how its libraries are linked.

    ``name`` is the folder of its libraries in an archive of FMI 2.0, ``tuple_name`` in one of FMI 3.0.
    """

    name: str
    tuple_name: str
    target: str
    suffix: str
    link_flags: tuple[str, ...] = ("-lm",)

    @property
    def is_windows(self) -> bool:
        """Whether libraries get a runtime of their own: that of ziglang takes minutes to compile."""
        return self.suffix == ".dll"


PLATFORMS: Mapping[str, TargetPlatform] = {
    platform.name: platform
    for platform in (
        TargetPlatform("linux64", "x86_64-linux", "x86_64-linux-gnu.2.17", ".so"),
        TargetPlatform("win64", "x86_64-windows", "x86_64-windows-gnu", ".dll", WINDOWS_LINK_FLAGS),
        TargetPlatform("darwin64", "x86_64-darwin", "x86_64-macos.11.0", ".dylib"),
        TargetPlatform("aarch64-linux", "aarch64-linux", "aarch64-linux-gnu.2.17", ".so"),
        TargetPlatform("aarch64-darwin", "aarch64-darwin", "aarch64-macos.11.0", ".dylib"),
    )
}
THIS_PLATFORM = fmpy.platform


class NativeBuildError(ToolchainError):
    """Native FMUs cannot be compiled here."""


@dataclass(frozen=True)
class Toolchain:
    """A C compiler: its command, its version, and whether it compiles for all platforms."""

    command: tuple[str, ...]
    version: str
    is_cross_compiler: bool

    def command_for(self, platform: TargetPlatform) -> tuple[str, ...]:
        """Command that compiles for a platform."""
        return (*self.command, "-target", platform.target) if self.is_cross_compiler else self.command


@cache
def find_toolchain() -> Toolchain:
    """Ziglang where it is installed, else the system's compiler; NativeBuildError where there is neither."""
    package = importlib.util.find_spec("ziglang")
    if package is not None and package.origin is not None:
        zig = str(Path(package.origin).parent / "zig")
        return Toolchain((zig, "cc"), f"zig {_output([zig, 'version'])}", is_cross_compiler=True)
    try:
        command = find_compiler()
    except CHostError as error:
        raise NativeBuildError("native FMUs need a C compiler, and there is none", ZIG_HINT) from error
    return Toolchain(command, _output([*command, "--version"]), is_cross_compiler=False)


def target_platforms(names: Sequence[str], toolchain: Toolchain) -> tuple[TargetPlatform, ...]:
    """Platforms by name; none is this machine's, and ``all`` is every one.

    Raises ArgumentError where a name is unknown, NativeBuildError where the compiler cannot compile for it.
    """
    wanted = [THIS_PLATFORM] if not names else list(PLATFORMS) if "all" in names else list(dict.fromkeys(names))
    for name in wanted:
        if name not in PLATFORMS:
            raise ArgumentError(
                "build_fmus: platforms", names, f"{name!r} is none", f"name some of {', '.join(PLATFORMS)}, or all"
            )
        if name != THIS_PLATFORM and not toolchain.is_cross_compiler:
            raise NativeBuildError(f"{toolchain.command[0]} does not compile for {name}", ZIG_HINT)
    return tuple(PLATFORMS[name] for name in wanted)


def compile_library(sources: Mapping[str, str], platform: TargetPlatform, toolchain: Toolchain) -> bytes:
    """Shared library of a component's C files for a platform.

    Everything but the start values is compiled once for all components of the same structure. Raises NativeBuildError
    where the compiler refuses.
    """
    command = toolchain.command_for(platform)
    shared = {name: text for name, text in sources.items() if name not in (START_FILE, ENTRY_FILE)}
    runtime = _windows_runtime() if platform.is_windows else {}
    origin = [toolchain.version, command, COMPILER_FLAGS, platform.link_flags, runtime]

    def compile_code() -> bytes:
        return _run([*command, *COMPILER_FLAGS, f"-I{HEADERS}", "-c", CODE_FILE], shared)

    def link() -> bytes:
        code = cached_machine_code(_key("object", origin, shared), compile_code)
        objects: dict[str, Any] = {"code.o": code, START_FILE: sources[START_FILE], **runtime}
        if runtime:
            objects[IMPORT_LIBRARY] = _import_library(toolchain, runtime)
        flags = (*COMPILER_FLAGS, "-s", "-shared")
        return _run([*command, *flags, START_FILE, "code.o", *platform.link_flags], objects)

    return cached_machine_code(_key("library", origin, sources), link)


def _windows_runtime() -> dict[str, str]:
    names = (WINDOWS_RUNTIME, WINDOWS_IMPORTS)
    return {name: files(__package__).joinpath(f"c/{name}").read_text(encoding="utf-8") for name in names}


def _import_library(toolchain: Toolchain, runtime: Mapping[str, str]) -> bytes:
    return _run([toolchain.command[0], "dlltool", "-m", "i386:x86-64", "-d", WINDOWS_IMPORTS], runtime, "-l")


def _key(kind: str, origin: Sequence[object], sources: Mapping[str, str]) -> bytes:
    return json.dumps([kind, origin, dict(sources)], sort_keys=True).encode()


def _run(command: Sequence[str], sources: Mapping[str, Any], output_option: str = "-o") -> bytes:
    """What a compiler writes from files, each text or bytes, in a folder of their own."""
    with tempfile.TemporaryDirectory(prefix="tautwire-build-") as scratch:
        for name, content in sources.items():
            (Path(scratch) / name).write_bytes(content.encode() if isinstance(content, str) else content)
        output = Path(scratch) / "output"
        completed = subprocess.run(
            [*command, output_option, str(output)], cwd=scratch, capture_output=True, check=False
        )
        if completed.returncode != 0 or not output.is_file():
            lines = completed.stderr.decode(errors="replace").splitlines()
            reason = next((line for line in lines if "error" in line), f"exit status {completed.returncode}")
            raise NativeBuildError(f"{command[0]} cannot compile the FMU: {reason}", "report this as a bug")
        return output.read_bytes()


def _output(command: Sequence[str]) -> str:
    return subprocess.run(command, capture_output=True, check=False).stdout.decode(errors="replace").strip()
