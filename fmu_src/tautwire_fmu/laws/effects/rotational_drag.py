"""Rotational drag: a moment against the platform's turning."""

from typing import Any, NamedTuple

from ..mathematics import Mathematics
from ..vectors import Vector, scale
from .effect import Effect, Parameter


class Values(NamedTuple):
    """Moment for each rad/s, about any axis."""

    damping: Any


def moment(m: Mathematics, values: Values, angular_velocity: Vector) -> Vector:
    """``-d omega``, in N m."""
    return scale(-values.damping, angular_velocity)


ROTATIONAL_DRAG = Effect(
    name="rotational_drag",
    component="platform",
    description="moment against the turning of the platform",
    parameters=(
        Parameter(
            name="damping",
            unit="N m s",
            description="moment against each rad/s of the platform's angular velocity",
            minimum=0.0,
            maximum=1e6,
            neutral=0.0,
            start=1.0,
            needs_rigid_body=True,
        ),
    ),
    values=Values,
    forms=(("damping",),),
    moment=moment,
    source="linear resistance to rotation: Happel and Brenner (1983), Low Reynolds Number Hydrodynamics, section 5.2",
)
