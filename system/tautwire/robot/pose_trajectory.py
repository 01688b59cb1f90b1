"""Reference paths of a platform that turns: a trajectory of its origin with one of its orientation.

Orientations are given by a rotation vector r(t) in rad, in the axes of the world: ``q(t) = exp(r(t)) q_0``. Then

    omega = J(r) dr/dt,    J(r) = I + a(p) [r] + b(p) [r]^2,    a(p) = (1 - cos p) / p^2,    b(p) = (p - sin p) / p^3

with ``p = |r|`` and ``[r] v = r x v``. Where r keeps its direction, omega is dr/dt.

Source: Hairer, Lubich and Wanner (2006), Geometric Numerical Integration, section IV.7; Shoemake (1985), Animating
rotation with quaternion curves, for slerp.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, TypeGuard, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tautwire_fmu.laws.rotation import multiply, quaternion_of

from ..array_validation import validate_array, validate_quaternion
from ..errors import ArgumentError
from ..validation import validate_number
from .robot_assembly import NUMPY_MATHEMATICS
from .schema import Quaternion
from .trajectory import DURATION_RULE, Line, Trajectory

Array = NDArray[np.float64]

# Below this angle in rad series replace the quotients, which cancel there.
MAX_SERIES_ANGLE = 0.1
# Farthest turn of a slerp in rad: beyond it the other way round is as short.
MAX_SLERP_ANGLE = np.pi - 1e-6


@runtime_checkable
class TurningTrajectory(Trajectory, Protocol):
    """Interface of a trajectory that also turns the platform; a trajectory without these keeps the start orientation.

    Each method takes times (N,) in s. Vectors are in the axes of the world.
    """

    def orientation(self, times: Array) -> Array:
        """Reference orientation, unit quaternions w, x, y, z from the platform's frame to the world, (N, 4)."""
        ...

    def angular_velocity(self, times: Array) -> Array:
        """Reference angular velocity, (N, 3) in rad/s."""
        ...

    def angular_acceleration(self, times: Array) -> Array:
        """Reference angular acceleration, (N, 3) in rad/s^2."""
        ...


@dataclass(frozen=True)
class OrientationTrajectory:
    """An orientation over time: ``start`` turned by a ``rotation_vector`` (rad), which is a trajectory itself."""

    start: Quaternion
    rotation_vector: Trajectory

    @property
    def duration(self) -> float:
        """Time of arrival in s."""
        return self.rotation_vector.duration

    def orientation(self, times: Array) -> Array:
        """Reference orientation, (N, 4)."""
        turned = quaternion_of(NUMPY_MATHEMATICS, self.rotation_vector.position(times).T)
        return np.column_stack(multiply(turned, self.start))

    def angular_velocity(self, times: Array) -> Array:
        """Reference angular velocity, (N, 3) in rad/s."""
        return self._angular_motion(times)[0]

    def angular_acceleration(self, times: Array) -> Array:
        """Reference angular acceleration, (N, 3) in rad/s^2."""
        return self._angular_motion(times)[1]

    def _angular_motion(self, times: Array) -> tuple[Array, Array]:
        path = self.rotation_vector
        return angular_motion(path.position(times), path.velocity(times), path.acceleration(times))


def slerp(start: Quaternion, end: Quaternion, duration: float) -> OrientationTrajectory:
    """Slerp from rest to rest: the shortest turn about one axis, within ``duration`` (s), by the fifth-order law.

    ``q = exp(s(t) r) start`` with ``exp(r) start = end`` and s of :func:`tautwire.robot.trajectory.quintic_law`.
    ``start`` and ``end`` are unit quaternions w, x, y, z of either sign.

    Raises ArgumentError where a quaternion or the duration is invalid, or the turn is half a revolution, of which there
    is no shortest one.
    """
    first, last = (validate_quaternion(f"slerp: {name}", value) for name, value in {"start": start, "end": end}.items())
    seconds = validate_number("slerp: duration", duration, DURATION_RULE)
    x, y, z = (_rotation(last) * _rotation(first).inv()).as_rotvec().tolist()
    angle = float(np.linalg.norm([x, y, z]))
    if angle > MAX_SLERP_ANGLE:
        problem = f"is {np.degrees(angle):g} degrees from the start, so that both ways round are as short"
        raise ArgumentError("slerp: end", end, problem, "turn in two parts")
    return OrientationTrajectory(first, Line((0.0, 0.0, 0.0), (x, y, z), seconds))


@dataclass(frozen=True)
class PoseTrajectory:
    """A trajectory of a platform's pose: ``translation`` of the origin of its frame, and ``rotation``.

    Both begin at 0 s; the duration is the longer one.
    """

    translation: Trajectory
    rotation: OrientationTrajectory

    @property
    def duration(self) -> float:
        """Time of arrival in s."""
        return max(self.translation.duration, self.rotation.duration)

    def position(self, times: Array) -> Array:
        """Reference position, (N, 3) in m."""
        return self.translation.position(times)

    def velocity(self, times: Array) -> Array:
        """Reference velocity, (N, 3) in m/s."""
        return self.translation.velocity(times)

    def acceleration(self, times: Array) -> Array:
        """Reference acceleration, (N, 3) in m/s^2."""
        return self.translation.acceleration(times)

    def orientation(self, times: Array) -> Array:
        """Reference orientation, unit quaternions, (N, 4)."""
        return self.rotation.orientation(times)

    def angular_velocity(self, times: Array) -> Array:
        """Reference angular velocity, (N, 3) in rad/s."""
        return self.rotation.angular_velocity(times)

    def angular_acceleration(self, times: Array) -> Array:
        """Reference angular acceleration, (N, 3) in rad/s^2."""
        return self.rotation.angular_acceleration(times)


def turns(trajectory: Trajectory) -> TypeGuard[TurningTrajectory]:
    """Whether a trajectory has orientations."""
    return isinstance(trajectory, TurningTrajectory)


def evaluate_path(where: str, trajectory: Trajectory, quantity: str, times: Array) -> Array:
    """A quantity of a trajectory, possibly the user's, at times (N,): finite numbers; raises ArgumentError."""
    width, columns = (4, "w, x, y, z") if quantity == "orientation" else (3, "x, y, z")
    meaning = f"a path whose {quantity}(times) has a finite row {columns} for each of the {len(times)} times"
    values = getattr(trajectory, quantity)(times)
    return validate_array(f"{where}: trajectory.{quantity}", values, (len(times), width), meaning)


def angular_motion(rotation: Array, rate: Array, second_rate: Array) -> tuple[Array, Array]:
    """Angular velocity (rad/s) and acceleration (rad/s^2) by a rotation vector (rad) and two rates, all (N, 3)."""
    squared = np.sum(rotation**2, axis=1)
    a, b, a_slope, b_slope = (factor[:, None] for factor in _jacobian_factors(squared))
    growth = np.sum(rotation * rate, axis=1)[:, None]
    across, across_second = np.cross(rotation, rate), np.cross(rotation, second_rate)
    velocity = rate + a * across + b * np.cross(rotation, across)
    acceleration = second_rate + a * across_second + b * np.cross(rotation, across_second)
    # The rate of J along the path, times the rate of the rotation vector.
    acceleration += growth * (a_slope * across + b_slope * np.cross(rotation, across)) + b * np.cross(rate, across)
    return velocity, acceleration


def _jacobian_factors(squared: Array) -> tuple[Array, Array, Array, Array]:
    """``a``, ``b``, and their derivatives by the angle divided by the angle, at squared angles (N,)."""
    is_small = squared < MAX_SERIES_ANGLE**2
    p = np.sqrt(np.where(is_small, 1.0, squared))
    sine, cosine, s = np.sin(p), np.cos(p), np.where(is_small, squared, 0.0)
    closed = (
        (1.0 - cosine) / p**2,
        (p - sine) / p**3,
        (p * sine - 2.0 * (1.0 - cosine)) / p**4,
        (3.0 * sine - p * (2.0 + cosine)) / p**5,
    )
    series = (
        1.0 / 2.0 - s * (1.0 / 24.0 - s * (1.0 / 720.0 - s / 40320.0)),
        1.0 / 6.0 - s * (1.0 / 120.0 - s * (1.0 / 5040.0 - s / 362880.0)),
        -1.0 / 12.0 + s * (1.0 / 180.0 - s * (1.0 / 6720.0 - s / 453600.0)),
        -1.0 / 60.0 + s * (1.0 / 1260.0 - s * (1.0 / 60480.0 - s / 4989600.0)),
    )
    a, b, a_slope, b_slope = (np.where(is_small, near, far) for near, far in zip(series, closed, strict=True))
    return a, b, a_slope, b_slope


def rotation_vectors_between(orientations: Array, references: Array) -> Array:
    """Rotation vectors (N, 3) in rad, in the axes of the world, from reference orientations (N, 4) to others."""
    return np.asarray((_rotation(orientations) * _rotation(references).inv()).as_rotvec(), dtype=np.float64)


def rotation_matrices(orientations: Array) -> Array:
    """Rotation matrices (N, 3, 3) of unit quaternions (N, 4)."""
    return np.asarray(_rotation(orientations).as_matrix(), dtype=np.float64)


def _rotation(quaternions: Quaternion | Array) -> Rotation:
    return Rotation.from_quat(np.asarray(quaternions, dtype=float)[..., [1, 2, 3, 0]])
