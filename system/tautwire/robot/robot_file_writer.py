"""The text of a robot file: of a robot in memory, or a commented template for a new one."""

from __future__ import annotations

import json
from collections.abc import Sequence
from math import cos, pi, sin

from tautwire_fmu.laws.effects import BY_NAME
from tautwire_fmu.laws.formula import VARIABLES_BY_TARGET

from .schema import (
    PER_CABLE_COMPONENTS,
    Cable,
    EffectSetting,
    Formula,
    Point,
    Robot,
    Sensors,
    TensionLimits,
    UserFmu,
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
        [
            "[platform]",
            _number_line("mass", robot.platform.mass, "kg"),
            _point_line("start", robot.platform.start, "m, where the run starts at rest"),
            *_deviation_line("mass_uncertainty", robot.platform.mass_uncertainty, "kg"),
        ],
        _tension_block(robot.tension) if robot.tension else [],
        _sensor_block(robot.sensors),
        _winch_block(robot.winch) if robot.winch else [],
        _fmu_block(robot.fmus),
        *(_cable_block(number, cable) for number, cable in enumerate(robot.cables, 1)),
        *(_effect_block(robot, setting) for setting in robot.effects),
        *_formula_blocks(robot),
    ]
    return "\n\n".join("\n".join(block) for block in blocks if block) + "\n"


def _number_line(key: str, value: float, comment: str) -> str:
    return f"{key} = {float(value)!r}" + (f"  # {comment}" if comment else "")


def _deviation_line(key: str, value: float, unit: str) -> list[str]:
    return [_number_line(key, value, f"{unit}, standard deviation")] if value > 0.0 else []


def _point_line(key: str, point: Point, comment: str) -> str:
    return f"{key} = [{', '.join(repr(float(value)) for value in point)}]  # {comment}"


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
    )
    lines = [_number_line(key, value, unit) for key, value, unit in noises if value is not None]
    lines += _deviation_line("tension_offset_uncertainty", sensors.tension_offset_uncertainty, "N")
    lines += _deviation_line("position_offset_uncertainty", sensors.position_offset_uncertainty, "m")
    return ["[sensors]  # standard deviation of one sample", *lines] if lines else []


def _winch_block(winch: Winch) -> list[str]:
    limits = (("speed_limit", winch.speed_limit, "m/s"), ("acceleration_limit", winch.acceleration_limit, "m/s^2"))
    return [
        "[winch]",
        _number_line("drum_radius", winch.drum_radius, "m"),
        _number_line("gear", winch.gear, "motor turns a drum turn"),
        _number_line("bandwidth", winch.bandwidth, "Hz, natural frequency of the speed loop"),
        _number_line("damping_ratio", winch.damping_ratio, ""),
        *(_number_line(key, value, f"{unit}, of the rope") for key, value, unit in limits if value is not None),
    ]


def _fmu_block(fmus: Sequence[UserFmu]) -> list[str]:
    lines = [f"{fmu.slot} = {json.dumps(str(fmu.path), ensure_ascii=False)}" for fmu in fmus]
    return ["[fmu]  # in place of the project's own", *lines] if lines else []


def _cable_block(number: int, cable: Cable) -> list[str]:
    return [
        f"[[cable]]  # cable {number}",
        _point_line("anchor", cable.anchor, "m, exit point on the frame"),
        _number_line("modulus", cable.modulus, "Pa"),
        _number_line("area", cable.area, "m^2"),
        _number_line("damping", cable.damping, "Pa s"),
        f"law = {json.dumps(cable.law, ensure_ascii=False)}",
        *_deviation_line("modulus_uncertainty", cable.modulus_uncertainty, "Pa"),
        *_deviation_line("damping_uncertainty", cable.damping_uncertainty, "Pa s"),
    ]


def _effect_block(robot: Robot, setting: EffectSetting) -> list[str]:
    effect = BY_NAME.get(setting.name)
    units = {parameter.name: parameter.unit for parameter in effect.parameters} if effect else {}
    neutral = {parameter.name: parameter.neutral for parameter in effect.parameters} if effect else {}
    written_values = {
        name: value for name, value in setting.values.items() if value != neutral.get(name)
    } or setting.values
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


MIN_TEMPLATE_CABLES, MAX_TEMPLATE_CABLES = 3, 12

TEMPLATE_HEAD = """\
# A cable-driven robot. SI units throughout; z points up; cables count from 1 in the order of this file.
# The numbers are an example, of a frame of 8 m: put in yours, then run "tautwire check" on this file.

name = {name}
gravity = 9.81                    # m/s^2

[platform]
mass = 50.0                       # kg, a point mass
start = [0.0, 0.0, 2.0]           # m, where every run starts at rest
# mass_uncertainty = 0.5          # kg, how far the true mass may be from that; a standard deviation, as all of these

# With more than three cables statics leaves a choice: within these bounds, the start tensions are those nearest to the
# preferred one. With three they are not used.
[tension]
minimum = 50.0                    # N
maximum = 5000.0                  # N
preferred = {preferred}                 # N
# preferred_uncertainty = 50.0    # N, how far true start tensions may be from that

# How much noise one sample has, as a standard deviation; take out what you do not know.
[sensors]
position_noise = 2e-4             # m
tension_noise = 1.0               # N
winch_speed_noise = 1e-4          # m/s
# tension_offset_uncertainty = 2.0    # N, what a load cell may show too much all the time
# position_offset_uncertainty = 1e-3  # m, likewise of the tracker, on each axis

# One table for each cable, three or more. The law of tension is T = E S eps + c S deps/dt + T0.
"""
TEMPLATE_CABLE = """
[[cable]]  # cable {number}
anchor = [{x}, {y}, {z}]  # m, where the cable leaves the frame
modulus = 1.0e11                  # Pa, E: steel rope about 1e11, braided polyethylene about 6e10
area = 3.0e-6                     # m^2, S, the section that the modulus refers to
damping = 1.0e9                   # Pa s, c; 0 when absent
law = "logarithmic"               # eps is ln(l/l_u); or "linear", l/l_u - 1
# modulus_uncertainty = 2e9       # Pa
# damping_uncertainty = 1e8       # Pa s
"""
TEMPLATE_TAIL = """
# Winches that follow the speed asked of them only so fast; without this table the rope runs exactly at that speed.
# [winch]
# drum_radius = 0.1               # m
# gear = 20.0                     # motor turns for one turn of the drum
# bandwidth = 10.0                # Hz, natural frequency of the speed loop
# damping_ratio = 1.0
# speed_limit = 1.0               # m/s, of the rope
# acceleration_limit = 5.0        # m/s^2

# Effects that the plain robot lacks; "tautwire trace" finds them from a recording and writes such tables.
# [effect.payload]
# mass = 5.0                      # kg

# [effect.modulus]
# modulus = 0.9e11                # Pa, in place of the declared one
# cables = [2]                    # all cables without this line

# What no known effect is, as arithmetic.
# [formula]
# force_x = "-20*vx"              # N, on the platform

# FMUs of your own in place of the project's, from this file's folder.
# [fmu]
# platform = "mine.fmu"
"""


def new_robot_text(name: str, cable_count: int = MIN_TEMPLATE_CABLES) -> str:
    """The text of a template robot file with 3 to 12 cables, which can be built and run as it is.

    Exit points lie evenly on a circle above the platform; from six cables on, every second one below it.
    """
    has_lower_anchors = cable_count >= 6
    head = TEMPLATE_HEAD.format(
        name=json.dumps(name, ensure_ascii=False), preferred="600.0" if has_lower_anchors else "250.0"
    )
    return (
        head
        + "".join(_template_cable(number, cable_count, has_lower_anchors) for number in range(1, cable_count + 1))
        + TEMPLATE_TAIL
    )


def _template_cable(number: int, cable_count: int, has_lower_anchors: bool) -> str:
    angle = 2.0 * pi * (number - 1) / cable_count
    x, y = (round(4.0 * part, 3) + 0.0 for part in (cos(angle), sin(angle)))
    return TEMPLATE_CABLE.format(number=number, x=x, y=y, z=0.0 if has_lower_anchors and number % 2 == 0 else 5.0)
