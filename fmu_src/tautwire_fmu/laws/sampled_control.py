"""Sampled-data controller on a path: from measurements to the next winch speeds.

Within sample k, of length h, the winch speeds are ramps from ``V_k`` to ``V_k+1``. F are the feedforward speeds, r the
reference measurements and y the measurements, ``w_k = V_k - F_k``:

    a_k   = C x_k + D w_k                                        demanded acceleration
    V_k+1 = F_k+1 + w_k + h a_k, within the limits               next speed
    x_k+1 = A x_k + B (y_k - r_k, w_k) + M (limited a_k - a_k)

``x_k`` depends on samples before k only: one sample of computation delay. M is the anti-windup gain: it feeds the
limited acceleration back to the state. Between the knots of a gain schedule all matrices are interpolated linearly.

Of a platform that turns, y and r have a unit quaternion behind the position; ``y_k - r_k`` then has the rotation vector
of ``q_y q_r^-1`` there, in rad in the axes of the world, whatever the signs of both.

A cable's tension T is kept below a limit L by a bound on the demand beyond the feedforward, the one that would
take T to L as a mode of angular frequency 1 / tau and damping ratio 0.7, ``a <= (l / E S) ((L - T) / tau - 1.4 dT/dt)
/ tau``, from T as measured a sample before; likewise from below. Where the static tension exceeds L the cable yields.

A plan that ``tares`` assumes the platform at rest at the start: the first tensions measured, over those expected, scale
all expected tensions and the speeds that cancel stretch. This compensates an undeclared payload.

Source: Astrom and Rundqwist (1989), Integrator windup and how to avoid it, American Control Conference, for M.
"""

from operator import mul
from typing import Any, Dict, List, NamedTuple, Sequence

from .mathematics import REAL
from .rotation import multiply, rotation_vector_of

Vector = Sequence[float]
Matrix = Sequence[Vector]

# Twice the damping ratio with which a tension approaches its limit.
TWICE_TENSION_DAMPING_RATIO = 1.4
POSITION_SIZE = 3
MIN_TENSION_SCALE, MAX_TENSION_SCALE = 0.5, 2.0


class Gains(NamedTuple):
    """Controller matrices A, B, C, D and M as rows; p states, n cables, d degrees of freedom: B has d + 2 n columns."""

    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix
    M: Matrix


class ControlPlan(NamedTuple):
    """Controller designed for a path.

    ``period`` h in s; at each of N samples ``speeds`` (n) for inelastic cables and ``stretches`` (n), which cancel
    stretch and make F of these, in m/s, and ``expected`` r, the pose and tensions in N: (3 + n) with the position in m,
    (7 + n) with a unit quaternion behind it. ``at_rest`` (n) are the tensions before the start. ``knots`` are the
    samples at which ``gains`` hold. ``compliances`` (n) are l / (E S), in m/N, and ``yield_time`` is tau, in s.
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

    @property
    def pose_size(self) -> int:
        """How many numbers of a measurement are the pose: 3, or 7 with an orientation."""
        return len(self.expected[0]) - len(self.compliances)


class Limits(NamedTuple):
    """Bounds of the rope's speed (m/s) and acceleration (m/s^2), and of the tension (N)."""

    speed: float
    acceleration: float
    lowest_tension: float
    highest_tension: float


class ControllerState(NamedTuple):
    """State of the controller: sample, state vector, winch speeds at both ends of the sample, last measured tensions.

    ``tensions`` are of the sample before this one, ``earlier`` of the one before that; ``scales`` (n) are the
    ratios by the tare.
    """

    sample: int
    state: Vector
    begin: Vector
    end: Vector
    tensions: Vector
    earlier: Vector
    scales: Vector


def plan_from_resource(data: Dict[str, Any]) -> ControlPlan:
    """Controller plan from the JSON resource."""
    return ControlPlan(
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


def initial_controller_state(plan: ControlPlan, limits: Limits) -> ControllerState:
    """Controller state at the start of the path: nothing measured, the state vector zero."""
    scales = [1.0] * len(plan.compliances)
    start_speeds = [_clamp(speed, -limits.speed, limits.speed) for speed in _feedforward_speeds(plan, scales, 0)]
    state = [0.0] * len(plan.gains[0].A)
    tensions = plan.expected[0][plan.pose_size :]
    initial_state = ControllerState(0, state, start_speeds, start_speeds, tensions, tensions, scales)
    return initial_state._replace(end=_limited_end_speeds(plan, limits, initial_state))


def next_controller_state(
    plan: ControlPlan, limits: Limits, controller_state: ControllerState, measured: Vector
) -> ControllerState:
    """Controller state of the next sample, from the measurements at the start of this one.

    ``measured`` is the position in m, of a platform that turns its orientation, then the tensions in N.
    """
    k, scales, tensions = controller_state.sample, controller_state.scales, measured[plan.pose_size :]
    if plan.tares and k == 0:
        scales = [_tension_scale(tension, expected) for tension, expected in zip(tensions, plan.at_rest)]
    gains = gains_at(plan, k)
    speed_deviations = _difference(controller_state.begin, _feedforward_speeds(plan, scales, k))
    demanded_accelerations = _demanded_accelerations(gains, controller_state.state, speed_deviations)
    next_speed_deviations = _difference(controller_state.end, _feedforward_speeds(plan, scales, k + 1))
    saturation_errors = [
        (b - a) / plan.period - wanted
        for a, b, wanted in zip(speed_deviations, next_speed_deviations, demanded_accelerations)
    ]
    seen = _measured_deviations(plan, measured, _expected_measurements(plan, scales, k)) + speed_deviations
    state = [
        _dot(row, controller_state.state) + _dot(input_row, seen) + _dot(anti_windup_row, saturation_errors)
        for row, input_row, anti_windup_row in zip(gains.A, gains.B, gains.M)
    ]
    # At the first sample there is no rate: the stored tensions were only expected.
    earlier_tensions = controller_state.tensions if k > 0 else tensions
    next_state = ControllerState(
        k + 1, state, controller_state.end, controller_state.end, tensions, earlier_tensions, scales
    )
    return next_state._replace(end=_limited_end_speeds(plan, limits, next_state))


def gains_at(plan: ControlPlan, sample: int) -> Gains:
    """Scheduled gains at a sample; before the first and after the last knot those of that knot."""
    knots = plan.knots
    next_knot = next((place for place, knot in enumerate(knots) if knot > sample), len(knots))
    if next_knot == 0 or next_knot == len(knots):
        return plan.gains[max(next_knot - 1, 0)]
    weight = (sample - knots[next_knot - 1]) / (knots[next_knot] - knots[next_knot - 1])
    return Gains(*(_interpolated(a, b, weight) for a, b in zip(plan.gains[next_knot - 1], plan.gains[next_knot])))


def acceleration(plan: ControlPlan, controller_state: ControllerState) -> List[float]:
    """Accelerations of the ropes within the sample, in m/s^2."""
    return [(after - before) / plan.period for before, after in zip(controller_state.begin, controller_state.end)]


def _limited_end_speeds(plan: ControlPlan, limits: Limits, controller_state: ControllerState) -> List[float]:
    """Winch speeds at the end of the sample that the gains demand, within the limits."""
    k = controller_state.sample
    speed_deviations = _difference(controller_state.begin, _feedforward_speeds(plan, controller_state.scales, k))
    demanded_accelerations = _demanded_accelerations(gains_at(plan, k), controller_state.state, speed_deviations)
    return _end_speeds(plan, limits, controller_state, demanded_accelerations)


def state_after_demanded_speeds(
    plan: ControlPlan, limits: Limits, controller_state: ControllerState, measured: Vector, speeds: Vector
) -> ControllerState:
    """Controller state of the next sample, at whose end the winches have the demanded ``speeds``, within the limits.

    For laws other than that of the gains; ``measured`` is as for :func:`next_controller_state`.
    """
    k, begin = controller_state.sample + 1, controller_state.end
    tensions = measured[plan.pose_size :]
    earlier_tensions = controller_state.tensions if k > 1 else tensions
    next_state = controller_state._replace(sample=k, begin=begin, tensions=tensions, earlier=earlier_tensions)
    feedforward_changes = _difference(
        _feedforward_speeds(plan, next_state.scales, k + 1), _feedforward_speeds(plan, next_state.scales, k)
    )
    demanded_accelerations = [
        (wanted - speed - change) / plan.period for wanted, speed, change in zip(speeds, begin, feedforward_changes)
    ]
    return next_state._replace(end=_end_speeds(plan, limits, next_state, demanded_accelerations))


def _end_speeds(
    plan: ControlPlan, limits: Limits, controller_state: ControllerState, demanded_accelerations: Vector
) -> List[float]:
    """Winch speeds at the end of the sample, within the limits; the limits of the winch take precedence."""
    k = controller_state.sample
    feedforward_speeds = _feedforward_speeds(plan, controller_state.scales, k + 1)
    speed_deviations = _difference(controller_state.begin, _feedforward_speeds(plan, controller_state.scales, k))
    max_speed_change = plan.period * limits.acceleration
    end_speeds = []
    for speed, feedforward_speed, speed_deviation, demanded_acceleration, compliance, tension, earlier_tension in zip(
        controller_state.begin,
        feedforward_speeds,
        speed_deviations,
        demanded_accelerations,
        plan.compliances,
        controller_state.tensions,
        controller_state.earlier,
    ):
        compliance_rate, damped_tension_rate = (
            compliance / plan.yield_time,
            TWICE_TENSION_DAMPING_RATIO * (tension - earlier_tension) / plan.period,
        )
        lower = compliance_rate * ((limits.lowest_tension - tension) / plan.yield_time - damped_tension_rate)
        upper = compliance_rate * ((limits.highest_tension - tension) / plan.yield_time - damped_tension_rate)
        unlimited_speed = (
            feedforward_speed + speed_deviation + plan.period * _clamp(demanded_acceleration, lower, upper)
        )
        acceleration_limited_speed = _clamp(unlimited_speed, speed - max_speed_change, speed + max_speed_change)
        end_speeds.append(_clamp(acceleration_limited_speed, -limits.speed, limits.speed))
    return end_speeds


def _demanded_accelerations(gains: Gains, state: Vector, speed_deviations: Vector) -> List[float]:
    return [
        _dot(row, state) + _dot(feedthrough_row, speed_deviations) for row, feedthrough_row in zip(gains.C, gains.D)
    ]


def _feedforward_speeds(plan: ControlPlan, scales: Vector, k: int) -> List[float]:
    """Feedforward speeds F of a sample."""
    rows = zip(_row_or_last(plan.speeds, k), scales, _row_or_last(plan.stretches, k))
    return [speed + scale * stretch for speed, scale, stretch in rows]


def _expected_measurements(plan: ControlPlan, scales: Vector, k: int) -> List[float]:
    """Reference measurements at a sample, tensions scaled by the tare."""
    row = _row_or_last(plan.expected, k)
    return [*row[: plan.pose_size], *map(mul, scales, row[plan.pose_size :])]


def _measured_deviations(plan: ControlPlan, measured: Vector, expected: Vector) -> List[float]:
    """Measured minus expected position, rotation where there is an orientation, and tensions."""
    size = plan.pose_size
    position, tensions = _difference(measured[:3], expected[:3]), _difference(measured[size:], expected[size:])
    if size == POSITION_SIZE:
        return position + tensions
    w, x, y, z = expected[POSITION_SIZE:size]
    turned = multiply(measured[POSITION_SIZE:size], (w, -x, -y, -z))
    return [*position, *rotation_vector_of(REAL, turned), *tensions]


def _tension_scale(measured: float, expected: float) -> float:
    """Ratio of a measured to the expected tension, bounded; 1 where none is expected."""
    return _clamp(measured / expected, MIN_TENSION_SCALE, MAX_TENSION_SCALE) if expected > 0.0 else 1.0


def _row_or_last(rows: Matrix, k: int) -> Vector:
    """Row of a sample; the path rests at its last one."""
    return rows[min(k, len(rows) - 1)]


def _interpolated(first: Matrix, second: Matrix, weight: float) -> Matrix:
    return [
        [a + weight * (b - a) for a, b in zip(first_row, second_row)] for first_row, second_row in zip(first, second)
    ]


def _difference(values: Vector, others: Vector) -> List[float]:
    return [a - b for a, b in zip(values, others)]


def _dot(row: Vector, values: Vector) -> float:
    return sum(map(mul, row, values))


def _clamp(value: float, lower: float, upper: float) -> float:
    return min(max(value, lower), upper)
