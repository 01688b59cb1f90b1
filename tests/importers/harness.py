"""Sets the run up, makes each importer's environment, and runs its client there.

Environments are kept in the folder that TAUTWIRE_IMPORTERS names, by default ``.venv-importers`` of the checkout.
"""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from tautwire.cosimulation.robot_wiring import PLATFORM, cable_name, robot_connections
from tautwire.cosimulation.ssp_archive import COMPONENTS_ONLY, SYSTEM_STRUCTURE, ssp_name, write_ssp
from tautwire.fmus.packaging import build_fmus
from tautwire.robot.reference_simulation import integrate
from tautwire.robot.schema import AXES, Robot
from tests.support.pythonfmu_command import build_by_command

from .ramps import LIMIT, RAMP, STOP

HERE = Path(__file__).parent
CACHE = Path(os.environ.get("TAUTWIRE_IMPORTERS") or HERE.parents[1] / ".venv-importers")
INSTALLING = 1200.0
RUNNING = 600.0


class NotInstallableError(Exception):
    """pip could not install an importer; the text tells why."""


class ClientError(Exception):
    """A client failed; the text is the end of what it wrote."""


@dataclass(frozen=True)
class Importer:
    """A client, what pip installs for it, and the errors in mm within which it stays, by macro step in s."""

    label: str
    client: str
    requirements: tuple[str, ...]
    bounds: Mapping[float, float]


BOUNDS = {0.01: 0.5, 0.001: 0.01}
FMPY = ("fmpy==0.3.32",)
LIBCOSIM = ("libcosimpy==0.0.6",)
ECOS = ("ecospy==0.7.2", "tbb")
COFMUPY = ("cofmupy==1.0.0",)
CONTAINER = ("fmu_manipulation_toolbox==2.0", "fmpy==0.3.32")
IMPORTERS = (
    Importer("fmpy by hand", "by_fmpy.py", FMPY, BOUNDS),
    Importer("fmpy by hand, in turn, stamped", "by_fmpy_in_turn.py", FMPY, BOUNDS),
    Importer("fmpy SSP, start values given", "by_fmpy_ssp.py", FMPY, BOUNDS),
    Importer("fmpy SSP as it is", "by_fmpy_ssp_as_it_is.py", FMPY, {0.01: np.inf, 0.001: np.inf}),
    Importer("libcosimpy", "by_libcosimpy.py", LIBCOSIM, BOUNDS),
    Importer("libcosimpy, SSP", "by_libcosimpy_ssp.py", LIBCOSIM, BOUNDS),
    Importer("ecospy", "by_ecospy.py", ECOS, BOUNDS),
    Importer("ecospy, SSP", "by_ecospy_ssp.py", ECOS, BOUNDS),
    Importer("CoFmuPy", "by_cofmupy.py", COFMUPY, BOUNDS),
    Importer("FMU container in fmpy", "by_container.py", CONTAINER, BOUNDS),
    Importer("FMU container made of the SSP, in fmpy", "by_container_ssp.py", CONTAINER, BOUNDS),
)


def prepare(robot: Robot, folder: Path, native: bool = False) -> None:
    """Write FMUs, driver, archive and ``run.json`` into ``folder``; the driver is of Python even beside native FMUs."""
    fmus = build_fmus(robot, folder, native=native)
    files = {PLATFORM: fmus.platform.name}
    files |= {cable_name(number): path.name for number, path in enumerate(fmus.cables, start=1)}
    wires = [
        [wire.source.component, wire.source.variable, wire.target.component, wire.target.variable]
        for wire in robot_connections(robot.cable_count)
    ]
    for number in robot.cable_numbers:
        wires += [
            ["driver", f"{name}_{number}", cable_name(number), name] for name in ("winch_speed", "winch_acceleration")
        ]
    archive = write_ssp(robot, fmus, folder / ssp_name(robot))
    run = {
        "files": {"driver": _build_driver(folder).name} | files,
        "connections": wires,
        "shown": PLATFORM,
        "position": [f"position.{axis}" for axis in AXES],
        "stop": STOP,
        "archive": archive.name,
        "components_only": _unpack(archive, folder / "components_only").name,
    }
    (folder / "run.json").write_text(json.dumps(run, indent=2), encoding="utf-8")


def _build_driver(folder: Path) -> Path:
    return build_by_command(HERE / "driver.py", folder / "driver.fmu", HERE / "ramps.py")


def _unpack(archive: Path, folder: Path) -> Path:
    """The archive's files with the structure that has no system connectors in the default's place."""
    with zipfile.ZipFile(archive) as packed:
        packed.extractall(folder)
    (folder / COMPONENTS_ONLY).replace(folder / SYSTEM_STRUCTURE)
    return folder


def exact_end(robot: Robot) -> np.ndarray:
    """Where the platform is at the end of the run, in m, by the robot as one model."""
    corners = np.unique([0.0, *(LIMIT / abs(rate) for rate in RAMP), STOP])
    speeds = np.clip(np.array(RAMP) * corners[:, None], -LIMIT, LIMIT)
    return integrate(robot, corners, speeds, 1e-12, 1e-13).position[-1]


def run_client(importer: Importer, folder: Path, step: float) -> dict[str, Any]:
    """Run a client over the prepared ``folder``; returns what it wrote.

    Raises NotInstallableError where its environment cannot be made and ClientError where it fails.
    """
    python = environment(importer.requirements)
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch) / "out.json"
        # Importers leave extracted FMUs behind: in a folder that goes.
        libraries = [str(python.parents[1] / "lib"), *filter(None, [os.environ.get("LD_LIBRARY_PATH")])]
        own = dict(os.environ) | {"TMPDIR": scratch, "LD_LIBRARY_PATH": os.pathsep.join(libraries)}
        own.pop("PYTHONPATH", None)
        _run([str(python), str(HERE / importer.client), str(folder), str(step), str(out)], own, RUNNING)
        result: dict[str, Any] = json.loads(out.read_text(encoding="utf-8"))
    return result


def environment(requirements: tuple[str, ...]) -> Path:
    """The Python of a virtual environment with these packages, made on first use and kept.

    Raises NotInstallableError.
    """
    made = _made(requirements)
    if isinstance(made, NotInstallableError):
        raise made
    return made


@cache
def _made(requirements: tuple[str, ...]) -> Path | NotInstallableError:
    """A failure is kept as well: pip takes its time to find out that there is no network."""
    version = f"{sys.implementation.name}{sys.version_info.major}.{sys.version_info.minor}"
    digest = hashlib.sha256(" ".join((version, *requirements)).encode()).hexdigest()[:8]
    place = CACHE / f"{requirements[0].partition('=')[0]}-{version}-{digest}"
    python = Path("bin") / "python"
    if not (place / python).exists():
        CACHE.mkdir(parents=True, exist_ok=True)
        scratch = Path(tempfile.mkdtemp(prefix=".making-", dir=CACHE))
        try:
            _install(scratch / "venv", python, requirements)
            _settle(scratch / "venv", place)
        except NotInstallableError as error:
            return error
        finally:
            shutil.rmtree(scratch, ignore_errors=True)
    return place / python


def _install(venv: Path, python: Path, requirements: tuple[str, ...]) -> None:
    try:
        # A pip of its own and bytecode of modules that are never imported would take most of the time.
        pip = [sys.executable, "-m", "pip", "--python", str(venv / python), "install", "--quiet", "--no-compile"]
        _run([sys.executable, "-m", "venv", "--without-pip", str(venv)], dict(os.environ), INSTALLING)
        _run([*pip, *requirements], dict(os.environ), INSTALLING)
    except (ClientError, subprocess.TimeoutExpired) as error:
        raise NotInstallableError(f"pip install {' '.join(requirements)}: {error}") from error


def _settle(venv: Path, place: Path) -> None:
    """Rename into place; a test process beside this one may have been faster."""
    try:
        venv.rename(place)
    except OSError:
        if not place.exists():
            raise


def _run(command: list[str], variables: dict[str, str], seconds: float) -> None:
    done = subprocess.run(command, env=variables, capture_output=True, text=True, timeout=seconds, check=False)
    if done.returncode:
        raise ClientError(f"exit code {done.returncode}: {(done.stdout + done.stderr)[-1500:]}")
