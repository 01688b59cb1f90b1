"""A robot as the text of a robot file."""

import json
from collections.abc import Sequence

from tautwire_fmu.laws.effects import BY_NAME
from tautwire_fmu.laws.formula import PLACES

from .robot import PER_CABLE, Cable, EffectSetting, Formula, OwnFmu, Point, Robot, Sensors, TensionLimits, Winch


def robot_text(robot: Robot) -> str:
    """The robot as a commented TOML file; every number reads back exactly."""
    # TOML has JSON's strings, except that it wants no surrogate pairs: characters stand for themselves.
    blocks = [
        [
            f"name = {json.dumps(robot.name, ensure_ascii=False)}",
            _number("gravity", robot.gravity, "m/s^2"),
        ],
        [
            "[platform]",
            _number("mass", robot.platform.mass, "kg"),
            _point("start", robot.platform.start, "m, where the run starts at rest"),
            *_deviation("mass_uncertainty", robot.platform.mass_uncertainty, "kg"),
        ],
        _tension(robot.tension) if robot.tension else [],
        _sensors(robot.sensors),
        _winch(robot.winch) if robot.winch else [],
        _fmus(robot.fmus),
        *(_cable(number, cable) for number, cable in enumerate(robot.cables, 1)),
        *(_effect(robot, setting) for setting in robot.effects),
        *_formulas(robot),
    ]
    return "\n\n".join("\n".join(block) for block in blocks if block) + "\n"


def _number(key: str, value: float, comment: str) -> str:
    return f"{key} = {float(value)!r}" + (f"  # {comment}" if comment else "")


def _deviation(key: str, value: float, unit: str) -> list[str]:
    return [_number(key, value, f"{unit}, standard deviation")] if value > 0.0 else []


def _point(key: str, point: Point, comment: str) -> str:
    return f"{key} = [{', '.join(repr(float(value)) for value in point)}]  # {comment}"


def _tension(tension: TensionLimits) -> list[str]:
    return [
        "[tension]",
        _number("minimum", tension.minimum, "N"),
        _number("maximum", tension.maximum, "N"),
        _number("preferred", tension.preferred, "N"),
        *_uncertainty(tension.preferred_uncertainty),
    ]


def _uncertainty(deviation: float | None) -> list[str]:
    return [] if deviation is None else [_number("preferred_uncertainty", deviation, "N, standard deviation")]


def _sensors(sensors: Sensors) -> list[str]:
    noises = (
        ("position_noise", sensors.position_noise, "m"),
        ("tension_noise", sensors.tension_noise, "N"),
        ("winch_speed_noise", sensors.winch_speed_noise, "m/s"),
    )
    lines = [_number(key, value, unit) for key, value, unit in noises if value is not None]
    lines += _deviation("tension_offset_uncertainty", sensors.tension_offset_uncertainty, "N")
    lines += _deviation("position_offset_uncertainty", sensors.position_offset_uncertainty, "m")
    return ["[sensors]  # standard deviation of one sample", *lines] if lines else []


def _winch(winch: Winch) -> list[str]:
    limits = (("speed_limit", winch.speed_limit, "m/s"), ("acceleration_limit", winch.acceleration_limit, "m/s^2"))
    return [
        "[winch]",
        _number("drum_radius", winch.drum_radius, "m"),
        _number("gear", winch.gear, "motor turns a drum turn"),
        _number("bandwidth", winch.bandwidth, "Hz, natural frequency of the speed loop"),
        _number("damping_ratio", winch.damping_ratio, ""),
        *(_number(key, value, f"{unit}, of the rope") for key, value, unit in limits if value is not None),
    ]


def _fmus(fmus: Sequence[OwnFmu]) -> list[str]:
    lines = [f"{fmu.slot} = {json.dumps(str(fmu.path), ensure_ascii=False)}" for fmu in fmus]
    return ["[fmu]  # in place of the project's own", *lines] if lines else []


def _cable(number: int, cable: Cable) -> list[str]:
    return [
        f"[[cable]]  # cable {number}",
        _point("anchor", cable.anchor, "m, exit point on the frame"),
        _number("modulus", cable.modulus, "Pa"),
        _number("area", cable.area, "m^2"),
        _number("damping", cable.damping, "Pa s"),
        f"law = {json.dumps(cable.law, ensure_ascii=False)}",
        *_deviation("modulus_uncertainty", cable.modulus_uncertainty, "Pa"),
        *_deviation("damping_uncertainty", cable.damping_uncertainty, "Pa s"),
    ]


def _effect(robot: Robot, setting: EffectSetting) -> list[str]:
    effect = BY_NAME.get(setting.name)
    units = {parameter.name: parameter.unit for parameter in effect.parameters} if effect else {}
    neutral = {parameter.name: parameter.neutral for parameter in effect.parameters} if effect else {}
    told = {name: value for name, value in setting.values.items() if value != neutral.get(name)} or setting.values
    alone = sum(other.name == setting.name for other in robot.effects) == 1
    header = f"[effect.{setting.name}]" if alone else f"[[effect.{setting.name}]]"
    lines = [header + (f"  # {effect.description}" if effect else "")]
    lines += [_number(name, value, units.get(name, "")) for name, value in told.items()]
    per_cable = effect is not None and effect.component in PER_CABLE
    # All cables is what the absent key means; an empty list is kept visible, for the reader to refuse.
    if (per_cable or setting.cables) and setting.cables != robot.cable_numbers:
        lines.append(f"cables = {list(setting.cables)}")
    return lines


def _formulas(robot: Robot) -> list[list[str]]:
    """As few tables as read back in the same order."""
    order = list(PLACES)
    groups: list[list[Formula]] = []
    for formula in robot.formulas:
        if not groups or order.index(formula.place) <= order.index(groups[-1][-1].place):
            groups.append([])
        groups[-1].append(formula)
    header = "[formula]" if len(groups) == 1 else "[[formula]]"
    return [[f"{header}  # N, mass in kg", *_formula_lines(robot, group)] for group in groups]


def _formula_lines(robot: Robot, group: Sequence[Formula]) -> list[str]:
    lines = [f"{formula.place} = {json.dumps(formula.text)}" for formula in group]
    cables = [formula.cables for formula in group if formula.cables and formula.cables != robot.cable_numbers]
    return [*lines, *(f"cables = {list(some)}" for some in cables)]
