"""Builds the FMUs of a robot: one a cable, one a winch, one for the platform, with their values inside."""

from __future__ import annotations

import hashlib
import itertools
import json
import shutil
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any
from uuid import NAMESPACE_URL, uuid5

import tautwire_fmu
from tautwire_fmu.laws.effects import BY_NAME
from tautwire_fmu.laws.winch_drive import NO_LIMIT

from ..arguments import callable_or_none, folder_of, robot_of
from ..interrupt import interrupts_held
from ..model.assembly import assemble
from ..robots.robot import EffectSetting, Robot
from ..statics.equilibrium import formula_texts, has_sensor_effects, platform_settings, static_forces, static_tensions
from .builder import builder
from .slots import check_own_fmus
from .wrapper import mend_exit

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
    """Where the FMUs of a robot lie: one path a cable in the robot file's order, the platform's, and the winches'.

    A winch is None where rope runs at the speed asked for. ``own`` are the slots with FMUs of the user's; each is to
    start with these values, by the names of our parameters. ``measured`` tells that the platform also shows its
    position as its sensor does. ``settings`` are parameters that our own are to start with in place of what they hold,
    by component; names that are no parameter of it are passed over.
    """

    cables: tuple[Path, ...]
    platform: Path
    winches: tuple[Path | None, ...] = ()
    own: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    measured: bool = False
    settings: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    @property
    def parts(self) -> dict[str, Path]:
        """All FMUs by the names of their components: platform, winches, and the cables, which wait for both."""
        cables = {f"cable_{index}": path for index, path in enumerate(self.cables, start=1)}
        winches = {f"winch_{index}": path for index, path in enumerate(self.winches, start=1) if path is not None}
        return {"platform": self.platform} | winches | cables

    @property
    def paths(self) -> tuple[Path, ...]:
        """All FMUs, those of the cables first."""
        return (*self.cables, self.platform, *(path for path in self.winches if path is not None))

    @property
    def winch_numbers(self) -> tuple[int, ...]:
        """The cables, counted from 1, that have a winch."""
        return tuple(index for index, path in enumerate(self.winches, start=1) if path is not None)


def build_fmus(robot: Robot, folder: str | Path, progress: Callable[[float], None] | None = None) -> RobotFmus:
    """Write ``platform.fmu``, ``cable_1.fmu`` ... and, where there are winches, ``winch_1.fmu`` ... into ``folder``.

    FMI 2.0 co-simulation; what a component is lies inside as a JSON resource. FMUs of the user's stay where they are.
    The folder is made if absent, and has to stay while the FMUs are run. ``progress`` gets the share that is done, from
    0 to 1. Returns where the FMUs lie.

    Raises SlotError where an FMU of the user's does not fit, UnreachableError where the cables cannot hold the
    platform at the start, ArgumentError where an argument is none of these, OSError where the disk refuses.
    """
    robot_of("build_fmus: robot", robot)
    folder = folder_of("build_fmus: folder", folder)
    callable_or_none("build_fmus: progress", progress)
    check_own_fmus(robot)
    folder.mkdir(parents=True, exist_ok=True)
    own = {fmu.slot: fmu.path for fmu in robot.fmus}
    count, done = 1 + robot.cable_count + len(robot.winch_numbers), itertools.count(1)

    def made(module: str, base: str, name: str, data: dict[str, Any]) -> Path:
        path = own[name] if name in own else _build(module, base, name, data, folder)
        if progress is not None:
            progress(next(done) / count)
        return path

    return RobotFmus(
        cables=tuple(made("cable", "Cable", f"cable_{i}", data) for i, data in enumerate(cable_data(robot), start=1)),
        platform=made("point_mass", "PointMass", "platform", platform_data(robot)),
        winches=tuple(
            made("winch", "Winch", f"winch_{i}", winch_data(robot, i)) if i in robot.winch_numbers else None
            for i in robot.cable_numbers
        ),
        own={slot: start_values(robot, slot) for slot in own},
        measured="platform" not in own and has_sensor_effects(robot),
    )


def build_controller(data: dict[str, Any], folder: Path) -> Path:
    """Write ``controller.fmu`` into ``folder``; ``data`` is what it carries as ``controller.json``."""
    folder.mkdir(parents=True, exist_ok=True)
    return _build("controller", "Controller", "controller", data, folder)


def gathered(fmus: RobotFmus, folder: Path) -> RobotFmus:
    """The same FMUs with copies in ``folder`` of those of the user's, named as their slots."""
    copies = {slot: _copy(fmus.parts[slot], folder / f"{slot}.fmu") for slot in fmus.own}
    return replace(
        fmus,
        cables=tuple(copies.get(f"cable_{i}", path) for i, path in enumerate(fmus.cables, start=1)),
        platform=copies.get("platform", fmus.platform),
        winches=tuple(copies.get(f"winch_{i}", path) for i, path in enumerate(fmus.winches, start=1)),
    )


def start_values(robot: Robot, slot: str) -> dict[str, float]:
    """Where the run starts, by our parameters: ``start.x`` ... in m, and of a cable ``start_tension`` in N."""
    kind, _, number = slot.partition("_")
    if kind == "winch":
        return {}
    start = {f"start.{axis}": value for axis, value in zip("xyz", robot.platform.start, strict=True)}
    return start if kind == "platform" else start | {"start_tension": float(static_tensions(robot)[int(number) - 1])}


def cable_data(robot: Robot) -> list[dict[str, Any]]:
    """What each cable FMU carries as ``cable.json``."""
    start = robot.platform.start
    return [
        {
            "description": f"cable {index} of {robot.name}",
            "law": cable.law,
            "anchor": list(cable.anchor),
            "start": list(start),
            "start_length": component.constants.start_length,
            "start_tension": float(component.constants.start_tension),
            "modulus": cable.modulus,
            "area": cable.area,
            "damping": cable.damping,
            "gravity": robot.gravity,
            "effects": [_effect_data(s) for s in robot.effects_on_cable(index)],
            "formulas": formula_texts(robot.formulas_on(index)),
        }
        for index, (cable, component) in enumerate(zip(robot.cables, assemble(robot).cables, strict=True), start=1)
    ]


def platform_data(robot: Robot) -> dict[str, Any]:
    """What the platform FMU carries as ``point_mass.json``."""
    forces = static_forces(robot)
    return {
        "description": f"platform of {robot.name}",
        "mass": robot.platform.mass,
        "gravity": robot.gravity,
        "start": list(robot.platform.start),
        "start_velocity": list(assemble(robot).velocity),
        "start_forces": forces.tolist(),
        "effects": [_effect_data(s) for s in platform_settings(robot)],
        "formulas": formula_texts(robot.formulas_on()),
    }


def winch_data(robot: Robot, cable: int) -> dict[str, Any]:
    """What the winch FMU of a cable, counted from 1, carries as ``winch.json``."""
    declared = {} if robot.winch is None else vars(robot.winch)
    numbers = {name: NO_LIMIT if value is None else value for name, value in declared.items()}
    return {"description": f"winch {cable} of {robot.name}", **numbers}


def _effect_data(setting: EffectSetting) -> dict[str, Any]:
    return {"name": setting.name, "values": BY_NAME[setting.name].completed(setting.values)}


def _build(module: str, base: str, name: str, data: dict[str, Any], folder: Path) -> Path:
    sources = Path(tautwire_fmu.__file__).parent
    package = f"tautwire_fmu_{_digest(sources)}"
    text = json.dumps(data | {"model_name": name}, sort_keys=True)
    guid = str(uuid5(NAMESPACE_URL, package + module + text))
    # An interrupt within one of the many imports may end in a callback that nobody hears of.
    with interrupts_held() as raise_interrupt, tempfile.TemporaryDirectory(prefix="tautwire-build-") as scratch_name:
        scratch = Path(scratch_name)
        shutil.copytree(sources, scratch / package, ignore=shutil.ignore_patterns("__pycache__", "*.pyc"))
        resource = scratch / f"{module}.json"
        resource.write_text(json.dumps(data | {"model_name": name, "guid": guid}), encoding="utf-8")
        script = scratch / f"{name}_{guid.replace('-', '')[:12]}.py"
        script.write_text(LAUNCHER.format(package=package, base=base), encoding="utf-8")
        unfinished = scratch / "built" / f"{name}.fmu"
        with builder(scratch, (package, script.stem)) as fmu_builder:
            fmu_builder.build_FMU(script, dest=unfinished, project_files=[scratch / package, resource], **OPTIONS)
        finished = scratch / f"{name}.fmu"
        mend_exit(unfinished, finished)
        raise_interrupt()
        return _move(finished, folder / f"{name}.fmu")


def _digest(sources: Path) -> str:
    digest = hashlib.sha256()
    for path in sorted(sources.rglob("*.py")):
        digest.update(path.relative_to(sources).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def _copy(source: Path, target: Path) -> Path:
    beside = target.with_name(f".{target.name}.partial")
    shutil.copyfile(source, beside)
    beside.replace(target)
    return target


def _move(built: Path, target: Path) -> Path:
    beside = target.with_name(f".{target.name}.partial")
    shutil.move(built, beside)
    beside.replace(target)
    return target
