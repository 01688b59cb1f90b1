"""A soft passage into slackness, as of a rope whose strands let go one after the other."""

from typing import Any, NamedTuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter

# N: in place of no softness at all, where the passage is a corner.
HARDEST = 1e-6
SMALLEST = 1e-300


class Values(NamedTuple):
    """Tension over which the passage reaches."""

    softness: Any


def softening(m: Mathematics, values: Values, cable: Any, pull: Any) -> Any:
    """What ``s ln(1 + exp(x / s))`` has over ``max(pull, 0)``, in N; ``x`` is the pull, shifted to keep ``T0``."""
    softness = values.softness
    sharp = m.maximum(softness, HARDEST)
    shift = softness * m.log(m.maximum(1.0 - m.exp(-cable.start_tension / sharp), SMALLEST))
    moved = pull + shift
    rounded = m.maximum(moved, 0.0) + softness * m.log(1.0 + m.exp(-m.absolute(moved) / sharp))
    return rounded - m.maximum(pull, 0.0)


SLACK = Effect(
    name="slack",
    component="cable",
    description="soft passage between tight and slack",
    parameters=(
        Parameter(
            name="softness",
            unit="N",
            description="tension over which the passage reaches, the s of s ln(1 + exp(T / s))",
            minimum=0.0,
            maximum=1e5,
            neutral=0.0,
            start=50.0,
            scanned=(1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0),
        ),
    ),
    values=Values,
    forms=(("softness",),),
    softening=softening,
    source="the softplus, a smooth max(T, 0): Dugas et al. (2001), Advances in Neural Information Processing Systems",
)
