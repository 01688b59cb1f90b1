"""Rotation of a rigid body over a step, by Hermite quadrature of its moment and of a rotation vector.

The orientation is ``q(t) = q_middle exp(phi(t))``, with the rotation vector phi in the platform's axes and

    phi' = omega + phi x omega / 2 + k(|phi|) phi x (phi x omega),   k(p) = (1 - p / 2 cot(p / 2)) / p^2

Angular momentum and phi are integrated as the Hermite polynomials through moment and phi', each with its rate, at both
ends of the step, and in its middle where the forces are known there. As phi counts from the middle, the step is
symmetric in time, so that energy does not drift. Orientations are products of unit quaternions.

Source: Hairer, Lubich and Wanner (2006), Geometric Numerical Integration, sections IV.8, V.1 and V.4.
"""

from typing import Callable, NamedTuple, Optional, Sequence, Tuple

from .hermite_quadrature import CUBIC_END, CUBIC_MIDDLE, QUINTIC_END, QUINTIC_MIDDLE, apply_weights
from .laws import rigid_body as law
from .laws.mathematics import COMPLEX_STEP, REAL, Mathematics, rates_of, vector_with_rates
from .laws.rotation import Matrix, Quaternion, multiply, quaternion_of, rotation_matrix, rotation_vector_rate
from .laws.vectors import Vector, add, scale, subtract

MAX_SWEEPS = 40
ANGLE_TOLERANCE = 1e-16  # rad
ORIGIN = (0.0, 0.0, 0.0)

VectorPair = Tuple[Vector, Vector]


class Body(NamedTuple):
    """Inertia of a body, and the moment of effects (N m) by the angular velocity (rad/s), in the world's axes."""

    inertia: law.Inertia
    moment_of_effects: Optional[Callable[[Mathematics, Vector], Vector]] = None


class Load(NamedTuple):
    """Load at an instant: the forces' :func:`law.moment_matrix`, and the external moment in N m, each with its rate."""

    forces: Matrix
    force_rates: Matrix
    moment: Vector = ORIGIN
    moment_rate: Vector = ORIGIN


class RotationState(NamedTuple):
    """Unit quaternion from the platform's axes to the world's, and angular momentum in the latter, in N m s."""

    quaternion: Quaternion
    momentum: Vector


class Rotation(NamedTuple):
    """Rotation over a step: the state at its end, and the attitudes in its middle and at its end."""

    end: RotationState
    middle_attitude: law.Attitude
    end_attitude: law.Attitude


def attitude_of(body: Body, state: RotationState, load: Load) -> law.Attitude:
    """Attitude of a body under a load."""
    rotation = rotation_matrix(state.quaternion)
    velocity = law.angular_velocity(body.inertia, rotation, state.momentum)
    return _attitude(body, rotation, state.momentum, _moment(body, rotation, velocity, load))


def integrate_rotation(body: Body, start: RotationState, loads: Sequence[Load], step: float) -> Rotation:
    """Rotation over a step under ``loads`` at both ends, or at both ends and in the middle.

    Fixed-point sweeps solve for the later nodes. Raises ArithmeticError where the step is too long for them.
    """
    middle_weights, end_weights = (QUINTIC_MIDDLE, QUINTIC_END) if len(loads) == 3 else (CUBIC_MIDDLE, CUBIC_END)
    first = attitude_of(body, start, loads[0])
    first_moment = _moment_with_rate(body, first, loads[0])
    angles = (_taylor(ORIGIN, first[1:], 0.5 * step), _taylor(ORIGIN, first[1:], step))
    velocity = _taylor(first.velocity, (first.acceleration, ORIGIN), 0.5 * step)
    attitudes = [first._replace(velocity=velocity)] * (len(loads) - 1)
    change = ANGLE_TOLERANCE
    for _ in range(MAX_SWEEPS):
        quaternions = _quaternions(start.quaternion, angles)
        rotations = [rotation_matrix(quaternion) for quaternion in quaternions[3 - len(loads) :]]
        attitudes = [attitude._replace(rotation=each) for attitude, each in zip(attitudes, rotations)]
        moments = [first_moment, *(_moment_with_rate(body, *each) for each in zip(attitudes, loads[1:]))]
        momenta = [
            apply_weights(start.momentum, moments, step, step * step, weights.velocity)
            for weights in (middle_weights, end_weights)
        ]
        attitudes = [
            _attitude(body, rotation, momentum, moment)
            for rotation, momentum, (moment, _) in zip(rotations, momenta[3 - len(loads) :], moments[1:])
        ]
        nodes = _angle_nodes([first, *attitudes], angles)
        previous_angles, previous_change = angles, change
        angles = (
            apply_weights(ORIGIN, nodes, step, step * step, middle_weights.velocity),
            apply_weights(ORIGIN, nodes, step, step * step, end_weights.velocity),
        )
        change = max(abs(a - b) for new, old in zip(angles, previous_angles) for a, b in zip(new, old))
        # The next change is predicted by the ratio of the last two, once there are two.
        if change * min(1.0, change / previous_change) <= ANGLE_TOLERANCE:
            break
    else:
        raise ArithmeticError(f"the rotation does not converge, the last change is {change:.1g} rad")
    middle, end = map(RotationState, _quaternions(start.quaternion, angles), momenta)
    if len(loads) == 3:
        middle_attitude = attitude_of(body, middle, loads[1])
    else:
        rotation = rotation_matrix(middle.quaternion)
        moment = apply_weights(ORIGIN, moments, 1.0, step, middle_weights.acceleration)
        middle_attitude = _attitude(body, rotation, middle.momentum, moment)
    end = end._replace(quaternion=_normalised(end.quaternion))
    return Rotation(end, middle_attitude, attitude_of(body, end, loads[-1]))


def _angle_nodes(attitudes: Sequence[law.Attitude], angles: VectorPair) -> Sequence[VectorPair]:
    """Rate of the rotation vector, and the rate of that, at each node; ``angles`` lead from the start to the others."""
    middle, end = angles
    to_start, to_end = scale(-1.0, middle), subtract(end, middle)
    first, last = attitudes[0], attitudes[-1]
    in_the_middle = [attitude[1:] for attitude in attitudes[1:-1]]
    return [_angle_node(first, to_start), *in_the_middle, _angle_node(last, to_end)]


def _angle_node(attitude: law.Attitude, angles: Vector) -> VectorPair:
    rate = rotation_vector_rate(REAL, angles, attitude.velocity)
    with_rates = vector_with_rates(angles, rate), vector_with_rates(attitude.velocity, attitude.acceleration)
    return rate, rates_of(rotation_vector_rate(COMPLEX_STEP, *with_rates))


def _quaternions(start: Quaternion, angles: VectorPair) -> Tuple[Quaternion, Quaternion]:
    """Orientations in the middle and at the end of the step."""
    middle = multiply(start, quaternion_of(REAL, angles[0]))
    return middle, multiply(middle, quaternion_of(REAL, subtract(angles[1], angles[0])))


def _normalised(quaternion: Quaternion) -> Quaternion:
    w, x, y, z = quaternion
    length = REAL.sqrt(w * w + x * x + y * y + z * z)
    return (w / length, x / length, y / length, z / length)


def _taylor(value: Vector, rates: VectorPair, elapsed: float) -> Vector:
    return add(value, add(scale(elapsed, rates[0]), scale(0.5 * elapsed * elapsed, rates[1])))


def _attitude(body: Body, rotation: Matrix, momentum: Vector, moment: Vector) -> law.Attitude:
    velocity = law.angular_velocity(body.inertia, rotation, momentum)
    return law.Attitude(rotation, velocity, law.angular_acceleration(body.inertia, rotation, velocity, moment))


def _moment(body: Body, rotation: Matrix, velocity: Vector, load: Load) -> Vector:
    """Moment about the centre of mass in the world's axes."""
    moment = add(law.moment(rotation, load.forces), load.moment)
    if body.moment_of_effects is None:
        return moment
    return add(moment, body.moment_of_effects(REAL, law.transform(rotation, velocity)))


def _moment_with_rate(body: Body, attitude: law.Attitude, load: Load) -> VectorPair:
    """Moment about the centre of mass in the world's axes, and its rate."""
    rotation, velocity, acceleration = attitude
    rate = add(law.moment(rotation, load.force_rates), law.moment(law.rotation_rate(rotation, velocity), load.forces))
    rate = add(rate, load.moment_rate)
    if body.moment_of_effects is not None:
        world = law.transform(rotation, velocity), law.transform(rotation, acceleration)
        rate = add(rate, rates_of(body.moment_of_effects(COMPLEX_STEP, vector_with_rates(*world))))
    return _moment(body, rotation, velocity, load), rate
