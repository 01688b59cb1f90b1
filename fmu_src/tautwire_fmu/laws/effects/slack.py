"""Soft transition into slackness, as of a rope whose strands let go one after the other."""

from typing import Any, NamedTuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter

# N: in place of zero softness, where the transition is a corner.
MIN_SOFTNESS = 1e-6
LOG_ARGUMENT_FLOOR = 1e-300


class Values(NamedTuple):
    """Tension range of the transition."""

    softness: Any


def softening(m: Mathematics, values: Values, cable: Any, pull: Any) -> Any:
    """Excess of the softplus ``s ln(1 + exp(x / s))`` over ``max(pull, 0)``, in N.

    ``x`` is the pull, shifted to keep ``T0``.
    """
    softness = values.softness
    floored_softness = m.maximum(softness, MIN_SOFTNESS)
    shift = softness * m.log(m.maximum(1.0 - m.exp(-cable.start_tension / floored_softness), LOG_ARGUMENT_FLOOR))
    shifted_pull = pull + shift
    soft_tension = m.maximum(shifted_pull, 0.0) + softness * m.log(
        1.0 + m.exp(-m.absolute(shifted_pull) / floored_softness)
    )
    return soft_tension - m.maximum(pull, 0.0)


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
            grid_values=(1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0),
        ),
    ),
    values=Values,
    forms=(("softness",),),
    softening=softening,
    source="the softplus, a smooth max(T, 0): Dugas et al. (2001), Advances in Neural Information Processing Systems",
)
