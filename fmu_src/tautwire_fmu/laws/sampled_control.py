"""A sampled controller on a path: from what the sensors show to where the winch speeds run next.

Within sample k, of length h, the winches run on a ramp from ``V_k`` to ``V_k+1``. F are the feedforward speeds, r is
what the sensors shall show and y what they show, ``w_k = V_k - F_k``:

    a_k   = C x_k + D w_k                                        what is asked for
    V_k+1 = F_k+1 + w_k + h a_k, within the limits               what is given
    x_k+1 = A x_k + B (y_k - r_k, w_k) + M (given a_k - a_k)

``x_k`` knows samples before k only: one sample is there for computing. M tells the state what was given, so nothing
winds up at a limit. Between the knots of a schedule all matrices are interpolated linearly.

A cable's tension T is kept within its limits by a bound on its speed: one that would take T to the limit L without
overshoot, from T as seen a sample before and its rate, ``V_k+1 <= V_k + h (l / E S) ((L - T) / tau - 2 dT/dt) / tau``,
and the same from below. It is a cable's last resort: where statics asks for more than L it gives way.

Source: Astrom and Rundqwist (1989), Integrator windup and how to avoid it, American Control Conference, for M.
"""

from operator import mul
from typing import Any, Dict, List, NamedTuple, Sequence, Tuple

Vector = Sequence[float]
Matrix = Sequence[Vector]


class Gains(NamedTuple):
    """The matrices A, B, C, D and M as rows; p states, n cables, 3 + n sensors: B has 3 + 2 n columns."""

    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix
    M: Matrix


class Plan(NamedTuple):
    """A controller made for a path.

    ``period`` h in s; at each of N samples ``speeds`` F (n) in m/s and ``expected`` r (3 + n), position in m and
    tensions in N. ``knots`` are the samples at which ``gains`` hold. ``compliances`` (n) are l / (E S), in m/N, and
    ``yield_time`` is tau, in s.
    """

    period: float
    speeds: Matrix
    expected: Matrix
    knots: Sequence[float]
    gains: Sequence[Gains]
    compliances: Vector
    yield_time: float


class Limits(NamedTuple):
    """Bounds of the rope's speed (m/s) and acceleration (m/s^2), and of the tension (N)."""

    speed: float
    acceleration: float
    lowest_tension: float
    highest_tension: float


class Memory(NamedTuple):
    """Where a controller is: in which sample, its state, winch speeds at both ends of it, the last tensions seen.

    ``tensions`` are of the sample before this one, ``earlier`` of the one before that.
    """

    sample: int
    state: Vector
    begin: Vector
    end: Vector
    tensions: Vector
    earlier: Vector


def plan_of(data: Dict[str, Any]) -> Plan:
    """The plan that a resource holds."""
    return Plan(
        data["period"],
        data["speeds"],
        data["expected"],
        [knot["sample"] for knot in data["knots"]],
        [Gains(*(knot[name] for name in Gains._fields)) for knot in data["knots"]],
        data["compliances"],
        data["yield_time"],
    )


def first_sample(plan: Plan, limits: Limits) -> Memory:
    """At the start of the path: nothing seen, the state zero."""
    begin = [_cut(speed, -limits.speed, limits.speed) for speed in plan.speeds[0]]
    state = [0.0] * len(plan.gains[0].A)
    tensions = plan.expected[0][3:]
    return Memory(0, state, begin, _ahead(plan, limits, 0, state, begin, (tensions, tensions)), tensions, tensions)


def next_sample(plan: Plan, limits: Limits, memory: Memory, measured: Vector) -> Memory:
    """The next sample, by what the sensors showed at the begin of this one: position in m, then tensions in N."""
    k = memory.sample
    gains = gains_at(plan, k)
    away = _less(memory.begin, _row(plan.speeds, k))
    asked = _asked(gains, memory.state, away)
    ahead = _less(memory.end, _row(plan.speeds, k + 1))
    missed = [(b - a) / plan.period - wanted for a, b, wanted in zip(away, ahead, asked)]
    seen = _less(measured, _row(plan.expected, k)) + away
    state = [
        _dot(row, memory.state) + _dot(driven, seen) + _dot(told, missed)
        for row, driven, told in zip(gains.A, gains.B, gains.M)
    ]
    tensions = measured[3:]
    end = _ahead(plan, limits, k + 1, state, memory.end, (tensions, memory.tensions))
    return Memory(k + 1, state, memory.end, end, tensions, memory.tensions)


def gains_at(plan: Plan, sample: int) -> Gains:
    """The gains at a sample, before the first and after the last knot those of that knot."""
    knots = plan.knots
    after = next((place for place, knot in enumerate(knots) if knot > sample), len(knots))
    if after == 0 or after == len(knots):
        return plan.gains[max(after - 1, 0)]
    share = (sample - knots[after - 1]) / (knots[after] - knots[after - 1])
    return Gains(*(_between(a, b, share) for a, b in zip(plan.gains[after - 1], plan.gains[after])))


def acceleration(plan: Plan, memory: Memory) -> List[float]:
    """Of the ropes within the sample, in m/s^2."""
    return [(after - before) / plan.period for before, after in zip(memory.begin, memory.end)]


def _ahead(
    plan: Plan, limits: Limits, k: int, state: Vector, begin: Vector, tensions: Tuple[Vector, Vector]
) -> List[float]:
    """The winch speeds at the end of sample k, within the limits; those of the winch have the last word."""
    here, there = _row(plan.speeds, k), _row(plan.speeds, k + 1)
    away = _less(begin, here)
    asked = _asked(gains_at(plan, k), state, away)
    reach = plan.period * limits.acceleration
    found = []
    for speed, then, off, wanted, compliance, tension, before in zip(
        begin, there, away, asked, plan.compliances, *tensions
    ):
        free = then + off + plan.period * wanted
        give = plan.period * compliance / plan.yield_time
        rising = 1.4 * (tension - before) / plan.period
        lower = speed + give * ((limits.lowest_tension - tension) / plan.yield_time - rising)
        upper = speed + give * ((limits.highest_tension - tension) / plan.yield_time - rising)
        held = _cut(_cut(free, lower, upper), speed - reach, speed + reach)
        found.append(_cut(held, -limits.speed, limits.speed))
    return found


def _asked(gains: Gains, state: Vector, away: Vector) -> List[float]:
    return [_dot(row, state) + _dot(own, away) for row, own in zip(gains.C, gains.D)]


def _row(rows: Matrix, k: int) -> Vector:
    """The path rests at its last sample."""
    return rows[min(k, len(rows) - 1)]


def _between(first: Matrix, second: Matrix, share: float) -> Matrix:
    return [[a + share * (b - a) for a, b in zip(one, other)] for one, other in zip(first, second)]


def _less(values: Vector, others: Vector) -> List[float]:
    return [a - b for a, b in zip(values, others)]


def _dot(row: Vector, values: Vector) -> float:
    return sum(map(mul, row, values))


def _cut(value: float, lower: float, upper: float) -> float:
    return min(max(value, lower), upper)
