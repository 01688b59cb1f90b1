"""Reads robot files, with every key checked."""

import math
import os
import re
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from tautwire_fmu.laws.cable import LAWS
from tautwire_fmu.laws.rotation import rotate
from tautwire_fmu.laws.vectors import add

from ..errors import RobotFileError, format_value, one_line, raise_error
from ..input_files import read_bytes, require_utf8_text, validate_path
from ..name_suggestions import suggest_name
from ..toml_text import parse_toml
from ..validation import NumberRule
from .checked_table import CheckedTable, ErrorSink
from .effect_tables import read_cable_list, read_effects, read_formulas, require_positive_mass
from .platform_reader import (
    CABLE_KEYS,
    SENSOR_KEYS,
    read_platform,
    refuse_keys_of_rigid_bodies,
)
from .recorded_columns import read_recorded_columns, read_tracker_table
from .schema import (
    Cable,
    Platform,
    RecordedColumn,
    Robot,
    Sensors,
    TensionLimits,
    Tracker,
    UserFmu,
    Winch,
    fmu_slots,
)
from .toml_hints import hint_for_line

TOP_LEVEL_KEYS = (
    "name",
    "gravity",
    "platform",
    "tension",
    "sensors",
    "cable",
    "effect",
    "winch",
    "fmu",
    "formula",
    "recording",
)
NATIVE_KEY = "native"
MAX_FILE_BYTES = 10_000_000  # bytes
MIN_CABLES, MAX_CABLES = 2, 100
MIN_POINT_DISTANCE = 1e-6  # m; no two exit points can be built closer

GRAVITY_RULE = NumberRule("the gravity along -z", "m/s^2", minimum=0.0, default=9.81)
MIN_TENSION_RULE = NumberRule("the minimum tension", "N", minimum=0.0)
MAX_TENSION_RULE = NumberRule("the maximum tension", "N", positive=True)
PREFERRED_TENSION_RULE = NumberRule("the preferred tension", "N", minimum=0.0)
PREFERRED_UNCERTAINTY_RULE = NumberRule(
    "the standard deviation of true start tensions from the rule's", "N", minimum=0.0
)
NOISE_RULES = {
    "position_noise": NumberRule("the standard deviation of one position", "m", minimum=0.0),
    "tension_noise": NumberRule("the standard deviation of one tension", "N", minimum=0.0),
    "winch_speed_noise": NumberRule("the standard deviation of one winch speed", "m/s", minimum=0.0),
    "orientation_noise": NumberRule("the standard deviation of one rotation about each axis", "rad", minimum=0.0),
}
OFFSET_RULES = {
    "tension_offset_uncertainty": NumberRule(
        "the standard deviation of a load cell's constant error", "N", minimum=0.0, default=0.0
    ),
    "position_offset_uncertainty": NumberRule(
        "the standard deviation of the tracker's constant error", "m", minimum=0.0, default=0.0
    ),
    "tension_gain_uncertainty": NumberRule(
        "the standard deviation of a load cell's gain about 1", "", minimum=0.0, default=0.0
    ),
}
CABLE_UNCERTAINTY_RULES = {
    "modulus_uncertainty": NumberRule("the standard deviation of the true modulus", "Pa", minimum=0.0, default=0.0),
    "damping_uncertainty": NumberRule("the standard deviation of the true damping", "Pa s", minimum=0.0, default=0.0),
    "anchor_uncertainty": NumberRule(
        "the standard deviation of each coordinate of the true exit point", "m", minimum=0.0, default=0.0
    ),
    "attachment_uncertainty": NumberRule(
        "the standard deviation of each coordinate of the true attachment point", "m", minimum=0.0, default=0.0
    ),
}
MODULUS_RULE = NumberRule("the modulus of elasticity", "Pa", positive=True)
AREA_RULE = NumberRule("the area of the rope's cross-section", "m^2", positive=True)
DAMPING_RULE = NumberRule("the damping", "Pa s", minimum=0.0, default=0.0)
DRUM_RADIUS_RULE = NumberRule("the radius at which rope lies on the drum", "m", positive=True)
GEAR_RULE = NumberRule("the turns of the motor for one turn of the drum", "", positive=True, default=Winch.gear)
BANDWIDTH_RULE = NumberRule("the natural frequency of the speed loop", "Hz", 0.01, 1000.0, default=Winch.bandwidth)
DAMPING_RATIO_RULE = NumberRule("the damping ratio of the speed loop", "", 0.05, 20.0, default=Winch.damping_ratio)
WINCH_LIMIT_RULES = {
    "speed_limit": NumberRule("the largest speed of the rope", "m/s", positive=True),
    "acceleration_limit": NumberRule("the largest acceleration of the rope", "m/s^2", positive=True),
}


def read_robot(path: str | Path) -> Robot:
    """Reads the robot that a TOML file declares, with n cables; lengths in m, forces in N, moduli in Pa, masses in kg.

    Raises RobotFileError, which names the first invalid key, if the file declares no robot; ArgumentError if ``path``
    is no path. ``tautwire check`` reports all errors at once.
    """
    return read_robot_with_sink(validate_path("read_robot: path", path), raise_error)


def read_robot_with_sink(path: str | Path, sink: ErrorSink) -> Robot:
    """Reads a robot file and passes each error to ``sink``.

    If that does not raise, reading continues to the next error, and the robot must not be used. A file that is not
    TOML raises RobotFileError all the same.
    """
    file = str(path)
    parsed = _parse_robot_file(robot_file_text(path), file)
    return _read_robot_table(CheckedTable(file, "", parsed, sink), default_name=one_line(Path(path).stem))


def read_columns_file(path: str | Path, cable_count: int) -> tuple[RecordedColumn, ...]:
    """Reads the columns of recordings by the laboratory's names from a TOML file with the table [recording.columns].

    The table may stand in a robot file. Raises RobotFileError, which names the first invalid key.
    """
    return read_recorded_columns(_columns_table(path), cable_count)


def read_tracker_file(path: str | Path) -> Tracker:
    """Reads the tracker that the table [recording.tracker] of such a file declares."""
    return read_tracker_table(_columns_table(path))


def _columns_table(path: str | Path) -> CheckedTable:
    root = CheckedTable(str(path), "", robot_content(path))
    if "recording" not in root.content:
        root.refuse("recording", "is missing", "write the table [recording.columns]")
    root.require_known(TOP_LEVEL_KEYS if "cable" in root.content else ("recording",))
    return root


def robot_content(path: str | Path) -> dict[str, Any]:
    """The unvalidated keys and values of a robot file; raises RobotFileError if it is not TOML."""
    return _parse_robot_file(robot_file_text(path), str(path))


def robot_from_content(content: dict[str, Any], path: str | Path) -> Robot:
    """The robot that keys and values declare, as if read from ``path``; raises RobotFileError if they declare none."""
    return _read_robot_table(CheckedTable(str(path), "", content), default_name=one_line(Path(path).stem))


def robot_from_text(text: str, path: str | Path, default_name: str) -> Robot:
    """The robot that a TOML text declares, as if read from ``path``; raises RobotFileError if it declares none."""
    return _read_robot_table(CheckedTable(str(path), "", _parse_robot_file(text, str(path))), default_name)


def robot_file_text(path: str | Path) -> str:
    """The text of a robot file; raises RobotFileError if it is not text."""
    content = read_bytes(path, RobotFileError, MAX_FILE_BYTES)
    require_utf8_text(content, str(path), RobotFileError, "TOML")
    return content.decode("utf-8-sig")


def _parse_robot_file(text: str, file: str) -> dict[str, Any]:
    try:
        return parse_toml(text)
    except RecursionError as problem:
        raise RobotFileError(file, "is nested too deeply", "write it as a flat robot file") from problem
    except ValueError as problem:
        reason, _, location = str(problem).partition(" (at ")
        match = re.match(r"line (\d+), column (\d+)", location)
        line = int(match.group(1)) if match else text.count("\n") + 1
        column = f", column {match.group(2)}" if match else ""
        where = f"{file}: line {line}"
        hint = hint_for_line(text, line, reason)
        raise RobotFileError(where, f"is not TOML ({reason}{column})", hint, line=line) from problem


def _read_robot_table(root: CheckedTable, default_name: str) -> Robot:
    root.require_known(TOP_LEVEL_KEYS)
    name = _read_name(root, default_name)
    gravity = root.number("gravity", GRAVITY_RULE)
    platform = read_platform(root)
    cables = _read_cables(root, platform)
    tension, sensors, effect = root.table("tension"), root.table("sensors"), root.table("effect")
    winch, fmu = root.table("winch"), root.table("fmu")
    robot = Robot(
        name=name,
        gravity=gravity,
        platform=platform,
        tension=_read_tension_limits(tension) if tension else None,
        sensors=_read_sensors(sensors, platform.is_rigid_body) if sensors else Sensors(),
        cables=cables,
        effects=read_effects(effect, len(cables), platform.is_rigid_body) if effect else (),
        winch=_read_winch(winch) if winch else None,
        fmus=_read_fmus(fmu, len(cables)) if fmu else (),
        formulas=read_formulas(root, partial(read_cable_list, cable_count=len(cables)), platform.start),
        recorded_columns=read_recorded_columns(root, len(cables)),
        tracker=read_tracker_table(root),
        native_fmus=_read_native_fmus(fmu) if fmu else False,
    )
    require_positive_mass(root, robot)
    return robot


def _read_name(root: CheckedTable, default: str) -> str:
    if "name" not in root.content:
        return default
    hint = 'give the robot a name, as in name = "hall"'
    name = root.text("name", hint)
    if name is not None and (not name.strip() or not name.isprintable()):
        root.refuse("name", f"is {format_value(name)}, must be one line of printable text", hint)
    return name or default


def _read_tension_limits(table: CheckedTable) -> TensionLimits:
    table.require_known(("minimum", "maximum", "preferred", "preferred_uncertainty"))
    minimum, maximum = table.number("minimum", MIN_TENSION_RULE), table.number("maximum", MAX_TENSION_RULE)
    preferred = table.number("preferred", PREFERRED_TENSION_RULE)
    if minimum > maximum:
        problem = f"is {minimum!r}, must be at most the maximum, {maximum!r} N"
        table.refuse("minimum", problem, "lower minimum or raise maximum")
    elif preferred < minimum or preferred > maximum:
        problem = f"is {preferred!r}, must lie between minimum and maximum, {minimum!r} and {maximum!r} N"
        table.refuse("preferred", problem, "choose a tension between them")
    return TensionLimits(
        minimum, maximum, preferred, table.optional_number("preferred_uncertainty", PREFERRED_UNCERTAINTY_RULE)
    )


def _read_sensors(table: CheckedTable, is_rigid: bool) -> Sensors:
    table.require_known([*NOISE_RULES, *OFFSET_RULES])
    if not is_rigid:
        refuse_keys_of_rigid_bodies(table, SENSOR_KEYS)
    noises = {key: table.optional_number(key, rule) for key, rule in NOISE_RULES.items()}
    offsets = {key: table.number(key, rule) for key, rule in OFFSET_RULES.items()}
    return Sensors(
        position_noise=noises["position_noise"],
        tension_noise=noises["tension_noise"],
        winch_speed_noise=noises["winch_speed_noise"],
        orientation_noise=noises["orientation_noise"],
        **offsets,
    )


def _read_cables(root: CheckedTable, platform: Platform) -> tuple[Cable, ...]:
    entries = root.content.get("cable", [])
    tables = root.tables("cable") if "cable" in root.content else ()
    if isinstance(entries, list) and len(entries) < MIN_CABLES:
        problem = f"{len(entries)} given, a robot has two or more"
        root.refuse("cable", problem, "add one table [[cable]] for each cable")
    if len(tables) > MAX_CABLES:
        root.refuse("cable", f"{len(tables)} given, at most {MAX_CABLES} are read", "leave out the others")
        tables = tables[:MAX_CABLES]
    cables = tuple(_read_cable(table) for table in tables)
    for table in () if platform.is_rigid_body else tables:
        refuse_keys_of_rigid_bodies(table, CABLE_KEYS)
    _refuse_coincident_points(tables, cables, platform)
    return cables


def _refuse_coincident_points(tables: Sequence[CheckedTable], cables: Sequence[Cable], platform: Platform) -> None:
    """Reports cables without length at the start, and cables that another one repeats."""
    is_rigid = platform.is_rigid_body
    for index, (table, cable) in enumerate(zip(tables, cables, strict=True)):
        end = add(platform.start, rotate(platform.start_orientation, cable.attachment))
        if math.dist(cable.anchor, end) < MIN_POINT_DISTANCE:
            problem = f"is {list(cable.anchor)}, the same as {'its attachment at ' if is_rigid else ''}platform.start"
            table.refuse("anchor", problem, "move one of them")
        for other in range(index):
            are_attached_together = math.dist(cable.attachment, cables[other].attachment) < MIN_POINT_DISTANCE
            if are_attached_together and math.dist(cable.anchor, cables[other].anchor) < MIN_POINT_DISTANCE:
                problem = f"is {list(cable.anchor)}, the same as that of cable {other + 1}"
                problem += " with the same attachment" if is_rigid else ""
                table.refuse("anchor", problem, "give each cable its own exit point")


def _read_cable(table: CheckedTable) -> Cable:
    keys = ("anchor", "attachment", "swivel_axis", "modulus", "area", "damping", "law", *CABLE_UNCERTAINTY_RULES)
    table.require_known(keys)
    laws = " or ".join(f'"{law}"' for law in LAWS)
    law = table.text("law", f"write law = {laws}")
    if law is not None and law not in LAWS:
        table.refuse("law", f"is {format_value(law)}, must be {laws}", f"write {suggest_name(law, LAWS)}")
    axis_meaning = "the direction along which the rope arrives at its exit pulley"
    x, y, z = table.unit_vector("swivel_axis", axis_meaning, Cable.swivel_axis)
    return Cable(
        anchor=table.point("anchor", "the exit point on the frame"),
        modulus=table.number("modulus", MODULUS_RULE),
        area=table.number("area", AREA_RULE),
        damping=table.number("damping", DAMPING_RULE),
        law=law or "",
        attachment=table.point("attachment", "the attachment point in the platform's frame", Cable.attachment),
        swivel_axis=(x, y, z),
        **{key: table.number(key, rule) for key, rule in CABLE_UNCERTAINTY_RULES.items()},
    )


def _read_winch(table: CheckedTable) -> Winch:
    table.require_known(("drum_radius", "gear", "bandwidth", "damping_ratio", *WINCH_LIMIT_RULES))
    return Winch(
        drum_radius=table.number("drum_radius", DRUM_RADIUS_RULE),
        gear=table.number("gear", GEAR_RULE),
        bandwidth=table.number("bandwidth", BANDWIDTH_RULE),
        damping_ratio=table.number("damping_ratio", DAMPING_RATIO_RULE),
        **{key: table.optional_number(key, rule) for key, rule in WINCH_LIMIT_RULES.items()},
    )


def _read_fmus(table: CheckedTable, cable_count: int) -> tuple[UserFmu, ...]:
    table.require_known((*fmu_slots(cable_count), NATIVE_KEY))
    hint = 'name an FMU, as in platform = "mine.fmu"'
    fmus = []
    for slot in [key for key in table.content if key != NATIVE_KEY]:
        name = table.text(slot, hint)
        if name is None:
            continue
        if not name.strip() or not name.isprintable():
            table.refuse(slot, f"is {format_value(name)}, must be the path of a file", hint)
        # Absolute, so that the robot file may be written to another folder.
        fmus.append(UserFmu(slot, Path(os.path.abspath(Path(table.file).parent / name))))
    return tuple(fmus)


def _read_native_fmus(table: CheckedTable) -> bool:
    value = table.content.get(NATIVE_KEY, False)
    if not isinstance(value, bool):
        table.refuse(NATIVE_KEY, f"is {format_value(value)}, must be true or false", "give true for machine code")
    return value is True
