"""FMU cache: FMUs as bytes, built once for all robots of the same structure, with numbers set as FMU parameters."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tautwire_fmu.effect_variables import setting_name
from tautwire_fmu.rigid_body_variables import INERTIA_ENTRIES

from ..fmus.component_resources import cable_resources, platform_resource, winch_resource
from ..fmus.packaging import RobotFmus, build_fastest_fmus, build_fmus, start_values
from ..robot.active_effects import has_sensor_effects
from ..robot.schema import Robot

FMU_SUFFIX = ".fmu"
# Vectors that FMUs have as parameters, and their parts.
VECTOR_PARTS = {"anchor": "xyz", "start": "xyz", "centre_of_mass": "xyz", "start_orientation": "wxyz"}


@dataclass(frozen=True)
class FmuBundle:
    """FMUs of a robot: ``files`` by component without the user's; ``structure`` is its :func:`structure_digest`.

    What is built beside it is machine code where ``prefers_native`` is set and a compiler works.
    """

    structure: str
    files: Mapping[str, bytes]
    prefers_native: bool = False


def structure_digest(robot: Robot) -> str:
    """Digest of what decides which FMUs a robot needs: laws, effects and formulas, not the numbers in them."""
    components = {name: _component_structure(data) for name, data in component_data(robot).items()}
    user_fmus = {fmu.slot: str(fmu.path) for fmu in robot.fmus}
    structure = json.dumps([components, user_fmus, robot.native_fmus], sort_keys=True)
    return hashlib.sha256(structure.encode()).hexdigest()[:16]


def component_data(robot: Robot) -> dict[str, dict[str, Any]]:
    """Data that each FMU built by the project carries, by component, without the user's FMUs."""
    user_slots = {fmu.slot for fmu in robot.fmus}
    data = {f"cable_{i}": each for i, each in enumerate(cable_resources(robot), start=1)}
    data["platform"] = platform_resource(robot)
    if robot.winch is not None:
        data |= {f"winch_{i}": winch_resource(robot, i) for i in robot.cable_numbers}
    return {name: each for name, each in data.items() if name not in user_slots}


def build_bundle(robot: Robot, prefers_native: bool = False) -> FmuBundle:
    """Build the FMUs of a robot and read them into memory.

    As machine code where that is preferred and a compiler works: for runs on this machine.
    """
    build = build_fastest_fmus if prefers_native else build_fmus
    with tempfile.TemporaryDirectory(prefix="tautwire-campaign-") as folder:
        build(robot, Path(folder))
        files = {path.stem: path.read_bytes() for path in Path(folder).glob(f"*{FMU_SUFFIX}")}
        return FmuBundle(structure_digest(robot), files, prefers_native)


def cached_fmus(robot: Robot, bundle: FmuBundle, cache_folder: Path) -> RobotFmus:
    """FMUs of a robot with all its numbers as start values: from the bundle if its structure matches, else built anew.

    They are unpacked into ``cache_folder`` once for each structure.

    Raises SlotError where an FMU of the user's does not fit, OSError where the disk refuses.
    """
    structure = structure_digest(robot)
    structure_folder = cache_folder / structure
    if not structure_folder.exists():
        files = bundle.files if structure == bundle.structure else build_bundle(robot, bundle.prefers_native).files
        _write_atomically(files, structure_folder)
    user_fmus = {fmu.slot: fmu.path for fmu in robot.fmus}

    def fmu_path(name: str) -> Path:
        return user_fmus.get(name, structure_folder / f"{name}{FMU_SUFFIX}")

    return RobotFmus(
        cables=tuple(fmu_path(f"cable_{i}") for i in robot.cable_numbers),
        platform=fmu_path("platform"),
        winches=tuple(fmu_path(f"winch_{i}") if i in robot.winch_numbers else None for i in robot.cable_numbers),
        user_start_values={slot: start_values(robot, slot) for slot in user_fmus},
        has_position_sensor="platform" not in user_fmus and has_sensor_effects(robot),
        start_settings={name: dict(_fmu_parameters(data)) for name, data in component_data(robot).items()},
        is_rigid=robot.platform.is_rigid_body,
    )


def _write_atomically(files: Mapping[str, bytes], target: Path) -> None:
    """Write files into a folder atomically, also when several processes write the same one."""
    target.parent.mkdir(parents=True, exist_ok=True)
    scratch = Path(tempfile.mkdtemp(prefix=".fmus-", dir=target.parent))
    try:
        for name, content in files.items():
            (scratch / f"{name}{FMU_SUFFIX}").write_bytes(content)
        os.rename(scratch, target)
    except OSError:
        if not target.exists():
            raise
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _component_structure(data: Mapping[str, Any]) -> list[Any]:
    effects = [setting_name(effect) for effect in data.get("effects", ())]
    # A swivel axis is no parameter of a cable's FMU.
    return [data.get("law"), effects, data.get("formulas"), data.get("swivel_axis"), sorted(data)]


def _fmu_parameters(data: Mapping[str, Any]) -> Iterator[tuple[str, float]]:
    """The numeric start values of a component by FMU parameter name; a name may be no parameter of the FMU."""
    for name, value in data.items():
        if isinstance(value, int | float):
            yield name, float(value)
        elif name in VECTOR_PARTS:
            yield from _vector_parameters(name, VECTOR_PARTS[name], value)
        elif name == "attachments":
            for number, point in enumerate(value, start=1):
                yield from _vector_parameters(f"attachment_{number}", "xyz", point)
        elif name == "inertia":
            yield from (
                (f"inertia.{entry}", float(value["xyz".index(entry[0])]["xyz".index(entry[1])]))
                for entry in INERTIA_ENTRIES
            )
    for effect in data.get("effects", ()):
        yield from ((f"effect.{setting_name(effect)}.{name}", float(value)) for name, value in effect["values"].items())


def _vector_parameters(name: str, parts: str, values: Sequence[float]) -> Iterator[tuple[str, float]]:
    yield from ((f"{name}.{part}", float(value)) for part, value in zip(parts, values, strict=True))
