"""Centre-of-mass shift: a platform whose centre of mass is not where the robot file has it."""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter


class Values(NamedTuple):
    """Vector from the declared centre of mass to the true one, in the platform's frame."""

    x: Any
    y: Any
    z: Any


def centre_of_mass(m: Mathematics, values: Values) -> Tuple[Any, Any, Any]:
    """Shift of the centre of mass, in m; the inertia stays that about the true one."""
    return (values.x, values.y, values.z)


CENTRE_OF_MASS = Effect(
    name="centre_of_mass",
    component="platform",
    description="centre of mass elsewhere than declared",
    parameters=tuple(
        Parameter(
            name=axis,
            unit="m",
            description=f"shift of the centre of mass along the platform's {axis}",
            minimum=-10.0,
            maximum=10.0,
            neutral=0.0,
            start=0.01,
            needs_rigid_body=True,
        )
        for axis in "xyz"
    ),
    values=Values,
    forms=(("x", "y", "z"),),
    centre_of_mass=centre_of_mass,
    source="Goldstein, Poole and Safko (2002), Classical Mechanics, section 1.2",
)
