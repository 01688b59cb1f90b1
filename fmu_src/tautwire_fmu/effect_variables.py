"""FMI variables and parameter values of the effects that act on a component."""

from typing import Any, Dict, Sequence, Tuple

from .laws.effects import BY_NAME, ActiveEffect, Effect
from .laws.formula import formula_effect
from .model_description import Variable


def effect_variables(settings: Sequence[Dict[str, Any]]) -> Tuple[Variable, ...]:
    """Tunable FMI parameters, one for every parameter of every effect that is switched on.

    An effect that a platform has for one ``cable`` has its number behind the name, as in ``effect.attachment_2.x``.
    """
    return tuple(
        Variable(
            f"effect.{setting_name(setting)}.{parameter.name}",
            "parameter",
            parameter.unit,
            parameter.description,
            start=float(setting["values"][parameter.name]),
            tunable=True,
            minimum=parameter.minimum,
            maximum=parameter.maximum,
        )
        for setting in settings
        for parameter in BY_NAME[setting["name"]].parameters
    )


def setting_name(setting: Dict[str, Any]) -> str:
    """Name of an effect that is switched on, with the number of the cable for which a platform has it."""
    return f"{setting['name']}_{setting['cable']}" if "cable" in setting else str(setting["name"])


def effects_from_resource(data: Dict[str, Any]) -> Tuple[Effect, ...]:
    """Effects that act on a component, by its resource: those switched on, then its formulas if it has any."""
    listed_effects = [BY_NAME[setting["name"]] for setting in data["effects"]]
    if "law" not in data:
        listed_effects = [effect.on_platform() for effect in listed_effects]
    return (*listed_effects, formula_effect(data["formulas"])) if data.get("formulas") else tuple(listed_effects)


def effect_state_variables(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    """Local FMI variables, one for every state of every effect."""
    return tuple(
        Variable(f"effect.{effect.name}.{state.name}", "local", state.unit, f"state: {state.description}")
        for effect in effects_from_resource(data)
        for state in effect.states
    )


def active_effects(effects: Sequence[Effect], parameter_values: Sequence[float]) -> Tuple[ActiveEffect, ...]:
    """Effects with the present values of their parameters."""
    active = []
    remaining = list(parameter_values)
    for effect in effects:
        count = len(effect.parameters)
        active.append(ActiveEffect(effect, effect.values(*remaining[:count])))
        remaining = remaining[count:]
    return tuple(active)
