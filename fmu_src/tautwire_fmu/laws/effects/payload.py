"""Undeclared payload: a load that the platform carries and its file does not know."""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter


class Values(NamedTuple):
    """Mass on top of the platform's declared mass."""

    mass: Any


def inertia(m: Mathematics, values: Values, states: Tuple[Any, ...]) -> Any:
    """Added mass, in kg; it weighs and resists acceleration alike."""
    return values.mass


PAYLOAD = Effect(
    name="payload",
    component="platform",
    description="mass carried in addition to the platform's declared mass",
    parameters=(
        Parameter(
            name="mass",
            unit="kg",
            description="mass carried; negative where the platform is lighter than declared",
            minimum=-1e6,
            maximum=1e6,
            neutral=0.0,
            start=1.0,
        ),
    ),
    values=Values,
    forms=(("mass",),),
    inertia=inertia,
    source="Newton's second law",
)
