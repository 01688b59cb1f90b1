"""Thermal expansion: a rope that grows with its temperature."""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter, State


class Values(NamedTuple):
    """Thermal expansion coefficient, and the temperature: a rise that settles, and a steady rate."""

    expansion: Any
    rise: Any
    time: Any
    rate: Any


def free_strain(m: Mathematics, values: Values, states: Tuple[Any, ...]) -> Any:
    """``alpha (D (1 - exp(-t / tau)) + R t)``."""
    elapsed = states[0]
    temperature_change = values.rise * (1.0 - m.exp(-elapsed / values.time)) + values.rate * elapsed
    return values.expansion * temperature_change


def free_strain_rate(m: Mathematics, values: Values, states: Tuple[Any, ...], cable: Any, tension: Any) -> Any:
    """``alpha (D / tau exp(-t / tau) + R)``, in 1/s."""
    return values.expansion * (values.rise / values.time * m.exp(-states[0] / values.time) + values.rate)


def state_rates(m: Mathematics, values: Values, states: Tuple[Any, ...], cable: Any, motion: Any) -> Tuple[Any, ...]:
    """Rate of the time, which is one."""
    return (1.0,)


THERMAL = Effect(
    name="thermal",
    component="cable",
    description="growth of the rope with its temperature",
    parameters=(
        Parameter(
            name="expansion",
            unit="1/K",
            description="thermal expansion of the rope; steel 1.2e-5, aramid and polyethylene below zero",
            minimum=-1e-4,
            maximum=1e-3,
            neutral=1.2e-5,
            start=1.2e-5,
        ),
        Parameter(
            name="rise",
            unit="K",
            description="how much warmer the rope gets in the end than at the start",
            minimum=-300.0,
            maximum=300.0,
            neutral=0.0,
            start=5.0,
        ),
        Parameter(
            name="time",
            unit="s",
            description="time in which 63 % of the rise is done",
            minimum=0.1,
            maximum=1e7,
            neutral=60.0,
            start=60.0,
            multistart_values=(5.0, 60.0),
        ),
        Parameter(
            name="rate",
            unit="K/s",
            description="steady rate of temperature, on top of the rise",
            minimum=-10.0,
            maximum=10.0,
            neutral=0.0,
            start=0.01,
        ),
    ),
    values=Values,
    forms=(("rise", "time"), ("rate",)),
    states=(State("elapsed", "s", "time since the start", drifts=True),),
    free_strain=free_strain,
    free_strain_rate=free_strain_rate,
    state_rates=state_rates,
    source="Feyrer (2015), Wire Ropes, 2nd ed.; Newton's law of cooling",
)
