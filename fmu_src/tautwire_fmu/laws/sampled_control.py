"""A sampled controller on a path: from what the sensors show to where the winch speeds run next.

Within sample k, of length h, the winches run on a ramp from ``V_k`` to ``V_k+1``. F are the feedforward speeds, r is
what the sensors shall show and y what they show, ``w_k = V_k - F_k``:

    a_k   = C x_k + D w_k                                        what is asked for
    V_k+1 = F_k+1 + w_k + h a_k, within the limits               what is given
    x_k+1 = A x_k + B (y_k - r_k, w_k) + M (given a_k - a_k)

``x_k`` knows samples before k only: one sample is there for computing. M tells the state what was given, so nothing
winds up at a limit. Between the knots of a schedule all matrices are interpolated linearly.

A cable's tension T is kept below a limit L by a bound on what is asked for beyond the feedforward, the one that would
take T to L as a mode of angular frequency 1 / tau and damping ratio 0.7, ``a <= (l / E S) ((L - T) / tau - 1.4 dT/dt)
/ tau``, from T as seen a sample before; and so from below. Where statics asks for more than L the cable gives way.

A plan that ``tares`` takes the platform to rest at the start: the first tensions seen, over those expected, scale all
that follow and the speeds that cancel stretch. So a payload that nobody declared does no harm.

Source: Astrom and Rundqwist (1989), Integrator windup and how to avoid it, American Control Conference, for M.
"""

from operator import mul
from typing import Any, Dict, List, NamedTuple, Sequence

Vector = Sequence[float]
Matrix = Sequence[Vector]

# Twice the damping ratio with which a tension goes to its limit.
DAMPED = 1.4
SMALLEST_SCALE, LARGEST_SCALE = 0.5, 2.0


class Gains(NamedTuple):
    """The matrices A, B, C, D and M as rows; p states, n cables, 3 + n sensors: B has 3 + 2 n columns."""

    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix
    M: Matrix


class Plan(NamedTuple):
    """A controller made for a path.

    ``period`` h in s; at each of N samples ``speeds`` (n) for inelastic cables and ``stretches`` (n), which cancel
    stretch and make F of these, in m/s, and ``expected`` r (3 + n), position in m and tensions in N; ``at_rest`` (n)
    are the tensions before the start. ``knots`` are the samples at which ``gains`` hold. ``compliances`` (n) are
    l / (E S), in m/N, and ``yield_time`` is tau, in s.
    """

    period: float
    speeds: Matrix
    stretches: Matrix
    expected: Matrix
    at_rest: Vector
    knots: Sequence[float]
    gains: Sequence[Gains]
    compliances: Vector
    yield_time: float
    tares: bool


class Limits(NamedTuple):
    """Bounds of the rope's speed (m/s) and acceleration (m/s^2), and of the tension (N)."""

    speed: float
    acceleration: float
    lowest_tension: float
    highest_tension: float


class Memory(NamedTuple):
    """Where a controller is: in which sample, its state, winch speeds at both ends of it, the last tensions seen.

    ``tensions`` are of the sample before this one, ``earlier`` of the one before that; ``scales`` (n) are what the
    tare has found.
    """

    sample: int
    state: Vector
    begin: Vector
    end: Vector
    tensions: Vector
    earlier: Vector
    scales: Vector


def plan_of(data: Dict[str, Any]) -> Plan:
    """The plan that a resource holds."""
    return Plan(
        data["period"],
        data["speeds"],
        data["stretches"],
        data["expected"],
        data["at_rest"],
        [knot["sample"] for knot in data["knots"]],
        [Gains(*(knot[name] for name in Gains._fields)) for knot in data["knots"]],
        data["compliances"],
        data["yield_time"],
        data["tares"],
    )


def first_sample(plan: Plan, limits: Limits) -> Memory:
    """At the start of the path: nothing seen, the state zero."""
    scales = [1.0] * len(plan.compliances)
    begin = [_cut(speed, -limits.speed, limits.speed) for speed in _forward(plan, scales, 0)]
    state = [0.0] * len(plan.gains[0].A)
    tensions = plan.expected[0][3:]
    start = Memory(0, state, begin, begin, tensions, tensions, scales)
    return start._replace(end=_ahead(plan, limits, start))


def next_sample(plan: Plan, limits: Limits, memory: Memory, measured: Vector) -> Memory:
    """The next sample, by what the sensors showed at the begin of this one: position in m, then tensions in N."""
    k, scales = memory.sample, memory.scales
    if plan.tares and k == 0:
        scales = [_scale(seen, expected) for seen, expected in zip(measured[3:], plan.at_rest)]
    gains = gains_at(plan, k)
    away = _less(memory.begin, _forward(plan, scales, k))
    asked = _asked(gains, memory.state, away)
    ahead = _less(memory.end, _forward(plan, scales, k + 1))
    missed = [(b - a) / plan.period - wanted for a, b, wanted in zip(away, ahead, asked)]
    seen = _less(measured, _expected(plan, scales, k)) + away
    state = [
        _dot(row, memory.state) + _dot(driven, seen) + _dot(told, missed)
        for row, driven, told in zip(gains.A, gains.B, gains.M)
    ]
    tensions = measured[3:]
    # At the first sample there is no rate: those remembered were only expected.
    earlier = memory.tensions if k > 0 else tensions
    following = Memory(k + 1, state, memory.end, memory.end, tensions, earlier, scales)
    return following._replace(end=_ahead(plan, limits, following))


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


def _ahead(plan: Plan, limits: Limits, memory: Memory) -> List[float]:
    """The winch speeds at the end of the sample, within the limits; those of the winch have the last word."""
    k = memory.sample
    there = _forward(plan, memory.scales, k + 1)
    away = _less(memory.begin, _forward(plan, memory.scales, k))
    asked = _asked(gains_at(plan, k), memory.state, away)
    reach = plan.period * limits.acceleration
    found = []
    for speed, then, off, wanted, compliance, tension, before in zip(
        memory.begin, there, away, asked, plan.compliances, memory.tensions, memory.earlier
    ):
        give, rising = compliance / plan.yield_time, DAMPED * (tension - before) / plan.period
        lower = give * ((limits.lowest_tension - tension) / plan.yield_time - rising)
        upper = give * ((limits.highest_tension - tension) / plan.yield_time - rising)
        free = then + off + plan.period * _cut(wanted, lower, upper)
        held = _cut(free, speed - reach, speed + reach)
        found.append(_cut(held, -limits.speed, limits.speed))
    return found


def _asked(gains: Gains, state: Vector, away: Vector) -> List[float]:
    return [_dot(row, state) + _dot(own, away) for row, own in zip(gains.C, gains.D)]


def _forward(plan: Plan, scales: Vector, k: int) -> List[float]:
    """The speeds F of a sample."""
    rows = zip(_row(plan.speeds, k), scales, _row(plan.stretches, k))
    return [speed + scale * stretch for speed, scale, stretch in rows]


def _expected(plan: Plan, scales: Vector, k: int) -> List[float]:
    """What the sensors shall show at a sample."""
    row = _row(plan.expected, k)
    return [*row[:3], *map(mul, scales, row[3:])]


def _scale(seen: float, expected: float) -> float:
    """By what a tension differs from the one expected; nothing where that tells nothing."""
    return _cut(seen / expected, SMALLEST_SCALE, LARGEST_SCALE) if expected > 0.0 else 1.0


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
