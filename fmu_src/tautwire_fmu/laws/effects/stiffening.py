"""Strain stiffening: a rope whose tangent modulus grows with its strain, as strands bed in and fibres align."""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter


class Values(NamedTuple):
    """Growth of the rope's modulus with its strain."""

    quadratic: Any


def tension(m: Mathematics, values: Values, states: Tuple[Any, ...], cable: Any, motion: Any) -> Any:
    """``E S q (e^2 - e_0^2)``, in N, with ``e = eps + e_0`` the strain from no tension and ``e_0 = T0 / (E S)``.

    The tangent modulus is ``E (1 + 2 q e)``: as declared at no tension, higher at the static one.
    """
    stiffness = cable.modulus * cable.area
    start_strain = cable.start_tension / stiffness
    return stiffness * values.quadratic * motion.strain * (motion.strain + 2.0 * start_strain)


STIFFENING = Effect(
    name="stiffening",
    component="cable",
    description="rope that is the stiffer the more it is strained",
    parameters=(
        Parameter(
            name="quadratic",
            unit="1",
            description="the q of T = E S (e + q e^2), e the strain from no tension",
            minimum=0.0,
            maximum=1e5,
            neutral=0.0,
            start=10.0,
        ),
    ),
    values=Values,
    forms=(("quadratic",),),
    tension=tension,
    source="a stress-strain curve to second order; of wire ropes: Feyrer (2015), Wire Ropes, 2nd ed., ch. 2",
)
