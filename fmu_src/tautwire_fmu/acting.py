"""The effects that act on a component, by its resource: their variables, and their values."""

from typing import Any, Dict, Sequence, Tuple

from .description import Variable
from .laws.effects import BY_NAME, ActiveEffect, Effect
from .laws.formula import formula_effect


def effect_variables(settings: Sequence[Dict[str, Any]]) -> Tuple[Variable, ...]:
    """A tunable parameter for every number of every effect that is switched on."""
    return tuple(
        Variable(
            f"effect.{setting['name']}.{parameter.name}",
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


def effects_of(data: Dict[str, Any]) -> Tuple[Effect, ...]:
    """The effects that act on a component, by its resource: those switched on, then its formulas if it has any."""
    listed = [BY_NAME[setting["name"]] for setting in data["effects"]]
    return (*listed, formula_effect(data["formulas"])) if data.get("formulas") else tuple(listed)


def effect_states(data: Dict[str, Any]) -> Tuple[Variable, ...]:
    """A local variable for every state of every effect."""
    return tuple(
        Variable(f"effect.{effect.name}.{state.name}", "local", state.unit, f"state: {state.description}")
        for effect in effects_of(data)
        for state in effect.states
    )


def active_effects(effects: Sequence[Effect], numbers: Sequence[float]) -> Tuple[ActiveEffect, ...]:
    """The effects with the present values of their parameters."""
    active = []
    rest = list(numbers)
    for effect in effects:
        count = len(effect.parameters)
        active.append(ActiveEffect(effect, effect.values(*rest[:count])))
        rest = rest[count:]
    return tuple(active)
