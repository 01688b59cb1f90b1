"""Viscoelastic relaxation of the rope: a standard linear solid of one to three branches."""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter, State


class Values(NamedTuple):
    """Modulus and time of each Maxwell branch; the declared modulus stays the long-term one."""

    modulus: Any
    time: Any
    modulus_2: Any
    time_2: Any
    modulus_3: Any
    time_3: Any


def stiffness(m: Mathematics, values: Values, states: Tuple[Any, ...], cable: Any) -> Tuple[Any, Any]:
    """``sum E_k`` and ``-sum E_k e_k``: each branch carries ``E_k (eps - e_k)``; in Pa."""
    moduli = (values.modulus, values.modulus_2, values.modulus_3)
    branch_stress = sum(modulus * strain for modulus, strain in zip(moduli, states))
    return moduli[0] + moduli[1] + moduli[2], -branch_stress


def state_rates(m: Mathematics, values: Values, states: Tuple[Any, ...], cable: Any, motion: Any) -> Tuple[Any, ...]:
    """``de_k/dt = (eps - e_k) / tau_k``, in 1/s."""
    times = (values.time, values.time_2, values.time_3)
    return tuple((motion.strain - strain) / time for strain, time in zip(states, times))


def _branch_parameters(suffix: str, time: float) -> Tuple[Parameter, Parameter]:
    """Parameters of one branch; ``time`` is where fits start, and the neutral value of a branch without modulus."""
    branch_name = f"branch {suffix[1:] or '1'}"
    return (
        Parameter(
            name=f"modulus{suffix}",
            unit="Pa",
            description=f"modulus of {branch_name}, on the declared area",
            minimum=0.0,
            maximum=1e13,
            neutral=0.0,
            start=1e10,
        ),
        Parameter(
            name=f"time{suffix}",
            unit="s",
            description=f"time in which {branch_name} relaxes; far shorter ones are damping, far longer ones modulus",
            minimum=1e-3,
            maximum=1e7,
            neutral=time,
            start=time,
            multistart_values=() if suffix else (0.03, 0.3, 3.0, 30.0),
        ),
    )


RELAXATION = Effect(
    name="relaxation",
    component="cable",
    description="viscoelastic relaxation: Maxwell branches beside the declared modulus",
    parameters=(*_branch_parameters("", 1.0), *_branch_parameters("_2", 10.0), *_branch_parameters("_3", 0.1)),
    values=Values,
    forms=(
        ("modulus", "time"),
        ("modulus", "time", "modulus_2", "time_2"),
        ("modulus", "time", "modulus_2", "time_2", "modulus_3", "time_3"),
    ),
    states=tuple(State(f"strain_{k}", "1", f"strain of the dashpot in branch {k}", 1e-3) for k in (1, 2, 3)),
    stiffness=stiffness,
    state_rates=state_rates,
    source="Ferry (1980), Viscoelastic Properties of Polymers, 3rd ed.; Baklouti et al. 2017, sec. 3.2, find a "
    "modulus that rises with frequency",
)
