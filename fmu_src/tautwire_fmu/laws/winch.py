"""The winch: from the speed that its encoder reports to the speed of the rope."""

from typing import Any, Sequence, Tuple

from .effects import ActiveEffect
from .mathematics import Mathematics


def rope_speed(
    m: Mathematics,
    effects: Sequence[ActiveEffect],
    states: Sequence[Tuple[Any, ...]],
    winch_speed: Any,
) -> Any:
    """Speed at which rope is reeled in, in m/s: the reported speed and what the effects add to it."""
    speed = winch_speed
    for active, own in zip(effects, states):
        if active.effect.rope_speed is not None:
            speed = speed + active.effect.rope_speed(m, active.values, own, winch_speed)
    return speed
