"""FMUs for C hosts: importers that are not Python processes.

pythonfmu's wrapper has undefined symbols of libpython, which only a Python process resolves. Here a launcher library
takes the wrapper's name inside the FMU and the wrapper lies beside it. On loading, the launcher opens and starts
libpython where the process has no Python, and then loads the wrapper; see ``c_hosts.c``.

A wrapper with libpython among its needed libraries does not do: extension modules of the standard library such as
``_ctypes`` find no symbols where the importer loads with RTLD_LOCAL; the FMU fails to load where that libpython is
missing, even in Python; and the interpreter obeys the importer's PYTHONHOME and PYTHONPATH, and ends the process over
them.
"""

from __future__ import annotations

import os
import platform
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile
from copy import copy
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from pathlib import Path

from ..atomic_output import atomic_file
from ..errors import ToolchainError
from .fmu_archive import require_valid_archive

BINARIES = "binaries/linux64/"
LIBRARY_SUFFIX = ".so"
WRAPPER_SUFFIX = ".pythonfmu.so"
COMPILERS = ("cc", "gcc", "clang")
COMPILER_FLAGS = ("-std=gnu11", "-O2", "-fPIC", "-shared", "-s", "-fvisibility=hidden")
COMPILER_HINT = "install a C compiler (Debian: sudo apt install gcc), or name one in the environment variable CC"
LIBPYTHON_HINT = (
    "build the FMUs with a Python that has one: from uv, conda or python.org, from pyenv with "
    "PYTHON_CONFIGURE_OPTS=--enable-shared, or the system's (Debian: sudo apt install python3-dev)"
)


class CHostError(ToolchainError):
    """FMUs for C hosts cannot be built here or from this file."""


@dataclass(frozen=True)
class EmbeddablePython:
    """Files and folders that a process needs to embed the running Python.

    ``library`` is libpython, ``home`` the value of PYTHONHOME, ``standard_library`` the folder whose presence proves
    that home still exists, ``headers`` the folder of ``Python.h``.
    """

    library: Path
    home: str
    standard_library: Path
    headers: Path


def make_for_c_hosts(fmu: Path) -> None:
    """Rewrite an FMU that pythonfmu built so that it also runs where there is no Python process.

    All other members keep their bytes. An FMU that is for C hosts already is rebuilt for the running Python, with
    the same bytes where that is the same Python.

    Raises CHostError where the FMU was not built by pythonfmu, or Python or the machine lacks something, ArchiveError
    where it is no sound archive.
    """
    library_bytes = _compiled_library(embeddable_python(), find_compiler())
    loaded_member, wrapper_member = _library_members(fmu)
    require_valid_archive(fmu)
    with zipfile.ZipFile(fmu) as archive, atomic_file(fmu) as scratch:
        wrapper_bytes = archive.read(wrapper_member if wrapper_member in archive.namelist() else loaded_member)
        with zipfile.ZipFile(scratch, "w") as rewritten:
            for member in archive.infolist():
                if member.filename == loaded_member:
                    rewritten.writestr(copy(member), library_bytes)
                    rewritten.writestr(_renamed(member, wrapper_member), wrapper_bytes)
                elif member.filename != wrapper_member:
                    rewritten.writestr(copy(member), archive.read(member))
        shutil.copymode(fmu, scratch)


def embeddable_python() -> EmbeddablePython:
    """Locate the running Python as a C host can embed it.

    Raises CHostError where the system is not Linux on x86-64, or Python comes without libpython or headers.
    """
    if (platform.system(), platform.machine()) != ("Linux", "x86_64"):
        raise CHostError(
            f"FMUs for C hosts can be built on Linux on x86-64 only, and this is {platform.system()} on "
            f"{platform.machine()}",
            "build there, or without --for-c-hosts",
        )
    headers = Path(sysconfig.get_path("include"))
    if not (headers / "Python.h").is_file():
        raise CHostError(
            f"{headers / 'Python.h'} is missing, which the C part of the FMUs is compiled with",
            "install Python's headers (Debian: sudo apt install python3-dev)",
        )
    prefixes = dict.fromkeys((sys.base_prefix, sys.base_exec_prefix))
    return EmbeddablePython(_find_libpython(), ":".join(prefixes), Path(sysconfig.get_path("stdlib")), headers)


def find_compiler() -> tuple[str, ...]:
    """Command of the C compiler: that of the environment variable CC, else the first on the path.

    Raises CHostError where there is none.
    """
    compiler_from_environment = shlex.split(os.environ.get("CC", ""))
    for command in [compiler_from_environment] if compiler_from_environment else [[name] for name in COMPILERS]:
        if shutil.which(command[0]) is not None:
            return tuple(command)
    candidates = (
        f"{shlex.join(compiler_from_environment)} (from CC)" if compiler_from_environment else ", ".join(COMPILERS)
    )
    raise CHostError(
        f"FMUs for C hosts need a C compiler on the machine that builds them: no {candidates}", COMPILER_HINT
    )


def _find_libpython() -> Path:
    version = sysconfig.get_config_var("LDVERSION") or sysconfig.get_python_version()
    names = (sysconfig.get_config_var("INSTSONAME"), f"libpython{version}.so.1.0", f"libpython{version}.so")
    base = Path(sys.base_exec_prefix)
    for folder in (sysconfig.get_config_var("LIBDIR"), base / "lib", base / "lib64"):
        for name in names:
            if folder and name and ".so" in name and (Path(folder) / name).is_file():
                return Path(folder) / name
    how = "was built without" if not sysconfig.get_config_var("Py_ENABLE_SHARED") else "lacks"
    raise CHostError(f"the Python in {sys.base_prefix} {how} a shared libpython, which a C host loads", LIBPYTHON_HINT)


def _library_members(fmu: Path) -> tuple[str, str]:
    """Archive members: the library that importers load, and that of the wrapper."""
    members: list[str] = []
    if zipfile.is_zipfile(fmu):
        with zipfile.ZipFile(fmu) as archive:
            members = archive.namelist()
    libraries = [name for name in members if name.startswith(BINARIES) and name.endswith(LIBRARY_SUFFIX)]
    loaded_members = [name for name in libraries if not name.endswith(WRAPPER_SUFFIX)]
    if len(loaded_members) != 1 or "resources/slavemodule.txt" not in members:
        raise CHostError(f"{fmu} is not an FMU that pythonfmu built", "give one that tautwire build wrote")
    return loaded_members[0], loaded_members[0][: -len(LIBRARY_SUFFIX)] + WRAPPER_SUFFIX


def _renamed(member: zipfile.ZipInfo, name: str) -> zipfile.ZipInfo:
    renamed = copy(member)
    renamed.filename = name
    return renamed


@lru_cache
def _compiled_library(python: EmbeddablePython, compiler: tuple[str, ...]) -> bytes:
    macros = {
        "PYTHON_LIBRARY": str(python.library),
        "PYTHON_SONAME": _soname(python.library),
        "PYTHON_HOME": python.home,
        "PYTHON_PROGRAM": f"{python.home.split(':')[0]}/bin/python3",
        "STANDARD_LIBRARY": str(python.standard_library),
    }
    with tempfile.TemporaryDirectory(prefix="tautwire-build-") as scratch:
        library_file = Path(scratch) / "library.so"
        macro_flags = [f"-D{name}={_c_string(text)}" for name, text in macros.items()]
        command = [
            *compiler,
            *COMPILER_FLAGS,
            *macro_flags,
            f"-I{python.headers}",
            "-x",
            "c",
            "-",
            "-o",
            str(library_file),
            "-ldl",
        ]
        source = files(__package__).joinpath("c_hosts.c").read_bytes()
        completed = subprocess.run(command, input=source, capture_output=True, check=False)
        if completed.returncode != 0 or not library_file.is_file():
            error_lines = [line for line in completed.stderr.decode(errors="replace").splitlines() if "error" in line]
            reason = error_lines[0] if error_lines else f"exit status {completed.returncode}"
            raise CHostError(f"{shlex.join(compiler)} cannot compile the C part of the FMUs: {reason}", COMPILER_HINT)
        return library_file.read_bytes()


def _soname(library: Path) -> str:
    """Shared-object name (soname) by which the loader finds the library on another machine."""
    return library.name if library.name.endswith(".1.0") else f"{library.name}.1.0"


def _c_string(text: str) -> str:
    octal = "".join(f"\\{byte:03o}" for byte in os.fsencode(text))
    return f'"{octal}"'
