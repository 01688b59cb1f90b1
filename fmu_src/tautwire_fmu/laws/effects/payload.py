"""Undeclared payload: a load that the platform carries and its file does not know."""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from ..vectors import Vector
from .effect import Effect, Parameter


class Values(NamedTuple):
    """Mass on top of the platform's declared mass, and where it sits."""

    mass: Any
    x: Any = 0.0
    y: Any = 0.0
    z: Any = 0.0


def inertia(m: Mathematics, values: Values, states: Tuple[Any, ...]) -> Any:
    """Added mass, in kg; it weighs and resists acceleration alike."""
    return values.mass


def mass_position(m: Mathematics, values: Values) -> Vector:
    """Vector from the platform's centre of mass to the payload, a point, in the platform's frame, in m."""
    return (values.x, values.y, values.z)


def _position_parameter(axis: str) -> Parameter:
    return Parameter(
        name=axis,
        unit="m",
        description=f"where it sits on a rigid platform, from the centre of mass along the platform's {axis}",
        minimum=-10.0,
        maximum=10.0,
        neutral=0.0,
        start=0.05,
        needs_rigid_body=True,
    )


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
        *map(_position_parameter, "xyz"),
    ),
    values=Values,
    forms=(("mass",), ("mass", "x", "y", "z")),
    inertia=inertia,
    mass_position=mass_position,
    source="Newton's second law; parallel axes: Huygens and Steiner",
)
