"""Creep of the rope: lasting growth under load, which carries no tension."""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter, State


class Values(NamedTuple):
    """Logarithmic creep by ``compliance`` and ``time``, viscous creep by ``fluidity``; both may act."""

    compliance: Any
    time: Any
    fluidity: Any


def free_strain(m: Mathematics, values: Values, states: Tuple[Any, ...]) -> Any:
    """Creep strain."""
    return states[0]


def free_strain_rate(m: Mathematics, values: Values, states: Tuple[Any, ...], cable: Any, tension: Any) -> Any:
    """``de/dt = (C / (tau + t) + phi) max(T, 0) / S``, in 1/s; under constant stress ``C sigma ln(1 + t/tau)``."""
    stress = m.maximum(tension, 0.0) / cable.area
    return (values.compliance / (values.time + states[1]) + values.fluidity) * stress


def state_rates(m: Mathematics, values: Values, states: Tuple[Any, ...], cable: Any, motion: Any) -> Tuple[Any, ...]:
    """Rates of the creep strain, in 1/s, and of the time, which is one."""
    return free_strain_rate(m, values, states, cable, motion.elastic_tension), 1.0


CREEP = Effect(
    name="creep",
    component="cable",
    description="lasting growth of the rope under load",
    parameters=(
        Parameter(
            name="compliance",
            unit="1/Pa",
            description="strain for each Pa and each e-fold of time, of logarithmic creep",
            minimum=0.0,
            maximum=1e-8,
            neutral=0.0,
            start=1e-12,
        ),
        Parameter(
            name="time",
            unit="s",
            description="age of the load at the start, from when logarithmic creep slows down",
            minimum=1e-2,
            maximum=1e8,
            neutral=10.0,
            start=10.0,
            multistart_values=(1.0, 10.0, 100.0),
        ),
        Parameter(
            name="fluidity",
            unit="1/(Pa s)",
            description="strain rate for each Pa, of creep that does not slow down",
            minimum=0.0,
            maximum=1e-8,
            neutral=0.0,
            start=1e-14,
        ),
    ),
    values=Values,
    forms=(("compliance", "time"), ("fluidity",)),
    states=(
        State("strain", "1", "strain that has crept since the start", 1e-3, drifts=True),
        State("elapsed", "s", "time since the start", drifts=True),
    ),
    free_strain=free_strain,
    free_strain_rate=free_strain_rate,
    state_rates=state_rates,
    source="Findley, Lai and Onaran (1976), Creep and Relaxation of Nonlinear Viscoelastic Materials",
)
