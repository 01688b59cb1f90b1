"""Transverse damping: a force against the motion of a rope's end across the rope."""

from typing import Any, NamedTuple

from ..mathematics import Mathematics
from ..vectors import Vector, dot, scale, subtract
from .effect import Effect, Parameter


class Values(NamedTuple):
    """Force for each m/s across the rope."""

    damping: Any


def lateral_force(m: Mathematics, values: Values, line: Any) -> Vector:
    """``-d (v - (u . v) u)``, in N, with the unit vector u along the rope and the velocity v of its end."""
    along = scale(dot(line.direction, line.velocity), line.direction)
    return scale(-values.damping, subtract(line.velocity, along))


TRANSVERSE_DAMPING = Effect(
    name="transverse_damping",
    component="cable",
    description="resistance to motion of the rope's end across the rope",
    parameters=(
        Parameter(
            name="damping",
            unit="N s/m",
            description="force against each m/s across the rope, at its end on the platform",
            minimum=0.0,
            maximum=1e6,
            neutral=0.0,
            start=10.0,
        ),
    ),
    values=Values,
    forms=(("damping",),),
    # On all ropes of a point mass it is nearly a linear drag, which is no effect of the list.
    is_tried_on_point_masses=False,
    lateral_force=lateral_force,
    source="viscous damping: Clough and Penzien (1993), Dynamics of Structures, section 2-2",
)
