"""Inertia other than declared: principal moments multiplied by factors, about the declared principal axes."""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter


class Values(NamedTuple):
    """True over declared principal moments."""

    factor_x: Any
    factor_y: Any
    factor_z: Any


def inertia_factors(m: Mathematics, values: Values) -> Tuple[Any, Any, Any]:
    """Factors of the moments about the principal axes nearest to the platform's x, y and z."""
    return (values.factor_x, values.factor_y, values.factor_z)


INERTIA = Effect(
    name="inertia",
    component="platform",
    description="principal moments of inertia other than declared",
    parameters=tuple(
        Parameter(
            name=f"factor_{axis}",
            unit="1",
            description=f"true over declared moment about the principal axis nearest to the platform's {axis}",
            minimum=0.01,
            maximum=100.0,
            neutral=1.0,
            start=1.1,
            needs_rigid_body=True,
        )
        for axis in "xyz"
    ),
    values=Values,
    forms=(("factor_x", "factor_y", "factor_z"),),
    inertia_factors=inertia_factors,
    source="Goldstein, Poole and Safko (2002), Classical Mechanics, section 5.4",
)
