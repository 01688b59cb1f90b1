"""Winch drum errors: another radius than the encoder assumes, eccentricity, or slip."""

import math
from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter, State

QUARTER_TURN = math.pi / 2.0


class Values(NamedTuple):
    """True over declared radius; an eccentricity with its phase and the drum's radius; slip under tension."""

    radius_ratio: Any
    eccentricity: Any
    phase: Any
    radius: Any
    slip: Any


def rope_speed(m: Mathematics, values: Values, states: Tuple[Any, ...], winch_speed: Any, tension: Any) -> Any:
    """``V_e (q (1 + e cos(s / R + f)) - 1) - k max(T, 0) |V_e|``, in m/s; ``s`` is what the encoder has counted."""
    radius_factor = 1.0 + values.eccentricity * m.cos(states[0] / values.radius + values.phase)
    slip_speed = values.slip * m.maximum(tension, 0.0) * m.absolute(winch_speed)
    return winch_speed * (values.radius_ratio * radius_factor - 1.0) - slip_speed


def state_rates(m: Mathematics, values: Values, states: Tuple[Any, ...], cable: Any, motion: Any) -> Tuple[Any, ...]:
    """Rate of the travel counted by the encoder, in m/s."""
    return (motion.winch_speed,)


DRUM = Effect(
    name="drum",
    component="winch",
    description="drum of another radius than declared, out of round, or slipping",
    parameters=(
        Parameter(
            name="radius_ratio",
            unit="1",
            description="true over declared radius of the drum",
            minimum=0.1,
            maximum=10.0,
            neutral=1.0,
            start=1.01,
        ),
        Parameter(
            name="eccentricity",
            unit="1",
            description="how much the radius swings in a turn, as a share of it",
            minimum=-0.5,
            maximum=0.5,
            neutral=0.0,
            start=0.01,
        ),
        Parameter(
            name="phase",
            unit="rad",
            description="angle from the start to the largest radius, against reeling in",
            minimum=-6.4,
            maximum=6.4,
            neutral=0.0,
            start=1.0,
            multistart_values=(0.0, QUARTER_TURN),
        ),
        Parameter(
            name="radius",
            unit="m",
            description="radius of the drum: rope reeled in for each radian",
            minimum=1e-3,
            maximum=10.0,
            neutral=0.1,
            start=0.1,
            multistart_values=(0.04, 0.05, 0.06, 0.08, 0.1, 0.125, 0.15, 0.2, 0.3),
        ),
        Parameter(
            name="slip",
            unit="1/N",
            description="rope lost toward the platform, as a share of what turns by, for each N of elastic tension",
            minimum=0.0,
            maximum=1e-3,
            neutral=0.0,
            start=1e-6,
        ),
    ),
    values=Values,
    forms=(("radius_ratio",), ("eccentricity", "phase", "radius"), ("slip",)),
    states=(State("travel", "m", "rope reeled in by the encoder since the start", drifts=True),),
    rope_speed=rope_speed,
    state_rates=state_rates,
    source="geometry of a drum; elastic creep of a rope on a drum: Euler (1762), Eytelwein (1808)",
)
