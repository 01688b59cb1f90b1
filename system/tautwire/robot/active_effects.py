"""The effects and formulas of a robot as the physical laws take them, by the component on which they act."""

from __future__ import annotations

from collections.abc import Sequence

from tautwire_fmu.laws import effect_stages as stages
from tautwire_fmu.laws.effects import BY_NAME, ActiveEffect
from tautwire_fmu.laws.formula import formula_effect
from tautwire_fmu.laws.mathematics import REAL

from .schema import EffectSetting, Formula, Robot


def active_effect(setting: EffectSetting) -> ActiveEffect:
    """An effect setting with its parameter values, as the laws take it."""
    effect = BY_NAME[setting.name]
    return ActiveEffect(effect, effect.values(**effect.completed_values(setting.values)))


def cable_effects(robot: Robot, cable: int) -> tuple[ActiveEffect, ...]:
    """The effects and formulas that act on a cable, its winch or its load cell; ``cable`` counts from 1."""
    return (*map(active_effect, robot.effects_on_cable(cable)), *_formula_effects(robot.formulas_on(cable)))


def platform_effects(robot: Robot) -> tuple[ActiveEffect, ...]:
    """The effects of :func:`platform_settings` and the formulas on the platform, as the laws take them."""
    return (*map(active_effect, platform_settings(robot)), *_formula_effects(robot.formulas_on()))


def platform_settings(robot: Robot) -> tuple[EffectSetting, ...]:
    """The effect settings that act on the platform or on its position sensor."""
    return tuple(s for s in robot.effects if not s.cables or BY_NAME[s.name].component == "sensor")


def platform_fmu_settings(robot: Robot) -> tuple[EffectSetting, ...]:
    """Those of :func:`platform_settings`, each effect once: load cells may have several of one, positions have not."""
    settings = platform_settings(robot)
    acting = [s for s in settings if not s.cables or _shifts_position(s)]
    idle = {s.name: s for s in reversed(settings) if s.name not in [each.name for each in acting]}
    return tuple(s for s in settings if s in acting or s is idle.get(s.name))


def _shifts_position(setting: EffectSetting) -> bool:
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
