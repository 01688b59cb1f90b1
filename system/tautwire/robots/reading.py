"""Robot files: reading one with every key checked, writing one that reads back equal."""

import math
import os
import re
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from tautwire_fmu.laws.cable import LAWS
from tautwire_fmu.laws.effects import BY_NAME

from ..errors import RobotFileError, at_once, one_line, shown
from ..input_file import path_of, read_bytes, require_text
from .checked_table import CheckedTable, NumberRule, Refuse, nearest
from .effect_table import cables_of, effects_in
from .formula_table import formulas_in
from .robot import (
    Cable,
    OwnFmu,
    Platform,
    Point,
    Robot,
    Sensors,
    TensionLimits,
    Winch,
    slots,
)
from .writing import robot_text

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib  # type: ignore[import-not-found,unused-ignore]

__all__ = ["read_robot", "robot_text", "write_robot"]

KEYS = ("name", "gravity", "platform", "tension", "sensors", "cable", "effect", "winch", "fmu", "formula")
LARGEST_FILE = 10_000_000  # bytes
MOST_CABLES = 100
SAME_POINT = 1e-6  # m, closer than any two exit points can be built

GRAVITY = NumberRule("the gravity along -z", "m/s^2", minimum=0.0, default=9.81)
MASS = NumberRule("the platform's mass", "kg", positive=True)
MINIMUM = NumberRule("the least tension", "N", minimum=0.0)
MAXIMUM = NumberRule("the largest tension", "N", positive=True)
PREFERRED = NumberRule("the tension to aim at", "N", minimum=0.0)
UNCERTAINTY = NumberRule("the standard deviation of true start tensions from the rule's", "N", minimum=0.0)
NOISES = {
    "position_noise": NumberRule("the standard deviation of one position", "m", minimum=0.0),
    "tension_noise": NumberRule("the standard deviation of one tension", "N", minimum=0.0),
    "winch_speed_noise": NumberRule("the standard deviation of one winch speed", "m/s", minimum=0.0),
}
OFFSETS = {
    "tension_offset_uncertainty": NumberRule(
        "the standard deviation of a load cell's constant error", "N", minimum=0.0, default=0.0
    ),
    "position_offset_uncertainty": NumberRule(
        "the standard deviation of the tracker's constant error", "m", minimum=0.0, default=0.0
    ),
}
MASS_UNCERTAINTY = NumberRule("the standard deviation of the true mass", "kg", minimum=0.0, default=0.0)
MODULUS_UNCERTAINTY = NumberRule("the standard deviation of the true modulus", "Pa", minimum=0.0, default=0.0)
DAMPING_UNCERTAINTY = NumberRule("the standard deviation of the true damping", "Pa s", minimum=0.0, default=0.0)
MODULUS = NumberRule("the modulus of elasticity", "Pa", positive=True)
AREA = NumberRule("the area of the rope's cross-section", "m^2", positive=True)
DAMPING = NumberRule("the damping", "Pa s", minimum=0.0, default=0.0)
DRUM_RADIUS = NumberRule("the radius at which rope lies on the drum", "m", positive=True)
GEAR = NumberRule("the turns of the motor for one turn of the drum", "", positive=True, default=Winch.gear)
BANDWIDTH = NumberRule("the natural frequency of the speed loop", "Hz", 0.01, 1000.0, default=Winch.bandwidth)
DAMPING_RATIO = NumberRule("the damping ratio of the speed loop", "", 0.05, 20.0, default=Winch.damping_ratio)
LIMITS = {
    "speed_limit": NumberRule("the largest speed of the rope", "m/s", positive=True),
    "acceleration_limit": NumberRule("the largest acceleration of the rope", "m/s^2", positive=True),
}


def read_robot(path: str | Path) -> Robot:
    """The robot that a TOML file declares, with n cables; lengths in m, forces in N, moduli in Pa, masses in kg.

    Raises RobotFileError, which names the first key that is wrong, where the file declares none; ArgumentError where
    ``path`` is none. All that is wrong at once: ``tautwire check``.
    """
    return read_robot_telling(path_of("read_robot: path", path), at_once)


def read_robot_telling(path: str | Path, sink: Refuse) -> Robot:
    """The robot that a file declares, each error handed to ``sink``.

    Where that does not raise, reading goes on to the next one, and the robot is not to be used. What is no TOML is
    raised as RobotFileError all the same.
    """
    file = str(path)
    parsed = _parsed(robot_file_text(path), file)
    return _robot(CheckedTable(file, "", parsed, sink), default_name=one_line(Path(path).stem))


def robot_content(path: str | Path) -> dict[str, Any]:
    """The keys and values of a robot file, unchecked; raises RobotFileError where it is no TOML."""
    return _parsed(robot_file_text(path), str(path))


def robot_from(content: dict[str, Any], path: str | Path) -> Robot:
    """The robot that keys and values declare as if a file ``path`` held them; raises RobotFileError for none."""
    return _robot(CheckedTable(str(path), "", content), default_name=one_line(Path(path).stem))


def robot_file_text(path: str | Path) -> str:
    """What stands in a robot file; raises RobotFileError where that is no text."""
    content = read_bytes(path, RobotFileError, LARGEST_FILE)
    require_text(content, str(path), RobotFileError, "TOML")
    return content.decode("utf-8-sig")


def write_robot(robot: Robot, path: str | Path) -> None:
    """Writes a file that reads back equal, whole or not at all.

    Raises RobotFileError where the robot is one that no file may declare, OSError where the disk refuses.
    """
    text = robot_text(robot)
    if _robot(CheckedTable(str(path), "", _parsed(text, str(path))), robot.name) != _completed(robot):
        raise RobotFileError(str(path), "would not read back equal", "build the robot as read_robot does")
    target = Path(path)
    beside = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        beside.write_bytes(text.encode("utf-8"))
        beside.replace(target)
    finally:
        beside.unlink(missing_ok=True)


def _completed(robot: Robot) -> Robot:
    """The robot with the neutral values that its effects' settings leave out."""
    effects = (replace(s, values=BY_NAME[s.name].completed(s.values)) for s in robot.effects)
    return replace(robot, effects=tuple(effects))


def _parsed(text: str, file: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except RecursionError as problem:
        raise RobotFileError(file, "is nested too deeply", "write it as a flat robot file") from problem
    except ValueError as problem:
        reason, _, place = str(problem).partition(" (at ")
        said = re.match(r"line (\d+), column (\d+)", place)
        line = int(said.group(1)) if said else text.count("\n") + 1
        column = f", column {said.group(2)}" if said else ""
        where = f"{file}: line {line}"
        raise RobotFileError(where, f"is not TOML ({reason}{column})", "correct this line", line=line) from problem


def _robot(root: CheckedTable, default_name: str) -> Robot:
    root.require_known(KEYS)
    name = _name(root, default_name)
    gravity = root.number("gravity", GRAVITY)
    platform = _platform(root)
    cables = _cables(root, platform.start)
    tension, sensors, effect = root.table("tension"), root.table("sensors"), root.table("effect")
    winch, fmu = root.table("winch"), root.table("fmu")
    return Robot(
        name=name,
        gravity=gravity,
        platform=platform,
        tension=_tension(tension) if tension else None,
        sensors=_sensors(sensors) if sensors else Sensors(),
        cables=cables,
        effects=effects_in(effect, len(cables)) if effect else (),
        winch=_winch(winch) if winch else None,
        fmus=_fmus(fmu, len(cables)) if fmu else (),
        formulas=formulas_in(root, partial(cables_of, cable_count=len(cables))),
    )


def _name(root: CheckedTable, default: str) -> str:
    if "name" not in root.content:
        return default
    mend = 'give the robot a name, as in name = "hall"'
    name = root.text("name", mend)
    if name is not None and (not name.strip() or not name.isprintable()):
        root.refuse("name", f"is {shown(name)}, must be one line of printable text", mend)
    return name or default


def _platform(root: CheckedTable) -> Platform:
    table = root.table("platform")
    if table is None:
        if "platform" not in root.content:
            root.refuse("platform", "is missing", "add a table [platform] with mass and start")
        return Platform(math.nan, (math.nan, math.nan, math.nan))
    table.require_known(("mass", "start", "mass_uncertainty"))
    return Platform(
        table.number("mass", MASS),
        table.point("start", "where the run starts"),
        table.number("mass_uncertainty", MASS_UNCERTAINTY),
    )


def _tension(table: CheckedTable) -> TensionLimits:
    table.require_known(("minimum", "maximum", "preferred", "preferred_uncertainty"))
    minimum, maximum = table.number("minimum", MINIMUM), table.number("maximum", MAXIMUM)
    preferred = table.number("preferred", PREFERRED)
    if minimum > maximum:
        problem = f"is {minimum!r}, must be at most the maximum, {maximum!r} N"
        table.refuse("minimum", problem, "lower minimum or raise maximum")
    elif preferred < minimum or preferred > maximum:
        problem = f"is {preferred!r}, must lie between minimum and maximum, {minimum!r} and {maximum!r} N"
        table.refuse("preferred", problem, "choose a tension between them")
    return TensionLimits(minimum, maximum, preferred, table.optional_number("preferred_uncertainty", UNCERTAINTY))


def _sensors(table: CheckedTable) -> Sensors:
    table.require_known([*NOISES, *OFFSETS])
    noises = {key: table.optional_number(key, rule) for key, rule in NOISES.items()}
    offsets = {key: table.number(key, rule) for key, rule in OFFSETS.items()}
    return Sensors(
        noises["position_noise"],
        noises["tension_noise"],
        noises["winch_speed_noise"],
        offsets["tension_offset_uncertainty"],
        offsets["position_offset_uncertainty"],
    )


def _cables(root: CheckedTable, start: Point) -> tuple[Cable, ...]:
    given = root.content.get("cable", [])
    tables = root.tables("cable") if "cable" in root.content else ()
    if isinstance(given, list) and len(given) < 3:
        problem = f"{len(given)} given, a robot has three or more"
        root.refuse("cable", problem, "add one table [[cable]] for each cable")
    if len(tables) > MOST_CABLES:
        root.refuse("cable", f"{len(tables)} given, at most {MOST_CABLES} are read", "leave out the others")
        tables = tables[:MOST_CABLES]
    cables = tuple(_cable(table) for table in tables)
    for place, (table, cable) in enumerate(zip(tables, cables, strict=True)):
        if math.dist(cable.anchor, start) < SAME_POINT:
            problem = f"is {list(cable.anchor)}, the same as platform.start"
            table.refuse("anchor", problem, "move one of them")
        for other in range(place):
            if math.dist(cable.anchor, cables[other].anchor) < SAME_POINT:
                problem = f"is {list(cable.anchor)}, the same as that of cable {other + 1}"
                table.refuse("anchor", problem, "give each cable its own exit point")
    return cables


def _cable(table: CheckedTable) -> Cable:
    table.require_known(("anchor", "modulus", "area", "damping", "law", "modulus_uncertainty", "damping_uncertainty"))
    laws = " or ".join(f'"{law}"' for law in LAWS)
    law = table.text("law", f"write law = {laws}")
    if law is not None and law not in LAWS:
        table.refuse("law", f"is {shown(law)}, must be {laws}", f"write {nearest(law, LAWS)}")
    return Cable(
        anchor=table.point("anchor", "the exit point on the frame"),
        modulus=table.number("modulus", MODULUS),
        area=table.number("area", AREA),
        damping=table.number("damping", DAMPING),
        law=law or "",
        modulus_uncertainty=table.number("modulus_uncertainty", MODULUS_UNCERTAINTY),
        damping_uncertainty=table.number("damping_uncertainty", DAMPING_UNCERTAINTY),
    )


def _winch(table: CheckedTable) -> Winch:
    table.require_known(("drum_radius", "gear", "bandwidth", "damping_ratio", *LIMITS))
    return Winch(
        drum_radius=table.number("drum_radius", DRUM_RADIUS),
        gear=table.number("gear", GEAR),
        bandwidth=table.number("bandwidth", BANDWIDTH),
        damping_ratio=table.number("damping_ratio", DAMPING_RATIO),
        **{key: table.optional_number(key, rule) for key, rule in LIMITS.items()},
    )


def _fmus(table: CheckedTable, cable_count: int) -> tuple[OwnFmu, ...]:
    table.require_known(slots(cable_count))
    mend = 'name an FMU, as in platform = "mine.fmu"'
    found = []
    for slot in table.content:
        name = table.text(slot, mend)
        if name is None:
            continue
        if not name.strip() or not name.isprintable():
            table.refuse(slot, f"is {shown(name)}, must be the path of a file", mend)
        # Whoever writes the robot elsewhere must still find the FMU.
        found.append(OwnFmu(slot, Path(os.path.abspath(Path(table.file).parent / name))))
    return tuple(found)
