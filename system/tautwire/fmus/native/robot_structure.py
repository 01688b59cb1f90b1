"""Structure of a native whole robot: where the numbers of each component lie, and the sizes of its states."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import accumulate
from typing import Any

from tautwire_fmu.cable_slave import LENGTH_SCALE
from tautwire_fmu.effect_variables import effects_from_resource
from tautwire_fmu.rigid_body_slave import INERTIA

from .cable_functions import START_SIZE
from .robot_functions import cable_kinds, platform_start_size
from .robot_slave import INNER_STEP, WholeRobot
from .winch_functions import DRIVE_SIZE

# m and rad: error scales of position and orientation; stiff ropes make newtons of micrometres.
POSITION_SCALE, ANGLE_SCALE = 1e-4, 1e-4
# rad/s: how fast motions change by their size; robots vibrate near it.
MOTION_RATE = 10.0


def robot_macros(slave: WholeRobot, data: Mapping[str, Any]) -> dict[str, Any]:
    """Sizes, places of variables, and tables by cable, as macros in C."""
    names = [variable.name for variable in slave.variables]
    states, parameters = _counts(slave.component_states), _counts(slave.component_parameters)
    kinds, kind_of_cable = cable_kinds(data["cables"])
    count, is_rigid = len(data["cables"]), data["is_rigid"]
    macros = {
        "CABLE_COUNT": count,
        "HAS_WINCHES": int(bool(data["winches"])),
        "IS_RIGID": int(is_rigid),
        "INERTIA": INERTIA,
        "EXTERNAL_SIZE": 6 if is_rigid else 3,
        "PLATFORM_STATES": states["platform"],
        "PLATFORM_START_SIZE": platform_start_size(data),
        "CABLE_START_SIZE": START_SIZE,
        "DRIVE_SIZE": DRIVE_SIZE,
        "START_SIZE": platform_start_size(data) + count * START_SIZE + len(data["winches"]) * DRIVE_SIZE,
        "FIRST_OUTPUT": slave.states.stop,
        "FIRST_CABLE_OUTPUT": names.index("tension_1"),
        "INNER_STEP": names.index(INNER_STEP.name),
        "SIGNAL_AXES": 3 + count,
        "SIGNAL_DERIVATIVES": 3,
        "CABLE_KINDS": _list(kind_of_cable),
        "CABLE_STATES": _list(_offsets(states, "cable_")),
        "CABLE_PARAMETERS": _list(_offsets(parameters, "cable_")),
        "WINCH_STATES": _list(_offsets(states, "winch_")),
        "WINCH_PARAMETERS": _list(_offsets(parameters, "winch_")),
    }
    if "measured_position.x" in names:
        macros["MEASURED_POSITION"] = names.index("measured_position.x")
    for function in ("start", "action", "outputs", "derivative"):
        by_kind = [f"cable_{function}_{kind}" for kind in range(len(kinds))]
        macros[f"CABLE_{function.upper()}_FUNCTIONS"] = _list(by_kind)
    return macros


def robot_state_scales(slave: WholeRobot, data: Mapping[str, Any]) -> list[float]:
    """Sizes of all states, in which the error of the integration counts."""
    motion = [POSITION_SCALE] * 3 + [POSITION_SCALE * MOTION_RATE] * 3
    if data["is_rigid"]:
        inertia = max(data["platform"]["inertia"][axis][axis] for axis in range(3))
        motion = [ANGLE_SCALE] * 4 + motion + [ANGLE_SCALE * MOTION_RATE * inertia] * 3
    motion += [1.0] * (len(slave.component_states["platform"]) - len(motion))
    for cable in data["cables"]:
        effects = effects_from_resource(dict(cable))
        motion += [LENGTH_SCALE, LENGTH_SCALE, *(state.scale for effect in effects for state in effect.states)]
    return motion + [LENGTH_SCALE * MOTION_RATE, LENGTH_SCALE * MOTION_RATE**2] * len(data["winches"])


def robot_constants(data: Mapping[str, Any]) -> tuple[float, ...]:
    """Velocity and angular velocity at the start."""
    origin, platform = (0.0, 0.0, 0.0), data["platform"]
    return (*platform.get("start_velocity", origin), *platform.get("start_angular_velocity", origin))


def _counts(by_component: Mapping[str, Sequence[Any]]) -> dict[str, int]:
    return {name: len(each) for name, each in by_component.items()}


def _offsets(counts: Mapping[str, int], kind: str) -> list[int]:
    """Places of the first numbers of all components of a kind; one that is no place where there are none."""
    places = dict(zip(counts, accumulate(counts.values(), initial=0), strict=False))
    return [place for name, place in places.items() if name.startswith(kind)] or [-1]


def _list(entries: Sequence[Any]) -> str:
    return f"{{{', '.join(map(str, entries))}}}"
