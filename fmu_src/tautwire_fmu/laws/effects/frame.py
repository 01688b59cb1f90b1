"""Frame compliance: the exit point follows the rope as on a spring, along the rope."""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter


class Values(NamedTuple):
    """Compliance: how far the exit point moves toward the platform for each newton."""

    compliance: Any


def tension(m: Mathematics, values: Values, states: Tuple[Any, ...], cable: Any, motion: Any) -> Any:
    """``-(T - T0) k / (1 + k)`` with ``k = C E S / l``, in N: rope and frame in series share the stretch.

    Unlike a softer rope it takes the same stretch from a long rope as from a short one. The frame's mass is
    neglected: it follows at once.
    """
    relative_compliance = values.compliance * cable.modulus * cable.area / motion.line.length
    tension_change = motion.elastic_tension - cable.start_tension + cable.area * (cable.damping * motion.strain_rate)
    return -tension_change * (relative_compliance / (1.0 + relative_compliance))


FRAME = Effect(
    name="frame",
    component="cable",
    description="frame that gives way at the exit point",
    parameters=(
        Parameter(
            name="compliance",
            unit="m/N",
            description="how far the exit point moves along the rope for each newton",
            minimum=0.0,
            maximum=1e-2,
            neutral=0.0,
            start=1e-7,
        ),
    ),
    values=Values,
    forms=(("compliance",),),
    tension=tension,
    source="springs in series",
)
