"""Viscous damping in the cable."""

from typing import Any, NamedTuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter


class Values(NamedTuple):
    """True damping of the cable, in place of the declared one."""

    damping: Any


def viscosity(m: Mathematics, values: Values, cable: Any) -> Any:
    """Excess of the damping over the declared one, in Pa s."""
    return values.damping - cable.damping


DAMPING = Effect(
    name="damping",
    component="cable",
    description="viscous damping in the cable other than declared",
    parameters=(
        Parameter(
            name="damping",
            unit="Pa s",
            description="viscosity of the rope, the c of T = E S eps + c S deps/dt + T0",
            minimum=0.0,
            maximum=1e11,
            neutral=None,
            start=1e8,
            start_ratio=1.5,
        ),
    ),
    values=Values,
    forms=(("damping",),),
    viscosity=viscosity,
    source="Baklouti et al. 2017, Eqs. 10 and 12",
)
