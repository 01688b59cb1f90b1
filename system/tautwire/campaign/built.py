"""FMUs that go from process to process as bytes, built once for all robots that differ in numbers alone."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..fmus.packaging import RobotFmus, build_fmus, cable_data, platform_data, start_values, winch_data
from ..robots.robot import Robot
from ..statics.equilibrium import has_sensor_effects

SUFFIX = ".fmu"


@dataclass(frozen=True)
class Bundle:
    """The FMUs of a robot: ``files`` by component, those of the user's left out; ``structure`` as for :func:`built`."""

    structure: str
    files: Mapping[str, bytes]


def structure_of(robot: Robot) -> str:
    """What tells robots apart that need other FMUs: laws, effects and formulas, not the numbers in them."""
    components = {name: _structure(data) for name, data in component_data(robot).items()}
    own = {fmu.slot: str(fmu.path) for fmu in robot.fmus}
    return hashlib.sha256(json.dumps([components, own], sort_keys=True).encode()).hexdigest()[:16]


def component_data(robot: Robot) -> dict[str, dict[str, Any]]:
    """What each FMU of the project's carries, by component."""
    own = {fmu.slot for fmu in robot.fmus}
    data = {f"cable_{i}": each for i, each in enumerate(cable_data(robot), start=1)}
    data["platform"] = platform_data(robot)
    if robot.winch is not None:
        data |= {f"winch_{i}": winch_data(robot, i) for i in robot.cable_numbers}
    return {name: each for name, each in data.items() if name not in own}


def bundled(robot: Robot) -> Bundle:
    """Build the FMUs of a robot, and take them into memory."""
    with tempfile.TemporaryDirectory(prefix="tautwire-campaign-") as folder:
        build_fmus(robot, Path(folder))
        return Bundle(structure_of(robot), {path.stem: path.read_bytes() for path in Path(folder).glob(f"*{SUFFIX}")})


def fmus_of(robot: Robot, bundle: Bundle, folder: Path) -> RobotFmus:
    """The FMUs of a robot, with all its numbers: the bundle's where it suits, else some built in ``folder`` before.

    Raises SlotError where an FMU of the user's does not fit, OSError where the disk refuses.
    """
    structure = structure_of(robot)
    place = folder / structure
    if not place.exists():
        files = bundle.files if structure == bundle.structure else bundled(robot).files
        _unpack(files, place)
    own = {fmu.slot: fmu.path for fmu in robot.fmus}

    def path(name: str) -> Path:
        return own.get(name, place / f"{name}{SUFFIX}")

    return RobotFmus(
        cables=tuple(path(f"cable_{i}") for i in robot.cable_numbers),
        platform=path("platform"),
        winches=tuple(path(f"winch_{i}") if i in robot.winch_numbers else None for i in robot.cable_numbers),
        own={slot: start_values(robot, slot) for slot in own},
        measured="platform" not in own and has_sensor_effects(robot),
        settings={name: dict(_numbers(data)) for name, data in component_data(robot).items()},
    )


def _unpack(files: Mapping[str, bytes], place: Path) -> None:
    """Write files into a folder that is there whole or not at all, whoever else writes the same."""
    place.parent.mkdir(parents=True, exist_ok=True)
    scratch = Path(tempfile.mkdtemp(prefix=".fmus-", dir=place.parent))
    try:
        for name, content in files.items():
            (scratch / f"{name}{SUFFIX}").write_bytes(content)
        os.rename(scratch, place)
    except OSError:
        if not place.exists():
            raise
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _structure(data: Mapping[str, Any]) -> list[Any]:
    effects = [effect["name"] for effect in data.get("effects", ())]
    return [data.get("law"), effects, data.get("formulas"), sorted(data)]


def _numbers(data: Mapping[str, Any]) -> Iterator[tuple[str, float]]:
    """The numbers that a component carries, by the names of its parameters; some are none."""
    for name, value in data.items():
        if isinstance(value, int | float):
            yield name, float(value)
        elif name in ("anchor", "start"):
            yield from ((f"{name}.{axis}", float(each)) for axis, each in zip("xyz", value, strict=True))
    for effect in data.get("effects", ()):
        yield from ((f"effect.{effect['name']}.{name}", float(value)) for name, value in effect["values"].items())
