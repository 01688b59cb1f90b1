"""Makes FMUs that run in importers that are not Python processes.

pythonfmu's wrapper has undefined symbols of libpython, which only a Python process resolves. Here a library of our own
takes the wrapper's name inside the FMU and the wrapper lies beside it. On loading, ours opens and starts libpython
where the process has no Python, and then loads the wrapper; ``c_hosts.c`` tells how.

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

from ..errors import TautwireError, one_line
from ..master.archive import require_sound
from ..output import file_in_place

BINARIES = "binaries/linux64/"
LIBRARY = ".so"
WRAPPER = ".pythonfmu.so"
COMPILERS = ("cc", "gcc", "clang")
FLAGS = ("-std=gnu11", "-O2", "-fPIC", "-shared", "-s", "-fvisibility=hidden")
GET_A_COMPILER = "install a C compiler (Debian: sudo apt install gcc), or name one in the environment variable CC"
GET_A_LIBPYTHON = (
    "build the FMUs with a Python that has one: from uv, conda or python.org, from pyenv with "
    "PYTHON_CONFIGURE_OPTS=--enable-shared, or the system's (Debian: sudo apt install python3-dev)"
)


class CHostError(TautwireError):
    """FMUs for C hosts cannot be made here or from this file: ``problem`` says why, ``mend`` what to do."""

    def __init__(self, problem: str, mend: str) -> None:
        super().__init__(problem, mend)
        self.problem = problem
        self.mend = mend

    def __str__(self) -> str:
        return one_line(f"{self.problem}; {self.mend}")


@dataclass(frozen=True)
class EmbeddablePython:
    """What a process needs to run the Python at hand inside itself.

    ``library`` is libpython, ``home`` what PYTHONHOME would be, ``standard_library`` the folder that tells that the
    home is still there, ``headers`` the folder of ``Python.h``.
    """

    library: Path
    home: str
    standard_library: Path
    headers: Path


def make_for_c_hosts(fmu: Path) -> None:
    """Rewrite an FMU that pythonfmu built so that it also runs where there is no Python process.

    All other members keep their bytes. An FMU that is for C hosts already is made anew for the Python at hand, with
    the same bytes where that is the same Python.

    Raises CHostError where the FMU is none of pythonfmu's, or Python or the machine lacks something, ArchiveError where
    it is no sound archive.
    """
    library = _compiled(embeddable_python(), find_compiler())
    own, kept = _members(fmu)
    require_sound(fmu)
    with zipfile.ZipFile(fmu) as archive, file_in_place(fmu) as scratch:
        wrapper = archive.read(kept if kept in archive.namelist() else own)
        with zipfile.ZipFile(scratch, "w") as rewritten:
            for member in archive.infolist():
                if member.filename == own:
                    rewritten.writestr(copy(member), library)
                    rewritten.writestr(_renamed(member, kept), wrapper)
                elif member.filename != kept:
                    rewritten.writestr(copy(member), archive.read(member))
        shutil.copymode(fmu, scratch)


def embeddable_python() -> EmbeddablePython:
    """The Python that runs this, as a C host can embed it.

    Raises CHostError where the system is not Linux on x86-64, or Python comes without libpython or headers.
    """
    if (platform.system(), platform.machine()) != ("Linux", "x86_64"):
        raise CHostError(
            f"FMUs for C hosts are made on Linux on x86-64 only, and this is {platform.system()} on "
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
    return EmbeddablePython(_libpython(), ":".join(prefixes), Path(sysconfig.get_path("stdlib")), headers)


def find_compiler() -> tuple[str, ...]:
    """The command of the C compiler: that of the environment variable CC, else the first on the path.

    Raises CHostError where there is none.
    """
    named = shlex.split(os.environ.get("CC", ""))
    for command in [named] if named else [[name] for name in COMPILERS]:
        if shutil.which(command[0]) is not None:
            return tuple(command)
    tried = f"{shlex.join(named)} (from CC)" if named else ", ".join(COMPILERS)
    raise CHostError(f"FMUs for C hosts need a C compiler on the machine that builds them: no {tried}", GET_A_COMPILER)


def _libpython() -> Path:
    version = sysconfig.get_config_var("LDVERSION") or sysconfig.get_python_version()
    names = (sysconfig.get_config_var("INSTSONAME"), f"libpython{version}.so.1.0", f"libpython{version}.so")
    base = Path(sys.base_exec_prefix)
    for folder in (sysconfig.get_config_var("LIBDIR"), base / "lib", base / "lib64"):
        for name in names:
            if folder and name and ".so" in name and (Path(folder) / name).is_file():
                return Path(folder) / name
    how = "was built without" if not sysconfig.get_config_var("Py_ENABLE_SHARED") else "lacks"
    raise CHostError(f"the Python in {sys.base_prefix} {how} a shared libpython, which a C host loads", GET_A_LIBPYTHON)


def _members(fmu: Path) -> tuple[str, str]:
    """The member that importers load, and the one that the wrapper lies in."""
    members: list[str] = []
    if zipfile.is_zipfile(fmu):
        with zipfile.ZipFile(fmu) as archive:
            members = archive.namelist()
    libraries = [name for name in members if name.startswith(BINARIES) and name.endswith(LIBRARY)]
    own = [name for name in libraries if not name.endswith(WRAPPER)]
    if len(own) != 1 or "resources/slavemodule.txt" not in members:
        raise CHostError(f"{fmu} is not an FMU that pythonfmu built", "give one that tautwire build wrote")
    return own[0], own[0][: -len(LIBRARY)] + WRAPPER


def _renamed(member: zipfile.ZipInfo, name: str) -> zipfile.ZipInfo:
    renamed = copy(member)
    renamed.filename = name
    return renamed


@lru_cache
def _compiled(python: EmbeddablePython, compiler: tuple[str, ...]) -> bytes:
    defined = {
        "PYTHON_LIBRARY": str(python.library),
        "PYTHON_SONAME": _shared_name(python.library),
        "PYTHON_HOME": python.home,
        "PYTHON_PROGRAM": f"{python.home.split(':')[0]}/bin/python3",
        "STANDARD_LIBRARY": str(python.standard_library),
    }
    with tempfile.TemporaryDirectory(prefix="tautwire-build-") as scratch:
        result = Path(scratch) / "library.so"
        given = [f"-D{name}={_c_string(text)}" for name, text in defined.items()]
        command = [*compiler, *FLAGS, *given, f"-I{python.headers}", "-x", "c", "-", "-o", str(result), "-ldl"]
        source = files(__package__).joinpath("c_hosts.c").read_bytes()
        done = subprocess.run(command, input=source, capture_output=True, check=False)
        if done.returncode != 0 or not result.is_file():
            said = [line for line in done.stderr.decode(errors="replace").splitlines() if "error" in line]
            why = said[0] if said else f"exit status {done.returncode}"
            raise CHostError(f"{shlex.join(compiler)} cannot compile the C part of the FMUs: {why}", GET_A_COMPILER)
        return result.read_bytes()


def _shared_name(library: Path) -> str:
    """The name by which the loader finds the library on a machine that has it elsewhere."""
    return library.name if library.name.endswith(".1.0") else f"{library.name}.1.0"


def _c_string(text: str) -> str:
    octal = "".join(f"\\{byte:03o}" for byte in os.fsencode(text))
    return f'"{octal}"'
