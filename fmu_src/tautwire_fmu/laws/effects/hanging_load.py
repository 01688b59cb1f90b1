"""Hanging load: a mass on a sling below the platform weighs on it and hardly resists its motion sideways."""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from ..vectors import Vector
from .effect import Effect, Parameter


class Values(NamedTuple):
    """Weight of the load."""

    weight: Any


def wrench(m: Mathematics, values: Values, states: Tuple[Any, ...], position: Vector, velocity: Vector) -> Vector:
    """``(0, 0, -W)``, in N: the pull of the sling on a platform that moves faster than the load swings.

    Unlike a payload the load has no inertia; the platform's vertical acceleration is neglected beside gravity.
    """
    return (0.0, 0.0, -values.weight)


HANGING_LOAD = Effect(
    name="hanging_load",
    component="platform",
    description="load on a sling, which weighs on the platform and does not move with it",
    parameters=(
        Parameter(
            name="weight",
            unit="N",
            description="weight of the load",
            minimum=0.0,
            maximum=1e7,
            neutral=0.0,
            start=10.0,
        ),
    ),
    values=Values,
    forms=(("weight",),),
    wrench=wrench,
    source="the reaction of a pendulum far above its natural frequency",
)
