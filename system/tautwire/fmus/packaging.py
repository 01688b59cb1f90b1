"""Builds the FMUs of a robot: one a cable, one a winch, one for the platform, with their values inside."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ..robot.active_effects import has_sensor_effects
from ..robot.schema import Robot, validate_robot
from ..robot.static_equilibrium import start_attachments, start_orientation, static_tensions
from ..validation import validate_callable, validate_folder
from .component_resources import cable_resources, platform_resource, robot_resource, winch_resource
from .fmu_archive import put_atomically
from .fmu_slots import SlotError, check_user_fmus
from .pythonfmu_builder import FmuWriter, pythonfmu_writer


@dataclass(frozen=True)
class RobotFmus:
    """Paths of a robot's FMUs: one a cable in the robot file's order, the platform's, and the winches'.

    A winch is None where rope runs at the commanded speed. ``user_start_values`` are the slots with user FMUs; each
    is to start with these values, by the names of our parameters. ``has_position_sensor`` tells that the platform also
    outputs its measured position, ``is_rigid`` that it turns. ``start_settings`` are parameters that our own FMUs start
    with in place of their stored values, by component; names that are no parameter of it are ignored.
    ``relative_tolerance`` is that of the FMUs' own integration, None for each one's own: a billionth of its states'
    scales for ours.
    """

    cables: tuple[Path, ...]
    platform: Path
    winches: tuple[Path | None, ...] = ()
    user_start_values: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    has_position_sensor: bool = False
    start_settings: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    relative_tolerance: float | None = None
    is_rigid: bool = False

    @property
    def by_component(self) -> dict[str, Path]:
        """All FMUs by the names of their components: platform, winches, and the cables, which depend on both."""
        cables = {f"cable_{index}": path for index, path in enumerate(self.cables, start=1)}
        winches = {f"winch_{index}": path for index, path in enumerate(self.winches, start=1) if path is not None}
        return {"platform": self.platform} | winches | cables

    def start_values_of(self, component: str) -> dict[str, float]:
        """Values that a component is to start with in place of its FMU's; it may have no parameters of these names."""
        return {**self.user_start_values.get(component, {}), **self.start_settings.get(component, {})}

    @property
    def paths(self) -> tuple[Path, ...]:
        """Paths of all FMUs, those of the cables first."""
        return (*self.cables, self.platform, *(path for path in self.winches if path is not None))

    @property
    def winch_numbers(self) -> tuple[int, ...]:
        """Cables, counted from 1, that have a winch."""
        return tuple(index for index, path in enumerate(self.winches, start=1) if path is not None)


def build_fmus(
    robot: Robot,
    folder: str | Path,
    progress: Callable[[float], None] | None = None,
    native: bool = False,
    platforms: Sequence[str] = (),
    fmi: int = 2,
    co_simulation_only: bool = False,
) -> RobotFmus:
    """Write ``platform.fmu``, ``cable_1.fmu`` ... and, where there are winches, ``winch_1.fmu`` ... into ``folder``.

    FMI 2.0 co-simulation; the data of a component lie inside as a JSON resource. ``native`` FMUs are machine code for
    ``platforms``, by default this machine's, with their source, and need no Python; they can also be of ``fmi`` 3, the
    major version, and do model exchange too unless they are to be ``co_simulation_only``. So are those of a robot that
    asks for ``native_fmus``. User FMUs stay where they are.
    The folder is created if absent, and has to stay while the FMUs are run. ``progress`` gets the fraction completed,
    from 0 to 1. Returns the paths of the FMUs.

    Raises SlotError where a user FMU does not fit, UnreachableError where the cables cannot hold the platform at the
    start, NativeBuildError where native FMUs cannot be compiled, ArgumentError where an argument is none of these,
    OSError where the disk refuses.
    """
    validate_robot("build_fmus: robot", robot)
    folder = validate_folder("build_fmus: folder", folder)
    validate_callable("build_fmus: progress", progress)
    check_user_fmus(robot)
    folder.mkdir(parents=True, exist_ok=True)
    user_fmus = {fmu.slot: fmu.path for fmu in robot.fmus}
    components, paths = _components(robot), dict[str, Path]()
    with fmu_writer(native or robot.native_fmus, platforms, fmi, not co_simulation_only) as write_fmu:
        for number, (name, (module, base, data)) in enumerate(components.items(), start=1):
            paths[name] = user_fmus[name] if name in user_fmus else write_fmu(module, base, name, data, folder)
            if progress is not None:
                progress(number / len(components))
    return RobotFmus(
        cables=tuple(paths[f"cable_{i}"] for i in robot.cable_numbers),
        platform=paths["platform"],
        winches=tuple(paths.get(f"winch_{i}") for i in robot.cable_numbers),
        user_start_values={slot: start_values(robot, slot) for slot in user_fmus},
        has_position_sensor="platform" not in user_fmus and has_sensor_effects(robot),
        is_rigid=robot.platform.is_rigid_body,
    )


def build_fastest_fmus(robot: Robot, folder: str | Path) -> RobotFmus:
    """Write FMUs as machine code, two to five times as fast, where a compiler works; else the same ones in Python.

    For runs on this machine. Raises what :func:`build_fmus` raises but NativeBuildError.
    """
    # Loaded where it is needed, like all of the native FMUs.
    from .native.c_toolchain import NativeBuildError

    try:
        return build_fmus(robot, folder, native=True)
    except NativeBuildError:
        return build_fmus(robot, folder)


def build_whole_fmu(
    robot: Robot,
    folder: str | Path,
    progress: Callable[[float], None] | None = None,
    platforms: Sequence[str] = (),
    fmi: int = 2,
) -> Path:
    """Write ``robot.fmu`` into ``folder``: platform, cables and winches of a robot in one native FMU.

    Its inputs are the winch speeds and the external load, its outputs pose, tensions and rope lengths; all states are
    integrated together. The arguments are those of :func:`build_fmus`. Returns the path.

    Raises SlotError where the robot file names FMUs of the user, UnreachableError where the cables cannot hold the
    platform at the start, NativeBuildError where it cannot be compiled, ArgumentError where an argument is none of
    these, OSError where the disk refuses.
    """
    validate_robot("build_whole_fmu: robot", robot)
    folder = validate_folder("build_whole_fmu: folder", folder)
    validate_callable("build_whole_fmu: progress", progress)
    for fmu in robot.fmus:
        problem = "the whole robot as one FMU has its own equations in every slot"
        raise SlotError(fmu.path, fmu.slot, None, problem, f"build it without the {fmu.slot} under [fmu]")
    folder.mkdir(parents=True, exist_ok=True)
    path = native_fmu_writer(platforms, fmi)("robot", "WholeRobot", "robot", robot_resource(robot), folder)
    if progress is not None:
        progress(1.0)
    return path


def _components(robot: Robot) -> dict[str, tuple[str, str, dict[str, Any]]]:
    """Module and class of each component's slave, and its resource, by the component's name."""
    slave = ("rigid_body", "RigidBody") if robot.platform.is_rigid_body else ("point_mass", "PointMass")
    cables = {f"cable_{i}": ("cable", "Cable", data) for i, data in enumerate(cable_resources(robot), start=1)}
    winches = {f"winch_{i}": ("winch", "Winch", winch_resource(robot, i)) for i in robot.winch_numbers}
    return cables | {"platform": (*slave, platform_resource(robot))} | winches


def fmu_writer(
    native: bool, platforms: Sequence[str], fmi: int, model_exchange: bool = True
) -> AbstractContextManager[FmuWriter]:
    """Context with a function that writes FMUs: as machine code, see :func:`native_fmu_writer`, or by pythonfmu."""
    return nullcontext(native_fmu_writer(platforms, fmi, model_exchange)) if native else pythonfmu_writer()


def native_fmu_writer(platforms: Sequence[str], fmi: int, model_exchange: bool = True) -> FmuWriter:
    """Function that writes native FMUs for some platforms, by default this machine's.

    Without ``model_exchange`` they are for co-simulation only.

    Raises NativeBuildError where there is no compiler, or none for these platforms.
    """
    # Imported here: most FMUs are not native, and pythonfmu's slaves come with it.
    from .native.c_toolchain import NativeBuildError
    from .native.component_sources import COMPONENTS
    from .native.native_archive import native_target, write_native_fmu

    names = [platforms] if isinstance(platforms, str) else platforms
    target = native_target(names, fmi, model_exchange)

    def write_fmu(module: str, base: str, name: str, data: dict[str, Any], folder: Path) -> Path:
        if module not in COMPONENTS:
            raise NativeBuildError(f"{name} has no native FMU", "build it without --native")
        with tempfile.TemporaryDirectory(prefix="tautwire-build-") as scratch:
            built = Path(scratch) / f"{name}.fmu"
            write_native_fmu(module, base, data | {"model_name": name}, target, built)
            return put_atomically(shutil.move, built, folder / built.name)

    return write_fmu


def package_controller_fmu(data: dict[str, Any], folder: Path, native: bool = False) -> Path:
    """Write ``controller.fmu`` into ``folder``; ``data`` is its resource ``controller.json``."""
    folder.mkdir(parents=True, exist_ok=True)
    with fmu_writer(native, (), 2) as write_fmu:
        return write_fmu("controller", "Controller", "controller", data, folder)


def with_user_fmus_copied(fmus: RobotFmus, folder: Path) -> RobotFmus:
    """The same FMUs with copies of the user FMUs in ``folder``, named as their slots."""
    copies = {
        slot: put_atomically(shutil.copyfile, fmus.by_component[slot], folder / f"{slot}.fmu")
        for slot in fmus.user_start_values
    }
    return replace(
        fmus,
        cables=tuple(copies.get(f"cable_{i}", path) for i, path in enumerate(fmus.cables, start=1)),
        platform=copies.get("platform", fmus.platform),
        winches=tuple(copies.get(f"winch_{i}", path) for i, path in enumerate(fmus.winches, start=1)),
    )


def start_values(robot: Robot, slot: str) -> dict[str, float]:
    """Start values of a run, by our parameters.

    ``start.x`` ... in m, where a cable holds the platform; of a cable ``start_tension`` in N, of a rigid platform also
    ``start_orientation.w`` ...
    """
    kind, _, number = slot.partition("_")
    if kind == "winch":
        return {}
    if kind == "cable":
        index = int(number) - 1
        start = start_attachments(robot)[index]
        return _by_part("start", "xyz", start) | {"start_tension": float(static_tensions(robot)[index])}
    orientation = _by_part("start_orientation", "wxyz", start_orientation(robot))
    return _by_part("start", "xyz", robot.platform.start) | (orientation if robot.platform.is_rigid_body else {})


def _by_part(name: str, parts: str, values: Sequence[float]) -> dict[str, float]:
    return {f"{name}.{part}": value for part, value in zip(parts, values, strict=True)}
