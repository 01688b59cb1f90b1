"""A swivelling pulley at the exit point, over which the rope wraps.

In the vertical plane through exit point A and platform P the rope comes up at A, wraps over the top of the pulley
and leaves on a tangent toward P. With ``d`` the horizontal distance of P from A, ``o`` the horizontal unit vector
toward P, the centre ``C = A + r o`` and ``s = A - P``:

    t^2 = |C - P|^2 - r^2 = |s|^2 - 2 r d        free length
    t u = (C - P) + r n                          n the normal of u that points outward, toward the tangent point
    l = t + r (pi - theta),  theta = atan2(n_z, n_o)

Turned by a quarter, ``n`` is linear in ``u``, so ``u`` follows without angles. ``dl/dt = -u . v``: an involute.
"""

from typing import Any, NamedTuple, Tuple

from ..mathematics import Mathematics
from ..vectors import dot
from .effect import Effect, Parameter

HALF_TURN = 3.141592653589793
# Square of a distance in m below which the platform is straight under the exit point and no plane is left.
AT_AXIS = 1e-24


class Values(NamedTuple):
    """Radius at which the rope lies on the pulley."""

    radius: Any


def path(m: Mathematics, values: Values, line: Tuple[Any, Any, Any]) -> Tuple[Tuple[Any, Any, Any], Any]:
    """Unit vector at the platform along the rope, and the rope's length in m with the part on the pulley."""
    radius = values.radius
    x, y, z = line
    away = m.sqrt(x * x + y * y + AT_AXIS)
    free = m.sqrt(dot(line, line) - 2.0 * radius * away)
    slope = radius / free
    factor = (1.0 / free) / (1.0 + slope * slope)
    # Of C - P turned by a quarter: outward z, upward d - r.
    outward = (radius + slope * z) / away
    direction = (factor * (x - outward * x), factor * (y - outward * y), factor * (z + slope * (away - radius)))
    inward = -factor * (radius - away + slope * z)
    theta = m.atan2(inward, direction[2])
    return direction, free + radius * (HALF_TURN - theta)


PULLEY = Effect(
    name="pulley",
    component="cable",
    description="swivelling pulley at the exit point",
    parameters=(
        Parameter(
            name="radius",
            unit="m",
            description="radius at which the rope lies on the pulley",
            minimum=0.0,
            maximum=2.0,
            neutral=0.0,
            start=0.05,
        ),
    ),
    values=Values,
    forms=(("radius",),),
    path=path,
    source="Pott (2018), Cable-Driven Parallel Robots; Bruckmann et al. (2008), Wire robots part I: kinematics",
)
