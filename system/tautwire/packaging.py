"""Builds the FMUs of a robot: one a cable, one for the platform, with their values inside."""

from __future__ import annotations

import hashlib
import json
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from uuid import NAMESPACE_URL, uuid5

from pythonfmu.builder import FmuBuilder

import tautwire_fmu

from .robot import EffectSetting, Robot
from .statics import directions, static_tensions

# pythonfmu 0.7.0 runs the script at every instantiation and then gives up a reference to its globals that it does
# not own; without the one taken here the second instance finds an empty module.
LAUNCHER = """import ctypes

from {package}.slaves import {base}

ctypes.pythonapi.Py_IncRef(ctypes.py_object(globals()))
"""
OPTIONS = {
    "needsExecutionTool": False,
    "canGetAndSetFMUstate": True,
    "canSerializeFMUstate": True,
    "canInterpolateInputs": False,
}


@dataclass(frozen=True)
class RobotFmus:
    """Where the FMUs of a robot lie: one path a cable in the robot file's order, and the platform's."""

    cables: tuple[Path, ...]
    platform: Path


def build_fmus(robot: Robot, folder: Path) -> RobotFmus:
    """Write ``cable_1.fmu`` ... ``cable_n.fmu`` and ``platform.fmu`` into ``folder``.

    FMI 2.0 co-simulation; what a component is lies inside as a JSON resource.
    """
    folder.mkdir(parents=True, exist_ok=True)
    cables = tuple(
        _build("cable", "Cable", f"cable_{index}", data, folder)
        for index, data in enumerate(cable_data(robot), start=1)
    )
    platform = _build("point_mass", "PointMass", "platform", platform_data(robot), folder)
    return RobotFmus(cables, platform)


def cable_data(robot: Robot) -> list[dict[str, Any]]:
    """What each cable FMU carries as ``cable.json``."""
    tensions = static_tensions(robot)
    start = robot.platform.start
    return [
        {
            "description": f"cable {index} of {robot.name}",
            "law": cable.law,
            "anchor": list(cable.anchor),
            "start": list(start),
            "start_length": sum((a - b) ** 2 for a, b in zip(cable.anchor, start, strict=True)) ** 0.5,
            "start_tension": float(tension),
            "modulus": cable.modulus,
            "area": cable.area,
            "damping": cable.damping,
            "effects": [_effect_data(s) for s in robot.effects_on_cable(index)],
        }
        for index, (cable, tension) in enumerate(zip(robot.cables, tensions, strict=True), start=1)
    ]


def platform_data(robot: Robot) -> dict[str, Any]:
    """What the platform FMU carries as ``point_mass.json``."""
    forces = (directions(robot) * static_tensions(robot)).T
    return {
        "description": f"platform of {robot.name}",
        "mass": robot.platform.mass,
        "gravity": robot.gravity,
        "start": list(robot.platform.start),
        "start_forces": forces.tolist(),
        "effects": [_effect_data(s) for s in robot.effects_elsewhere()],
    }


def _effect_data(setting: EffectSetting) -> dict[str, Any]:
    return {"name": setting.name, "values": dict(setting.values)}


def _build(module: str, base: str, name: str, data: dict[str, Any], folder: Path) -> Path:
    sources = Path(tautwire_fmu.__file__).parent
    package = f"tautwire_fmu_{_digest(sources)}"
    text = json.dumps(data | {"model_name": name}, sort_keys=True)
    guid = str(uuid5(NAMESPACE_URL, package + module + text))
    with tempfile.TemporaryDirectory(prefix="tautwire-build-") as scratch_name:
        scratch = Path(scratch_name)
        shutil.copytree(sources, scratch / package, ignore=shutil.ignore_patterns("__pycache__", "*.pyc"))
        resource = scratch / f"{module}.json"
        resource.write_text(json.dumps(data | {"model_name": name, "guid": guid}), encoding="utf-8")
        script = scratch / f"{name}_{guid.replace('-', '')[:12]}.py"
        script.write_text(LAUNCHER.format(package=package, base=base), encoding="utf-8")
        unfinished = scratch / "built" / f"{name}.fmu"
        with _imports_from(scratch):
            FmuBuilder.build_FMU(script, dest=unfinished, project_files=[scratch / package, resource], **OPTIONS)
        return _move(unfinished, folder / f"{name}.fmu")


def _digest(sources: Path) -> str:
    digest = hashlib.sha256()
    for path in sorted(sources.rglob("*.py")):
        digest.update(path.relative_to(sources).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


@contextmanager
def _imports_from(scratch: Path) -> Iterator[None]:
    """Let pythonfmu import the script, and leave neither its folder nor its module behind."""
    before = list(sys.path)
    modules = set(sys.modules)
    sys.path.insert(0, str(scratch))
    try:
        yield
    finally:
        sys.path[:] = before
        for name in set(sys.modules) - modules:
            origin = getattr(sys.modules[name], "__file__", None)
            if origin is not None and Path(origin).is_relative_to(scratch):
                del sys.modules[name]


def _move(built: Path, target: Path) -> Path:
    beside = target.with_name(f".{target.name}.partial")
    shutil.move(built, beside)
    beside.replace(target)
    return target
