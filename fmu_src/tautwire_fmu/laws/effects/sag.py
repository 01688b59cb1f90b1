"""Cable sag: a rope with weight hangs in an arc longer than its chord.

Chord ``l`` of horizontal span ``d``, weight ``w`` per length, tension ``T`` along the chord, ``x = w l / (2 T)`` and
``c = d / l``. The arc is

    parabola   arc / l = 1 + c^2 x^2 / 6
    catenary   (arc / l)^2 = 1 + c^2 (sinh^2 x / x^2 - 1)

and the tension law acts on the strain of the arc, so ``T`` follows from

    T = E S (eps + ln(arc / l) - ln(arc_0 / l_0)) + T0        eps as if the rope were straight

Half the weight hangs on the platform, half on the exit point; the catenary also lifts the vertical part of ``T`` by the
factor ``x coth x``. ``catenary`` 0 is the parabola, 1 the catenary; the parabola's arc errs by some ``2 x^2 / 15`` of
what it is longer than the chord.

Source: Irvine (1981), Cable Structures, ch. 2.
"""

from typing import Any, NamedTuple, Sequence, Tuple

from ..mathematics import Mathematics
from .effect import Effect, Parameter

# Newton steps in ln T; four reach rounding from the initial guess while the rope weighs less than three tensions.
NEWTON_ITERATIONS = 5
MAX_NEWTON_STEP = 2.0
# N and N^3: far below any tension, so that a weightless slack rope has finite values too.
TENSION_FLOOR, TENSION_CUBE_FLOOR = 1e-3, 1e-9
# Power series in z = x^2 of sinh^2 x / x^2 = 1 + z / 3 + z^2 (...), of sinh x / x, and of cosh x - sinh x / x.
SINH_SQUARED_SERIES = (2.0 / 45.0, 1.0 / 315.0, 2.0 / 14175.0, 2.0 / 467775.0, 4.0 / 42567525.0)
SINH_SQUARED_SLOPE_SERIES = (4.0 / 45.0, 3.0 / 315.0, 8.0 / 14175.0, 10.0 / 467775.0, 24.0 / 42567525.0)
SINH_SERIES = (1.0, 1.0 / 6.0, 1.0 / 120.0, 1.0 / 5040.0, 1.0 / 362880.0, 1.0 / 39916800.0)
COSH_EXCESS_SERIES = (0.0, 1.0 / 3.0, 1.0 / 30.0, 1.0 / 840.0, 1.0 / 45360.0, 1.0 / 3991680.0)


class Values(NamedTuple):
    """Mass of the rope for each metre, and the weight of the catenary against the parabola."""

    linear_density: Any
    catenary: Any


class _HangingRope(NamedTuple):
    """Hanging rope: ``half_weight_squared`` is ``(w l / 2)^2`` in N^2, ``horizontal_ratio_squared`` is ``c^2``."""

    half_weight_squared: Any
    horizontal_ratio_squared: Any
    catenary: Any

    def arc_ratio_squared(self, z: Any) -> Tuple[Any, Any]:
        """``(arc / l)^2`` and its slope by ``z``."""
        horizontal, catenary_weight = self.horizontal_ratio_squared, self.catenary
        catenary_coefficient = horizontal * catenary_weight
        parabola_coefficient = (1.0 - catenary_weight) * horizontal * horizontal / 36.0
        value = horizontal / 3.0 + z * (
            parabola_coefficient + catenary_coefficient * _polynomial(SINH_SQUARED_SERIES, z)
        )
        slope = horizontal / 3.0 + z * (
            2.0 * parabola_coefficient + catenary_coefficient * _polynomial(SINH_SQUARED_SLOPE_SERIES, z)
        )
        return 1.0 + z * value, slope


def sag(
    m: Mathematics, values: Values, cable: Any, line: Any, strain: Any, stiffness: Tuple[Any, Any]
) -> Tuple[Any, Any]:
    """``ln(arc / l)`` now and at the start; Newton's method solves for the tension.

    ``stiffness`` is the modulus, and the stress at no strain, both in Pa.
    """
    modulus, stress = stiffness
    start_rope = _hanging_rope(values, cable.gravity, cable.start_length, cable.start_direction)
    start_tension = m.maximum(cable.start_tension, TENSION_FLOOR)
    start_log_ratio = 0.5 * m.log(
        start_rope.arc_ratio_squared(start_rope.half_weight_squared / (start_tension * start_tension))[0]
    )
    rope = _hanging_rope(values, cable.gravity, line.length, line.direction)
    axial_stiffness = cable.area * modulus
    unsagged_tension = axial_stiffness * (strain - start_log_ratio) + cable.area * stress + cable.start_tension
    log_tension = m.log(
        _initial_tension(
            m, unsagged_tension, axial_stiffness * rope.half_weight_squared * rope.horizontal_ratio_squared / 6.0
        )
    )
    for _ in range(NEWTON_ITERATIONS):
        tension = m.exp(log_tension)
        z = rope.half_weight_squared / (tension * tension)
        arc, slope = rope.arc_ratio_squared(z)
        step = (tension - unsagged_tension - 0.5 * axial_stiffness * m.log(arc)) / (
            tension + axial_stiffness * z * slope / arc
        )
        log_tension = log_tension - _clamp_symmetric(m, step, MAX_NEWTON_STEP)
    tension = m.exp(log_tension)
    return 0.5 * m.log(rope.arc_ratio_squared(rope.half_weight_squared / (tension * tension))[0]), start_log_ratio


def ends(m: Mathematics, values: Values, gravity: Any, line: Any, tension: Any) -> Tuple[Tuple[Any, Any, Any], Any]:
    """Force on the platform beside the tension along the chord, a vector in N; and the excess at the load cell in N."""
    rope = _hanging_rope(values, gravity, line.length, line.direction)
    floored_tension = m.maximum(tension, TENSION_FLOOR)
    z = rope.half_weight_squared / (floored_tension * floored_tension)
    relative_excess_length = values.catenary * (m.sqrt(rope.arc_ratio_squared(z)[0]) - 1.0)
    half_weight = 0.5 * values.linear_density * gravity * line.chord * (1.0 + relative_excess_length)
    vertical_component = line.direction[2]
    catenary_lift = (
        values.catenary
        * _polynomial(COSH_EXCESS_SERIES, z)
        / _polynomial(SINH_SERIES, z)
        * tension
        * vertical_component
    )
    vertical_force = half_weight + catenary_lift
    # The length of T u + risen e_z, less T; the small number keeps the root's slope finite.
    squared_tension_excess = vertical_force * (2.0 * tension * vertical_component + vertical_force)
    cell_tension = squared_tension_excess / (
        tension + m.sqrt(tension * tension + squared_tension_excess + TENSION_FLOOR * TENSION_FLOOR)
    )
    return (0.0, 0.0, catenary_lift - half_weight), cell_tension


def _hanging_rope(values: Values, gravity: Any, length: Any, direction: Sequence[Any]) -> _HangingRope:
    half_weight = 0.5 * values.linear_density * gravity * length
    horizontal_ratio_squared = direction[0] * direction[0] + direction[1] * direction[1]
    return _HangingRope(half_weight * half_weight, horizontal_ratio_squared, values.catenary)


def _initial_tension(m: Mathematics, base: Any, cube: Any) -> Any:
    """Initial guess near the root of ``T^2 (T - base) = cube``, exact for a flat parabola."""
    cube_root = m.exp(m.log(cube + TENSION_CUBE_FLOOR) / 3.0)
    slack_tension = m.sqrt((cube + TENSION_CUBE_FLOOR) / (m.absolute(base) + cube_root))
    return m.where(base, base + cube_root, slack_tension)


def _clamp_symmetric(m: Mathematics, value: Any, bound: float) -> Any:
    return -m.maximum(-m.maximum(value, -bound), -bound)


def _polynomial(coefficients: Sequence[float], z: Any) -> Any:
    total: Any = 0.0
    for coefficient in reversed(coefficients):
        total = coefficient + z * total
    return total


SAG = Effect(
    name="sag",
    component="cable",
    description="weight of the rope",
    parameters=(
        Parameter(
            name="linear_density",
            unit="kg/m",
            description="mass of one metre of rope",
            minimum=0.0,
            maximum=50.0,
            neutral=0.0,
            start=0.05,
        ),
        Parameter(
            name="catenary",
            unit="1",
            description="shape of the rope: 0 parabola, 1 catenary, between them a mix",
            minimum=0.0,
            maximum=1.0,
            neutral=0.0,
            start=1.0,
        ),
    ),
    values=Values,
    forms=(("linear_density",), ("linear_density", "catenary")),
    sag=sag,
    ends=ends,
    source="Irvine (1981), Cable Structures, ch. 2",
)
