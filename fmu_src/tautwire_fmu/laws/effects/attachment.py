"""Attachment shift: a cable that holds the platform elsewhere than the robot file has it."""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter


class Values(NamedTuple):
    """Vector from the declared attachment to the true one, in the platform's frame."""

    x: Any
    y: Any
    z: Any


def attachment(m: Mathematics, values: Values) -> Tuple[Any, Any, Any]:
    """Shift of the attachment, in m."""
    return (values.x, values.y, values.z)


ATTACHMENT = Effect(
    name="attachment",
    component="cable",
    description="attachment elsewhere on the platform than declared",
    parameters=tuple(
        Parameter(
            name=axis,
            unit="m",
            description=f"shift of the attachment along the platform's {axis}",
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
    attachment=attachment,
    source="geometry; Pott (2018), Cable-Driven Parallel Robots",
)
