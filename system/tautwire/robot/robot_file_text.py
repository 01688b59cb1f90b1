"""The text of a robot file: commented TOML that reads back as an equal robot."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace

from tautwire_fmu.laws.effects import BY_NAME
from tautwire_fmu.laws.formula import VARIABLES_BY_TARGET

from .checked_table import normalised
from .recorded_columns import COLUMN_NUMBERS
from .schema import (
    PER_CABLE_COMPONENTS,
    Cable,
    EffectSetting,
    Formula,
    Platform,
    RecordedColumn,
    Robot,
    Sensors,
    TensionLimits,
    Tracker,
    Winch,
)


def robot_text(robot: Robot) -> str:
    """The robot as a commented TOML file; every number reads back exactly."""
    # TOML strings are JSON strings without surrogate pairs: characters are written as they are.
    blocks = [
        [
            f"name = {json.dumps(robot.name, ensure_ascii=False)}",
            _number_line("gravity", robot.gravity, "m/s^2"),
        ],
        _platform_block(robot.platform),
        _tension_block(robot.tension) if robot.tension else [],
        _sensor_block(robot.sensors),
        _winch_block(robot.winch) if robot.winch else [],
        _fmu_block(robot),
        *(_cable_block(n, cable, robot.platform.is_rigid_body) for n, cable in enumerate(robot.cables, 1)),
        *(_effect_block(robot, setting) for setting in robot.effects),
        *_formula_blocks(robot),
        _recorded_column_block(robot.recorded_columns, "[recording.columns]  # by the laboratory's names"),
        _tracker_block(robot.tracker),
        _recorded_column_block(robot.tracker.columns, "[recording.tracker.columns]"),
    ]
    return "\n\n".join("\n".join(block) for block in blocks if block) + "\n"


def completed_robot(robot: Robot) -> Robot:
    """The robot with the neutral values of its effects filled in, and its unit vectors normalised."""
    effects = (replace(s, values=BY_NAME[s.name].completed_values(s.values)) for s in robot.effects)
    axes = [normalised(cable.swivel_axis) for cable in robot.cables]
    cables = (replace(cable, swivel_axis=(x, y, z)) for cable, (x, y, z) in zip(robot.cables, axes, strict=True))
    w, x, y, z = normalised(robot.platform.start_orientation)
    platform = replace(robot.platform, start_orientation=(w, x, y, z))
    return replace(robot, platform=platform, cables=tuple(cables), effects=tuple(effects))


def _number_line(key: str, value: float, comment: str) -> str:
    return f"{key} = {float(value)!r}" + (f"  # {comment}" if comment else "")


def _deviation_line(key: str, value: float, unit: str) -> list[str]:
    return [_number_line(key, value, f"{unit}, standard deviation")] if value > 0.0 else []


def _list_line(key: str, numbers: Sequence[float], comment: str) -> str:
    return f"{key} = {_listed(numbers)}  # {comment}"


def _listed(numbers: Sequence[float]) -> str:
    return f"[{', '.join(repr(float(value)) for value in numbers)}]"


def _platform_block(platform: Platform) -> list[str]:
    lines = [
        "[platform]",
        _number_line("mass", platform.mass, "kg"),
        _list_line("start", platform.start, "m, where the run starts at rest"),
    ]
    if platform.inertia is not None:
        rows = ", ".join(map(_listed, platform.inertia))
        lines += [
            f"inertia = [{rows}]  # kg m^2, about the centre of mass, in the platform's axes",
            _list_line("centre_of_mass", platform.centre_of_mass, "m, in the platform's frame"),
            _list_line("start_orientation", platform.start_orientation, "w, x, y, z, platform to world"),
        ]
    lines += _deviation_line("mass_uncertainty", platform.mass_uncertainty, "kg")
    lines += _deviation_line("inertia_uncertainty", platform.inertia_uncertainty, "kg m^2, of each principal moment")
    return lines + _deviation_line(
        "centre_of_mass_uncertainty", platform.centre_of_mass_uncertainty, "m, of each coordinate"
    )


def _tension_block(tension: TensionLimits) -> list[str]:
    return [
        "[tension]",
        _number_line("minimum", tension.minimum, "N"),
        _number_line("maximum", tension.maximum, "N"),
        _number_line("preferred", tension.preferred, "N"),
        *_uncertainty_line(tension.preferred_uncertainty),
    ]


def _uncertainty_line(deviation: float | None) -> list[str]:
    return [] if deviation is None else [_number_line("preferred_uncertainty", deviation, "N, standard deviation")]


def _sensor_block(sensors: Sensors) -> list[str]:
    noises = (
        ("position_noise", sensors.position_noise, "m"),
        ("tension_noise", sensors.tension_noise, "N"),
        ("winch_speed_noise", sensors.winch_speed_noise, "m/s"),
        ("orientation_noise", sensors.orientation_noise, "rad, about each axis"),
    )
    lines = [_number_line(key, value, unit) for key, value, unit in noises if value is not None]
    lines += _deviation_line("tension_offset_uncertainty", sensors.tension_offset_uncertainty, "N")
    lines += _deviation_line("position_offset_uncertainty", sensors.position_offset_uncertainty, "m")
    lines += _deviation_line("tension_gain_uncertainty", sensors.tension_gain_uncertainty, "of 1")
    return ["[sensors]  # standard deviation of one sample", *lines] if lines else []


def _winch_block(winch: Winch) -> list[str]:
    limits = (("speed_limit", winch.speed_limit, "m/s"), ("acceleration_limit", winch.acceleration_limit, "m/s^2"))
    return [
        "[winch]",
        _number_line("drum_radius", winch.drum_radius, "m"),
        _number_line("gear", winch.gear, "motor turns per drum turn"),
        _number_line("bandwidth", winch.bandwidth, "Hz, natural frequency of the speed loop"),
        _number_line("damping_ratio", winch.damping_ratio, ""),
        *(_number_line(key, value, f"{unit}, of the rope") for key, value, unit in limits if value is not None),
    ]


def _fmu_block(robot: Robot) -> list[str]:
    lines = [f"{fmu.slot} = {json.dumps(str(fmu.path), ensure_ascii=False)}" for fmu in robot.fmus]
    heading = "[fmu]  # instead of the project's own" if lines else "[fmu]"
    native_lines = ["native = true  # machine code"] if robot.native_fmus else []
    return [heading, *native_lines, *lines] if native_lines or lines else []


def _cable_block(number: int, cable: Cable, has_attachment: bool) -> list[str]:
    attachment = _list_line("attachment", cable.attachment, "m, in the platform's frame")
    swivel_axis = _list_line("swivel_axis", cable.swivel_axis, "along which the rope arrives at its pulley")
    return [
        f"[[cable]]  # cable {number}",
        _list_line("anchor", cable.anchor, "m, exit point on the frame"),
        *([attachment] if has_attachment else []),
        *([swivel_axis] if cable.swivel_axis != Cable.swivel_axis else []),
        _number_line("modulus", cable.modulus, "Pa"),
        _number_line("area", cable.area, "m^2"),
        _number_line("damping", cable.damping, "Pa s"),
        f"law = {json.dumps(cable.law, ensure_ascii=False)}",
        *_deviation_line("modulus_uncertainty", cable.modulus_uncertainty, "Pa"),
        *_deviation_line("damping_uncertainty", cable.damping_uncertainty, "Pa s"),
        *_deviation_line("anchor_uncertainty", cable.anchor_uncertainty, "m, of each coordinate"),
        *_deviation_line("attachment_uncertainty", cable.attachment_uncertainty, "m, of each coordinate"),
    ]


def _effect_block(robot: Robot, setting: EffectSetting) -> list[str]:
    effect = BY_NAME.get(setting.name)
    units = {parameter.name: parameter.unit for parameter in effect.parameters} if effect else {}
    neutral = {parameter.name: parameter.neutral for parameter in effect.parameters} if effect else {}
    written_values = {name: value for name, value in setting.values.items() if value != neutral.get(name)}
    if not written_values:
        # Of an effect that is absent its first parameter stands for all: others may be of rigid bodies alone.
        names = [name for name in (*units, *setting.values) if name in setting.values]
        written_values = {name: setting.values[name] for name in names[:1]}
    is_single = sum(other.name == setting.name for other in robot.effects) == 1
    header = f"[effect.{setting.name}]" if is_single else f"[[effect.{setting.name}]]"
    lines = [header + (f"  # {effect.description}" if effect else "")]
    lines += [_number_line(name, value, units.get(name, "")) for name, value in written_values.items()]
    per_cable = effect is not None and effect.component in PER_CABLE_COMPONENTS
    # An absent key means all cables; an empty list is written, for the reader to refuse.
    if (per_cable or setting.cables) and setting.cables != robot.cable_numbers:
        lines.append(f"cables = {list(setting.cables)}")
    return lines


def _formula_blocks(robot: Robot) -> list[list[str]]:
    """Groups formulas into as few tables as read back in the same order."""
    order = list(VARIABLES_BY_TARGET)
    groups: list[list[Formula]] = []
    for formula in robot.formulas:
        if not groups or order.index(formula.target) <= order.index(groups[-1][-1].target):
            groups.append([])
        groups[-1].append(formula)
    header = "[formula]" if len(groups) == 1 else "[[formula]]"
    return [[f"{header}  # N, mass in kg", *_formula_lines(robot, group)] for group in groups]


def _formula_lines(robot: Robot, group: Sequence[Formula]) -> list[str]:
    lines = [f"{formula.target} = {json.dumps(formula.text)}" for formula in group]
    cables = [formula.cables for formula in group if formula.cables and formula.cables != robot.cable_numbers]
    return [*lines, *(f"cables = {list(some)}" for some in cables)]


def _recorded_column_block(columns: Sequence[RecordedColumn], table: str) -> list[str]:
    return [table, *map(recorded_column_line, columns)] if columns else []


def _tracker_block(tracker: Tracker) -> list[str]:
    if tracker.clock_offset is None:
        return []
    offset = _number_line("clock_offset", tracker.clock_offset, "s, at the first sample of the winches' log")
    return ["[recording.tracker]", offset, f"clock_rate = {tracker.clock_rate!r}"]


def recorded_column_line(column: RecordedColumn) -> str:
    """The TOML line that declares a column of recordings by the laboratory's name."""
    entries = [f"name = {json.dumps(column.name, ensure_ascii=False)}"]
    entries += [f"unit = {json.dumps(column.unit, ensure_ascii=False)}"] if column.unit else []
    for key, rule in COLUMN_NUMBERS.items():
        value = getattr(column, key)
        entries += [f"{key} = {int(value) if key == 'sign' else float(value)!r}"] if value != rule.default else []
    key = column.column if column.column.isidentifier() else json.dumps(column.column)
    return f"{key} = {{ {', '.join(entries)} }}"
