"""The effects and formulas of a robot as the physical laws take them, by the component on which they act."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws import point_mass
from tautwire_fmu.laws import rigid_body_effects as body_stages
from tautwire_fmu.laws.effects import BY_NAME, MODULUS, ActiveEffect
from tautwire_fmu.laws.formula import formula_effect
from tautwire_fmu.laws.mathematics import REAL, Mathematics
from tautwire_fmu.laws.rigid_body import principal_axes
from tautwire_fmu.laws.rigid_body_effects import BodyConstants
from tautwire_fmu.laws.rotation import Matrix
from tautwire_fmu.laws.vectors import Vector

from .schema import EffectSetting, Formula, Platform, Robot

IDENTITY_MATRIX = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def active_effect(setting: EffectSetting) -> ActiveEffect:
    """An effect setting with its parameter values, as the laws take it."""
    effect = BY_NAME[setting.name]
    return ActiveEffect(effect, effect.values(**effect.completed_values(setting.values)))


def cable_settings(robot: Robot, cable: int) -> tuple[EffectSetting, ...]:
    """The effect settings that act in a cable, its winch or its load cell; ``cable`` counts from 1."""
    return tuple(s for s in robot.effects_on_cable(cable) if BY_NAME[s.name].attachment is None)


def cable_effects(robot: Robot, cable: int) -> tuple[ActiveEffect, ...]:
    """The effects of :func:`cable_settings` and the formulas in the cable, as the laws take them."""
    return (*map(active_effect, cable_settings(robot, cable)), *_formula_effects(robot.formulas_on(cable)))


def cable_moduli(robot: Robot) -> tuple[float, ...]:
    """Modulus of each cable (n,) in Pa: the declared one, or that of the effect ``modulus``."""
    moduli = [cable.modulus for cable in robot.cables]
    for setting in robot.effects:
        for cable in setting.cables if setting.name == MODULUS.name else ():
            moduli[cable - 1] = setting.values["modulus"]
    return tuple(moduli)


def attachment_settings(robot: Robot, cable: int) -> tuple[EffectSetting, ...]:
    """The effect settings that shift the attachment of a cable on a rigid platform; ``cable`` counts from 1."""
    return tuple(s for s in robot.effects_on_cable(cable) if BY_NAME[s.name].attachment is not None)


def platform_effects(robot: Robot) -> tuple[ActiveEffect, ...]:
    """The effects of :func:`platform_settings` and the formulas on the platform, as the laws take them."""
    listed = [active_effect(setting) for setting in platform_settings(robot)]
    on_platform = [active._replace(effect=active.effect.on_platform()) for active in listed]
    return (*on_platform, *_formula_effects(robot.formulas_on()))


def platform_settings(robot: Robot) -> tuple[EffectSetting, ...]:
    """The effect settings that act on the platform or on its position sensor."""
    return tuple(s for s in robot.effects if not s.cables or BY_NAME[s.name].component == "sensor")


def platform_fmu_settings(robot: Robot) -> tuple[EffectSetting, ...]:
    """Those of :func:`platform_settings`, each effect once: load cells may have several of one, positions have not."""
    settings = platform_settings(robot)
    acting = [s for s in settings if not s.cables or shifts_position(s)]
    idle = {s.name: s for s in reversed(settings) if s.name not in [each.name for each in acting]}
    return tuple(s for s in settings if s in acting or s is idle.get(s.name))


def shifts_position(setting: EffectSetting) -> bool:
    """Whether a sensor effect changes the measured position, and not load cells alone."""
    effects = (active_effect(setting),)
    stage_results = (f(REAL, effects)[1] for f in (stages.sensor_gains, stages.sensor_offsets, stages.sensor_delays))
    return tuple(stage_results) != (1.0, (0.0, 0.0, 0.0), 0.0)


def has_sensor_effects(robot: Robot) -> bool:
    """Whether an effect distorts the measurements."""
    return any(BY_NAME[setting.name].component == "sensor" for setting in robot.effects)


def has_routing_effects(robot: Robot) -> bool:
    """Whether a cable does not run straight to its declared exit point."""
    effects = (BY_NAME[setting.name] for setting in robot.effects)
    return any(effect.exit_point is not None or effect.path is not None for effect in effects)


def cables_have_weight(robot: Robot) -> bool:
    """Whether the cables have weight, so that their ends carry more than the tension."""
    return any(BY_NAME[setting.name].ends is not None for setting in robot.effects)


def body_constants(robot: Robot, mathematics: Mathematics = REAL, axes: Matrix | None = None) -> BodyConstants:
    """Constants of a rigid platform with its effects; ``mathematics`` are the functions for the effects' parameters.

    ``axes`` are the principal axes, by default those of the declared inertia, which then has to be of numbers.
    """
    platform = robot.platform
    assert platform.inertia is not None
    declared = BodyConstants(
        platform.mass,
        platform.inertia,
        platform_axes(platform) if axes is None else axes,
        platform.centre_of_mass,
        robot.attachments,
    )
    shifting = [tuple(map(active_effect, settings)) for settings in _attachment_settings(robot)]
    return body_stages.constants_with_effects(mathematics, declared, platform_effects(robot), shifting)


def total_mass(robot: Robot, mathematics: Mathematics = REAL) -> Any:
    """Mass of the platform with payload, in kg; at the start where a formula changes it."""
    constants = point_mass.PointMassConstants(robot.platform.mass, robot.gravity)
    return point_mass.total_mass(mathematics, constants, platform_effects(robot))


def centre_of_mass(robot: Robot, mathematics: Mathematics = REAL) -> Vector:
    """Centre of mass of the platform with its effects, in its frame, in m; its origin for a point mass."""
    if not robot.platform.is_rigid_body:
        return robot.platform.centre_of_mass
    # Principal axes do not matter to it, and of symbols there are none.
    return body_constants(robot, mathematics, IDENTITY_MATRIX).centre_of_mass


def attachments(robot: Robot, mathematics: Mathematics = REAL) -> tuple[Vector, ...]:
    """Attachments of all cables on a rigid platform with the effects that shift them, in its frame, in m."""
    return tuple(
        body_stages.shifted_attachment(mathematics, declared, tuple(map(active_effect, settings)))
        for declared, settings in zip(robot.attachments, _attachment_settings(robot), strict=True)
    )


def platform_axes(platform: Platform) -> Matrix:
    """Principal axes of a rigid platform in its frame, unit vectors by rows."""
    assert platform.inertia is not None
    return principal_axes(platform.inertia)


def _attachment_settings(robot: Robot) -> list[tuple[EffectSetting, ...]]:
    return [attachment_settings(robot, cable) for cable in robot.cable_numbers]


def formula_texts(formulas: Sequence[Formula]) -> dict[str, list[str]]:
    """The texts of some formulas by their targets."""
    return {
        target: [f.text for f in formulas if f.target == target] for target in dict.fromkeys(f.target for f in formulas)
    }


def _formula_effects(formulas: Sequence[Formula]) -> tuple[ActiveEffect, ...]:
    """All formulas of a component as one effect; empty without formulas."""
    if not formulas:
        return ()
    numbers = {name: value for formula in formulas for name, value in formula.numbers.items()}
    return (ActiveEffect(formula_effect(formula_texts(formulas), tuple(numbers)), numbers),)
