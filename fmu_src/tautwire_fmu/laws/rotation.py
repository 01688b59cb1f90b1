"""Rotations by unit quaternions (w, x, y, z) from the platform's frame to the world, for any kind of number."""

from typing import Any, Sequence, Tuple

from .mathematics import Mathematics
from .vectors import Vector, add, cross, dot, scale

Quaternion = Sequence[Any]
Matrix = Tuple[Vector, Vector, Vector]

IDENTITY: Quaternion = (1.0, 0.0, 0.0, 0.0)

# Squared angle, in rad^2, below which the series to the sixth power replaces sine and cosine: it errs by 1e-19 there.
MAX_SERIES_ANGLE_SQUARED = 1e-3
# Squared sine of half the angle below which a series to the eighth power replaces its inverse: it errs by 1e-16.
MAX_SERIES_SINE_SQUARED = 1e-3
# The same of the rate of a rotation vector, whose closed form cancels.
MAX_RATE_SERIES_ANGLE_SQUARED = 1e-2


def rotate(quaternion: Quaternion, vector: Vector) -> Vector:
    """Rotation of a vector by a unit quaternion: ``R v = v + 2 w (u x v) + 2 u x (u x v)``."""
    w, axis = quaternion[0], quaternion[1:]
    doubled = scale(2.0, cross(axis, vector))
    return add(vector, add(scale(w, doubled), cross(axis, doubled)))


def rotate_back(quaternion: Quaternion, vector: Vector) -> Vector:
    """Rotation of a vector by the inverse of a unit quaternion: ``R^T v``."""
    w, x, y, z = quaternion
    return rotate((w, -x, -y, -z), vector)


def multiply(p: Quaternion, q: Quaternion) -> Quaternion:
    """Hamilton product ``p q``: the rotation by ``q`` followed by that by ``p``."""
    scalar = p[0] * q[0] - dot(p[1:], q[1:])
    x, y, z = add(add(scale(p[0], q[1:]), scale(q[0], p[1:])), cross(p[1:], q[1:]))
    return (scalar, x, y, z)


def quaternion_of(m: Mathematics, rotation_vector: Vector) -> Quaternion:
    """Unit quaternion of a rotation vector r in rad: ``(cos(|r| / 2), r sin(|r| / 2) / |r|)``.

    Smooth and differentiable at no rotation, where a series replaces the quotient.
    """
    squared = dot(rotation_vector, rotation_vector)
    is_large = squared - MAX_SERIES_ANGLE_SQUARED
    angle = m.sqrt(m.where(is_large, squared, 1.0))
    cosine_series = 1.0 - squared * (1.0 / 8.0 - squared * (1.0 / 384.0 - squared / 46080.0))
    sine_series = 0.5 - squared * (1.0 / 48.0 - squared * (1.0 / 3840.0 - squared / 645120.0))
    scalar = m.where(is_large, m.cos(0.5 * angle), cosine_series)
    x, y, z = scale(m.where(is_large, m.sin(0.5 * angle) / angle, sine_series), rotation_vector)
    return (scalar, x, y, z)


def rotation_vector_of(m: Mathematics, quaternion: Quaternion) -> Vector:
    """Rotation vector in rad, of at most half a turn, of a unit quaternion of either sign: ``2 atan2(|v|, w) v / |v|``.

    Smooth and differentiable at no rotation, where a series replaces the quotient.
    """
    w = quaternion[0]
    sign = m.where(w, 1.0, -1.0)
    scalar, axis = sign * w, scale(sign, quaternion[1:])
    squared = dot(axis, axis)
    is_large = squared - MAX_SERIES_SINE_SQUARED
    sine = m.sqrt(m.where(is_large, squared, 1.0))
    ratio = squared / m.where(is_large, 1.0, scalar * scalar)
    tail = ratio * (1.0 / 7.0 - ratio / 9.0)
    series = (2.0 / m.where(is_large, 1.0, scalar)) * (1.0 - ratio * (1.0 / 3.0 - ratio * (1.0 / 5.0 - tail)))
    return scale(m.where(is_large, 2.0 * m.atan2(sine, scalar) / sine, series), axis)


def quaternion_to_vertical(m: Mathematics, axis: Vector) -> Quaternion:
    """Unit quaternion of the shortest rotation that takes a unit vector to the vertical, from numbers."""
    x, y, z = axis
    if z <= -1.0:
        return (0.0, 1.0, 0.0, 0.0)
    scalar = m.sqrt(0.5 * (1.0 + z))
    return (scalar, 0.5 * y / scalar, -0.5 * x / scalar, 0.0)


def rotation_matrix(quaternion: Quaternion) -> Matrix:
    """Rotation matrix R of a unit quaternion, by rows: ``v_world = R v_platform``."""
    w, x, y, z = quaternion
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
        (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
        (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
    )


def quaternion_rate(quaternion: Quaternion, angular_velocity: Vector) -> Quaternion:
    """Rate of a unit quaternion by the angular velocity in the turned axes (rad/s): ``dq/dt = q (0, omega) / 2``.

    Source: Hairer, Lubich and Wanner (2006), Geometric Numerical Integration, section VII.5.
    """
    w, x, y, z = multiply(quaternion, (0.0, *angular_velocity))
    return (0.5 * w, 0.5 * x, 0.5 * y, 0.5 * z)


def rotation_vector_rate(m: Mathematics, rotation_vector: Vector, angular_velocity: Vector) -> Vector:
    """Rate of a rotation vector r (rad) by the angular velocity (rad/s), both in the axes of the turned body.

    ``dr/dt = omega + r x omega / 2 + k r x (r x omega)``, ``k = (1 - p / 2 cot(p / 2)) / p^2`` with ``p = |r|``. In the
    axes from which r counts it is the same with ``-r`` in place of ``r``.

    Source: Hairer, Lubich and Wanner (2006), Geometric Numerical Integration, section IV.7.
    """
    squared = dot(rotation_vector, rotation_vector)
    is_large = squared - MAX_RATE_SERIES_ANGLE_SQUARED
    safe = m.where(is_large, squared, 1.0)
    half = 0.5 * m.sqrt(safe)
    closed = (1.0 - half * m.cos(half) / m.sin(half)) / safe
    tail = squared * (1.0 / 1209600.0 + squared / 47900160.0)
    series = 1.0 / 12.0 + squared * (1.0 / 720.0 + squared * (1.0 / 30240.0 + tail))
    first = cross(rotation_vector, angular_velocity)
    second = cross(rotation_vector, first)
    return add(angular_velocity, add(scale(0.5, first), scale(m.where(is_large, closed, series), second)))
