"""A rope with weight: it hangs in an arc longer than its chord, and its ends hold it.

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

# Newton's steps in ln T; four reach rounding from the guess below while the rope weighs less than three tensions.
ITERATIONS = 5
LONGEST_STEP = 2.0
# N and N^3: far below any tension, so that a weightless rope that hangs slack has numbers too.
SMALLEST, SMALLEST_CUBE = 1e-3, 1e-9
# Power series in z = x^2 of sinh^2 x / x^2 = 1 + z / 3 + z^2 (...), of sinh x / x, and of cosh x - sinh x / x.
SQUARE = (2.0 / 45.0, 1.0 / 315.0, 2.0 / 14175.0, 2.0 / 467775.0, 4.0 / 42567525.0)
SQUARE_SLOPE = (4.0 / 45.0, 3.0 / 315.0, 8.0 / 14175.0, 10.0 / 467775.0, 24.0 / 42567525.0)
SINE = (1.0, 1.0 / 6.0, 1.0 / 120.0, 1.0 / 5040.0, 1.0 / 362880.0, 1.0 / 39916800.0)
EXCESS = (0.0, 1.0 / 3.0, 1.0 / 30.0, 1.0 / 840.0, 1.0 / 45360.0, 1.0 / 3991680.0)


class Values(NamedTuple):
    """Mass of the rope for each metre, and how much of a catenary it is rather than a parabola."""

    linear_density: Any
    catenary: Any


class _Hanging(NamedTuple):
    """``square`` is ``(w l / 2)^2`` in N^2, ``flat`` is ``c^2``; both make the arc at a tension."""

    square: Any
    flat: Any
    catenary: Any

    def arc(self, z: Any) -> Tuple[Any, Any]:
        """``(arc / l)^2`` and its slope by ``z``."""
        flat, share = self.flat, self.catenary
        higher = flat * share
        own = (1.0 - share) * flat * flat / 36.0
        value = flat / 3.0 + z * (own + higher * _series(SQUARE, z))
        slope = flat / 3.0 + z * (2.0 * own + higher * _series(SQUARE_SLOPE, z))
        return 1.0 + z * value, slope


def sag(
    m: Mathematics, values: Values, cable: Any, line: Any, strain: Any, modulus: Any, stress: Any
) -> Tuple[Any, Any]:
    """``ln(arc / l)`` now and at the start; the tension between them by Newton's method."""
    at_start = _hanging(values, cable.gravity, cable.start_length, cable.start_direction)
    first = m.maximum(cable.start_tension, SMALLEST)
    before = 0.5 * m.log(at_start.arc(at_start.square / (first * first))[0])
    now = _hanging(values, cable.gravity, line.length, line.direction)
    axial = cable.area * modulus
    base = axial * (strain - before) + cable.area * stress + cable.start_tension
    logarithm = m.log(_guess(m, base, axial * now.square * now.flat / 6.0))
    for _ in range(ITERATIONS):
        tension = m.exp(logarithm)
        z = now.square / (tension * tension)
        arc, slope = now.arc(z)
        step = (tension - base - 0.5 * axial * m.log(arc)) / (tension + axial * z * slope / arc)
        logarithm = logarithm - _within(m, step, LONGEST_STEP)
    tension = m.exp(logarithm)
    return 0.5 * m.log(now.arc(now.square / (tension * tension))[0]), before


def ends(m: Mathematics, values: Values, gravity: Any, line: Any, tension: Any) -> Tuple[Tuple[Any, Any, Any], Any]:
    """What hangs on the platform beside the tension along the chord, a vector in N; and N more at the load cell."""
    hanging = _hanging(values, gravity, line.length, line.direction)
    pull = m.maximum(tension, SMALLEST)
    z = hanging.square / (pull * pull)
    longer = values.catenary * (m.sqrt(hanging.arc(z)[0]) - 1.0)
    half = 0.5 * values.linear_density * gravity * line.chord * (1.0 + longer)
    upward = line.direction[2]
    lift = values.catenary * _series(EXCESS, z) / _series(SINE, z) * tension * upward
    risen = half + lift
    # The length of T u + risen e_z, less T; the small number keeps the root's slope finite.
    more = risen * (2.0 * tension * upward + risen)
    at_cell = more / (tension + m.sqrt(tension * tension + more + SMALLEST * SMALLEST))
    return (0.0, 0.0, lift - half), at_cell


def _hanging(values: Values, gravity: Any, length: Any, direction: Sequence[Any]) -> _Hanging:
    half = 0.5 * values.linear_density * gravity * length
    flat = direction[0] * direction[0] + direction[1] * direction[1]
    return _Hanging(half * half, flat, values.catenary)


def _guess(m: Mathematics, base: Any, cube: Any) -> Any:
    """Near the root of ``T^2 (T - base) = cube``, which is the parabola's while it is flat."""
    middle = m.exp(m.log(cube + SMALLEST_CUBE) / 3.0)
    slack = m.sqrt((cube + SMALLEST_CUBE) / (m.absolute(base) + middle))
    return m.where(base, base + middle, slack)


def _within(m: Mathematics, value: Any, bound: float) -> Any:
    return -m.maximum(-m.maximum(value, -bound), -bound)


def _series(coefficients: Sequence[float], z: Any) -> Any:
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
