"""Sensor delays of load cells and of the measured position, and low-pass filters of load cells."""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter, State

# Half a period of a mode explains less than no delay, a whole one nearly as much: fits stop on the way to longer ones.
GRID_OF_DELAYS = (0.02, 0.04, 0.06, 0.08, 0.1, 0.12, 0.14, 0.16, 0.18, 0.2, 0.25, 0.3, 0.4, 0.5)


class Values(NamedTuple):
    """Delays of the cables' load cells and of the platform's position, and time constant of the load cells' filters."""

    tension_delay: Any
    position_delay: Any
    tension_time_constant: Any


def delay(m: Mathematics, values: Values) -> Tuple[Any, Any]:
    """Sensor delays, in s; until one has passed the sensor gives the start value."""
    return values.tension_delay, values.position_delay


def low_pass(m: Mathematics, values: Values) -> Any:
    """Time constant tau of the load cells' filter, tau dy/dt = T - y, in s; none where it is zero."""
    return values.tension_time_constant


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
    description="load cells or measured position that lag, by a time or behind a low-pass filter",
    parameters=(
        _delay_parameter("tension", "a load cell"),
        _delay_parameter("position", "the measured position"),
        Parameter(
            name="tension_time_constant",
            unit="s",
            description="time constant of a load cell's filter, 1 / (2 pi bandwidth in Hz); below 1 ms it acts as 1 ms",
            minimum=0.0,
            maximum=10.0,
            neutral=0.0,
            start=0.03,
            grid_values=(0.03, 0.2),
        ),
    ),
    values=Values,
    forms=(("tension_delay",), ("position_delay",), ("tension_time_constant",)),
    states=(State("filtered", "1", "tension behind the filter less that at the start, over modulus times area", 1e-3),),
    delay=delay,
    low_pass=low_pass,
    source="the definitions of a pure delay and of a low-pass filter of first order",
)
