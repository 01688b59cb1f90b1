"""Hysteresis (Bouc-Wen) of the rope: rate-independent friction between its strands."""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter, State

# Far below any memory that matters; keeps the power's slope finite at zero.
MEMORY_FLOOR = 1e-100


class Values(NamedTuple):
    """Largest friction force, strain in which it builds up, and sharpness of the transition to sliding."""

    force: Any
    yield_strain: Any
    exponent: Any


def tension(m: Mathematics, values: Values, states: Tuple[Any, ...], cable: Any, motion: Any) -> Any:
    """``F h``, in N."""
    return values.force * states[0]


def state_rates(m: Mathematics, values: Values, states: Tuple[Any, ...], cable: Any, motion: Any) -> Tuple[Any, ...]:
    """``dh/dt = (deps/dt / eps_y) (1 - |h|^n)`` while ``h`` grows in size, without ``|h|^n`` while it falls; in 1/s."""
    memory, rate = states[0], motion.strain_rate
    power = m.exp(values.exponent * m.log(m.maximum(m.absolute(memory), MEMORY_FLOOR)))
    sliding = m.where(memory * rate, power, 0.0)
    return ((rate / values.yield_strain) * (1.0 - sliding),)


HYSTERESIS = Effect(
    name="hysteresis",
    component="cable",
    description="rate-independent friction between the strands (Bouc and Wen)",
    parameters=(
        Parameter(
            name="force",
            unit="N",
            description="largest friction force, the F of T = E S eps + F h + T0",
            minimum=0.0,
            maximum=1e6,
            neutral=0.0,
            start=20.0,
            grid_values=(10.0, 100.0, 1000.0),
        ),
        Parameter(
            name="yield_strain",
            unit="1",
            description="strain in which the friction force would build up at its first slope",
            minimum=1e-7,
            maximum=0.1,
            neutral=1e-4,
            start=1e-4,
            multistart_values=(1e-5, 1e-4, 1e-3),
        ),
        Parameter(
            name="exponent",
            unit="1",
            description="sharpness of the passage from sticking to sliding",
            minimum=1.0,
            maximum=20.0,
            neutral=1.0,
            start=1.0,
        ),
    ),
    values=Values,
    forms=(("force", "yield_strain"), ("force", "yield_strain", "exponent")),
    states=(State("memory", "1", "share of the largest friction force, -1 to 1"),),
    tension=tension,
    state_rates=state_rates,
    source="Wen (1976), Method for random vibration of hysteretic systems, J. Eng. Mech. Div. 102(2), 249-263, with "
    "beta = gamma = 1/2",
)
