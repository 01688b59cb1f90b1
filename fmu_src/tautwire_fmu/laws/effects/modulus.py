"""Modulus of elasticity other than the declared one."""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter


class Values(NamedTuple):
    """True modulus of the cable, in place of the declared one."""

    modulus: Any


def stiffness(m: Mathematics, values: Values, states: Tuple[Any, ...], cable: Any) -> Tuple[Any, Any]:
    """Excess of the modulus over the declared one, in Pa; no stress at no strain."""
    return values.modulus - cable.modulus, 0.0


MODULUS = Effect(
    name="modulus",
    component="cable",
    description="stiffness of the cable other than declared",
    parameters=(
        Parameter(
            name="modulus",
            unit="Pa",
            description="modulus of elasticity of the rope on its declared area",
            minimum=1e6,
            maximum=1e13,
            neutral=None,
            start=1e11,
            start_ratio=1.05,
        ),
    ),
    values=Values,
    forms=(("modulus",),),
    stiffness=stiffness,
    source="Baklouti et al. 2017, sec. 3.2: 102.2 GPa quasi-static, 126 to 137 GPa dynamic, for one rope",
)
