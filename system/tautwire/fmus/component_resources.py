"""Resources of FMUs: the data of each component that lie inside its FMU as JSON."""

from __future__ import annotations

from typing import Any

from tautwire_fmu.laws.effects import BY_NAME
from tautwire_fmu.laws.winch_drive import NO_LIMIT

from ..robot.active_effects import attachment_settings, cable_settings, formula_texts, platform_fmu_settings
from ..robot.robot_assembly import assemble_robot
from ..robot.schema import EffectSetting, Robot
from ..robot.static_equilibrium import start_attachments, start_orientation, static_forces


def cable_resources(robot: Robot) -> list[dict[str, Any]]:
    """Resources ``cable.json`` of the cable FMUs."""
    return [
        {
            "description": f"cable {index} of {robot.name}",
            "law": cable.law,
            "anchor": list(cable.anchor),
            "swivel_axis": list(cable.swivel_axis),
            "start": list(start),
            "start_length": component.constants.start_length,
            "start_tension": float(component.constants.start_tension),
            "modulus": cable.modulus,
            "area": cable.area,
            "damping": cable.damping,
            "gravity": robot.gravity,
            "effects": [_effect_resource(s) for s in cable_settings(robot, index)],
            "formulas": formula_texts(robot.formulas_on(index)),
        }
        for index, (cable, component, start) in enumerate(
            zip(robot.cables, assemble_robot(robot).cables, start_attachments(robot), strict=True), start=1
        )
    ]


def platform_resource(robot: Robot) -> dict[str, Any]:
    """Resource ``point_mass.json`` or ``rigid_body.json`` of the platform FMU."""
    forces = static_forces(robot)
    return _rotation_resource(robot) | {
        "description": f"platform of {robot.name}",
        "mass": robot.platform.mass,
        "gravity": robot.gravity,
        "start": list(robot.platform.start),
        "start_velocity": list(assemble_robot(robot).velocity),
        "start_forces": forces.tolist(),
        "effects": [*map(_effect_resource, platform_fmu_settings(robot)), *_attachment_resources(robot)],
        "formulas": formula_texts(robot.formulas_on()),
    }


def _rotation_resource(robot: Robot) -> dict[str, Any]:
    """What a rigid platform has beside the values of a point mass."""
    if robot.platform.inertia is None:
        return {}
    return {
        "inertia": [list(row) for row in robot.platform.inertia],
        "centre_of_mass": list(robot.platform.centre_of_mass),
        "start_orientation": list(start_orientation(robot)),
        "start_angular_velocity": list(assemble_robot(robot).angular_velocity),
        "attachments": [list(attachment) for attachment in robot.attachments],
        "start_attachments": [list(attachment) for attachment in start_attachments(robot)],
    }


def robot_resource(robot: Robot) -> dict[str, Any]:
    """Resource of a whole robot: those of its components, and what its page tells of them together."""
    platform, cables = platform_resource(robot), cable_resources(robot)
    parts = {"platform": platform, **{f"cable_{i}": each for i, each in enumerate(cables, start=1)}}
    effects = [effect for each in parts.values() for effect in each["effects"]]
    formulas = {
        f"{name}, {quantity}": texts for name, each in parts.items() for quantity, texts in each["formulas"].items()
    }
    components = "platform, cables and winches" if robot.winch else "platform and cables"
    return {
        "description": f"{robot.name}: {components} in one",
        "is_rigid": robot.platform.is_rigid_body,
        "platform": platform,
        "cables": cables,
        "winches": [winch_resource(robot, i) for i in robot.winch_numbers],
        "effects": list({effect["name"]: effect for effect in effects}.values()),
        "formulas": formulas,
    }


def winch_resource(robot: Robot, cable: int) -> dict[str, Any]:
    """Resource ``winch.json`` of the winch FMU of a cable, counted from 1."""
    declared = {} if robot.winch is None else vars(robot.winch)
    limited_values = {name: NO_LIMIT if value is None else value for name, value in declared.items()}
    return {"description": f"winch {cable} of {robot.name}", **limited_values}


def _effect_resource(setting: EffectSetting) -> dict[str, Any]:
    return {"name": setting.name, "values": BY_NAME[setting.name].completed_values(setting.values)}


def _attachment_resources(robot: Robot) -> list[dict[str, Any]]:
    """The effects that shift attachments, each once for every cable."""
    if not robot.platform.is_rigid_body:
        return []
    return [
        _effect_resource(setting) | {"cable": cable}
        for cable in robot.cable_numbers
        for setting in attachment_settings(robot, cable)
    ]
