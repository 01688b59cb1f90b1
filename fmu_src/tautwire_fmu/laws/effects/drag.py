"""Aerodynamic drag on the platform, with a steady wind."""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from ..vectors import Vector, dot, scale, subtract
from .effect import Effect, Parameter

# (m/s)^2: keeps the slope of the speed finite at rest.
SPEED_SQUARED_FLOOR = 1e-24


class Values(NamedTuple):
    """Drag area, density of the air, and wind."""

    drag_area: Any
    density: Any
    wind_x: Any
    wind_y: Any
    wind_z: Any


def wrench(m: Mathematics, values: Values, states: Tuple[Any, ...], position: Vector, velocity: Vector) -> Vector:
    """``-rho / 2 C A |v - w| (v - w)``, in N; the start is in equilibrium with the wind."""
    relative = subtract(velocity, (values.wind_x, values.wind_y, values.wind_z))
    speed = m.sqrt(dot(relative, relative) + SPEED_SQUARED_FLOOR)
    return scale(-0.5 * values.density * values.drag_area * speed, relative)


def _wind_parameter(axis: str) -> Parameter:
    return Parameter(
        name=f"wind_{axis}",
        unit="m/s",
        description=f"speed of the air along {axis}",
        minimum=-100.0,
        maximum=100.0,
        neutral=0.0,
        start=1.0,
    )


DRAG = Effect(
    name="drag",
    component="platform",
    description="drag of the air on the platform, and wind",
    parameters=(
        Parameter(
            name="drag_area",
            unit="m2",
            description="coefficient of drag times area that faces the flow",
            minimum=0.0,
            maximum=1e4,
            neutral=0.0,
            start=1.0,
        ),
        Parameter(
            name="density",
            unit="kg/m3",
            description="density of the air",
            minimum=0.0,
            maximum=2000.0,
            neutral=1.225,
            start=1.225,
        ),
        *map(_wind_parameter, "xyz"),
    ),
    values=Values,
    forms=(("drag_area",), ("drag_area", "wind_x", "wind_y", "wind_z")),
    wrench=wrench,
    source="Hoerner (1965), Fluid-Dynamic Drag; density of the standard atmosphere at sea level, ISO 2533:1975",
)
