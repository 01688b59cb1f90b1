"""Sensor offsets: zero errors of load cells and of the measured position."""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from ..vectors import Vector
from .effect import Effect, Parameter


class Values(NamedTuple):
    """Measured less true value: of the load cells of the named cables, and of the platform's coordinates."""

    tension_offset: Any
    position_offset_x: Any
    position_offset_y: Any
    position_offset_z: Any


def offset(m: Mathematics, values: Values) -> Tuple[Any, Vector]:
    """Sensor offsets of tension, in N, and of position, in m."""
    return values.tension_offset, (values.position_offset_x, values.position_offset_y, values.position_offset_z)


def _position_parameter(axis: str) -> Parameter:
    return Parameter(
        name=f"position_offset_{axis}",
        unit="m",
        description=f"what the measured position shows too much along {axis}",
        minimum=-10.0,
        maximum=10.0,
        neutral=0.0,
        start=0.01,
    )


SENSOR_OFFSET = Effect(
    name="sensor_offset",
    component="sensor",
    description="wrong zero of load cells, or of the measured position",
    parameters=(
        Parameter(
            name="tension_offset",
            unit="N",
            description="what the load cell shows too much",
            minimum=-1e5,
            maximum=1e5,
            neutral=0.0,
            start=10.0,
        ),
        *(_position_parameter(axis) for axis in "xyz"),
    ),
    values=Values,
    forms=(("tension_offset",), ("position_offset_x", "position_offset_y", "position_offset_z")),
    offset=offset,
    source="the definition of a zero error",
)
