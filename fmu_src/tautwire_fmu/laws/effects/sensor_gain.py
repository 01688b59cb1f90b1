"""Sensor gain errors of load cells and of the measured position."""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter


class Values(NamedTuple):
    """Measured over true value: of the load cells of the named cables, and of the platform's coordinates."""

    tension_gain: Any
    position_gain: Any


def gain(m: Mathematics, values: Values) -> Tuple[Any, Any]:
    """Sensor gains of tension and position."""
    return values.tension_gain, values.position_gain


SENSOR_GAIN = Effect(
    name="sensor_gain",
    component="sensor",
    description="wrong scale of load cells, or of the measured position",
    parameters=(
        Parameter(
            name="tension_gain",
            unit="1",
            description="tension that the load cell shows over the true one",
            minimum=0.1,
            maximum=10.0,
            neutral=1.0,
            start=1.01,
        ),
        Parameter(
            name="position_gain",
            unit="1",
            description="coordinates that are measured over the true ones",
            minimum=0.1,
            maximum=10.0,
            neutral=1.0,
            start=1.001,
        ),
    ),
    values=Values,
    forms=(("tension_gain",), ("position_gain",)),
    gain=gain,
    source="the definition of a scale factor",
)
