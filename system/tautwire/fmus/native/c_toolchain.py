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
from pathlib import Path
from typing import Any

import fmpy

from ...errors import ArgumentError, ToolchainError
from ...machine_code_cache import cached_machine_code
from ..c_hosts import CHostError, find_compiler
from .component_sources import CODE_FILE, START_FILE

# No contraction to fused operations, so that all compilers round alike; nothing visible but the functions of FMI.
COMPILER_FLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-fvisibility=hidden", "-w")
ZIG_HINT = 'pip install "tautwire[native]"'


@dataclass(frozen=True)
class TargetPlatform:
    """A platform: its folder among an FMU's binaries, the target of ziglang, the suffix of its libraries, and flags."""

    name: str
    target: str
    suffix: str
    link_flags: tuple[str, ...] = ("-lm",)


PLATFORMS: Mapping[str, TargetPlatform] = {
    platform.name: platform
    for platform in (
        TargetPlatform("linux64", "x86_64-linux-gnu.2.17", ".so"),
        TargetPlatform("win64", "x86_64-windows-gnu", ".dll", ()),
        TargetPlatform("darwin64", "x86_64-macos.11.0", ".dylib"),
        TargetPlatform("aarch64-linux", "aarch64-linux-gnu.2.17", ".so"),
        TargetPlatform("aarch64-darwin", "aarch64-macos.11.0", ".dylib"),
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
    shared = {name: text for name, text in sources.items() if name != START_FILE}
    origin = [toolchain.version, command, COMPILER_FLAGS, platform.link_flags]

    def compile_code() -> bytes:
        return _run(command, ["-c", CODE_FILE], shared)

    def link() -> bytes:
        code = cached_machine_code(_key("object", origin, shared), compile_code)
        objects = {"code.o": code, START_FILE: sources[START_FILE]}
        return _run(command, ["-shared", START_FILE, "code.o", *platform.link_flags], objects)

    return cached_machine_code(_key("library", origin, sources), link)


def _key(kind: str, origin: Sequence[object], sources: Mapping[str, str]) -> bytes:
    return json.dumps([kind, origin, dict(sources)], sort_keys=True).encode()


def _run(command: Sequence[str], arguments: Sequence[str], sources: Mapping[str, Any]) -> bytes:
    """What a compiler writes from files, each text or bytes, in a folder of their own."""
    with tempfile.TemporaryDirectory(prefix="tautwire-build-") as scratch:
        for name, content in sources.items():
            (Path(scratch) / name).write_bytes(content.encode() if isinstance(content, str) else content)
        output = Path(scratch) / "output"
        headers = Path(fmpy.__file__).parent / "c-code"
        complete = [*command, *COMPILER_FLAGS, f"-I{headers}", *arguments, "-o", str(output)]
        completed = subprocess.run(complete, cwd=scratch, capture_output=True, check=False)
        if completed.returncode != 0 or not output.is_file():
            lines = completed.stderr.decode(errors="replace").splitlines()
            reason = next((line for line in lines if "error" in line), f"exit status {completed.returncode}")
            raise NativeBuildError(f"{command[0]} cannot compile the FMU: {reason}", "report this as a bug")
        return output.read_bytes()


def _output(command: Sequence[str]) -> str:
    return subprocess.run(command, capture_output=True, check=False).stdout.decode(errors="replace").strip()
