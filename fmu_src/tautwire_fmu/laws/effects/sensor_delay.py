"""Sensor delays of load cells and of the measured position."""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter

# Half a period of a mode explains less than no delay, a whole one nearly as much: fits stop on the way to longer ones.
GRID_OF_DELAYS = (0.02, 0.04, 0.06, 0.08, 0.1, 0.12, 0.14, 0.16, 0.18, 0.2, 0.25, 0.3, 0.4, 0.5)


class Values(NamedTuple):
    """Delays: of the load cells of the named cables, and of the platform's position."""

    tension_delay: Any
    position_delay: Any


def delay(m: Mathematics, values: Values) -> Tuple[Any, Any]:
    """Sensor delays, in s; until one has passed the sensor gives the start value."""
    return values.tension_delay, values.position_delay


def _delay_parameter(quantity: str, sensor: str) -> Parameter:
    return Parameter(
        name=f"{quantity}_delay",
        unit="s",
        description=f"time by which {sensor} shows late",
        minimum=0.0,
        maximum=10.0,
        neutral=0.0,
        start=0.01,
        grid_values=GRID_OF_DELAYS,
    )


SENSOR_DELAY = Effect(
    name="sensor_delay",
    component="sensor",
    description="load cells or measured position that lag",
    parameters=(_delay_parameter("tension", "a load cell"), _delay_parameter("position", "the measured position")),
    values=Values,
    forms=(("tension_delay",), ("position_delay",)),
    delay=delay,
    source="the definition of a pure delay",
)
