"""Exit-point offset: an exit point that is not where the robot file has it."""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter


class Values(NamedTuple):
    """Vector from the declared exit point to the true one."""

    x: Any
    y: Any
    z: Any


def exit_point(m: Mathematics, values: Values) -> Tuple[Any, Any, Any]:
    """Shift of the exit point, in m."""
    return (values.x, values.y, values.z)


ANCHOR = Effect(
    name="anchor",
    component="cable",
    description="exit point elsewhere than declared",
    parameters=tuple(
        Parameter(
            name=axis,
            unit="m",
            description=f"shift of the exit point along {axis}",
            minimum=-10.0,
            maximum=10.0,
            neutral=0.0,
            start=0.01,
        )
        for axis in "xyz"
    ),
    values=Values,
    forms=(("x", "y", "z"),),
    exit_point=exit_point,
    source="geometry; Pott (2018), Cable-Driven Parallel Robots",
)
