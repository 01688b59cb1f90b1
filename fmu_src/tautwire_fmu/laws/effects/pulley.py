"""Swivelling pulley at the exit point, over which the rope wraps.

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
# m^2: square of the distance below which the platform is straight under the exit point and the plane is undefined.
DISTANCE_SQUARED_FLOOR = 1e-24


class Values(NamedTuple):
    """Radius at which the rope lies on the pulley."""

    radius: Any


def path(m: Mathematics, values: Values, line: Tuple[Any, Any, Any]) -> Tuple[Tuple[Any, Any, Any], Any]:
    """Unit vector at the platform along the rope, and the rope's length in m with the part on the pulley."""
    radius = values.radius
    x, y, z = line
    horizontal_distance = m.sqrt(x * x + y * y + DISTANCE_SQUARED_FLOOR)
    free_length = m.sqrt(dot(line, line) - 2.0 * radius * horizontal_distance)
    slope = radius / free_length
    factor = (1.0 / free_length) / (1.0 + slope * slope)
    # C - P turned by a quarter: outward z, upward d - r.
    outward_ratio = (radius + slope * z) / horizontal_distance
    direction = (
        factor * (x - outward_ratio * x),
        factor * (y - outward_ratio * y),
        factor * (z + slope * (horizontal_distance - radius)),
    )
    normal_horizontal = -factor * (radius - horizontal_distance + slope * z)
    contact_angle = m.atan2(normal_horizontal, direction[2])
    return direction, free_length + radius * (HALF_TURN - contact_angle)


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
