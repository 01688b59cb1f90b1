"""Kinematics of a robot at a pose: structure matrix, Jacobian, inverse and forward kinematics.

A pose is the position of the platform's frame in m and, of a rigid platform, its orientation as a unit quaternion. A
twist is the velocity of the frame's origin, and of a rigid platform the angular velocity, both in the world's axes.
Pulleys and shifted exit points count where the robot file switches them on; the sag of cables, which depends on their
tensions, does not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from tautwire_fmu.laws.mathematics import REAL
from tautwire_fmu.laws.rotation import multiply, quaternion_of

from ..array_validation import validate_array, validate_quaternion
from ..errors import ArgumentError, InputError, UnreachableError
from ..validation import validate_integer
from .cable_routes import attachment_points, cable_routes
from .schema import Point, Quaternion, Robot, validate_robot

Array = NDArray[np.float64]

DEFAULT_STARTS = 12
START_ANGLE = 1.0  # rad, standard deviation of the rotation of starts about each axis
START_DISTANCE_RATIO = 0.15  # of the mean cable length, standard deviation of starts along each axis
# Poses nearer than these are one solution.
SAME_POSITION_RATIO, SAME_ANGLE = 1e-6, 1e-5
# Minima whose residual is larger than this multiple of the smallest are no solutions; relative to the mean length.
RESIDUAL_RATIO, RESIDUAL_FLOOR = 3.0, 1e-9
UNREACHABLE_RESIDUAL = 1e3  # m, of poses at which a cable has no length


def structure_matrix(
    robot: Robot, position: Sequence[float] | Array | None = None, orientation: Sequence[float] | Array | None = None
) -> Array:
    """Structure matrix (wrench matrix) A at a pose, by default the start as declared: the wrench of tensions T is A T.

    Columns ``(u_i, b_i x u_i)``, shape (6, n): force, and moment about the origin of the platform's frame in m; ``u_i``
    the unit vector along the cable, ``b_i`` from the origin to its attachment, both in the world's axes. Of a point
    mass ``u_i`` alone, shape (3, n).

    Raises UnreachableError where a cable has no length.
    """
    return structure_matrix_at(robot, *validated_pose("structure_matrix", robot, position, orientation))


def structure_matrix_at(robot: Robot, at: Array, quaternion: Quaternion) -> Array:
    """As :func:`structure_matrix`, of arguments that need no validation."""
    directions = np.array([route.direction for route in cable_routes(REAL, robot, at.tolist(), quaternion)]).T
    if not robot.platform.is_rigid_body:
        return directions
    arms = np.array(attachment_points(robot, at.tolist(), quaternion)) - at
    return np.vstack([directions, np.cross(arms, directions.T).T])


def length_jacobian(
    robot: Robot, position: Sequence[float] | Array | None = None, orientation: Sequence[float] | Array | None = None
) -> Array:
    """Jacobian of the cable lengths with respect to the twist at a pose: ``dl/dt = J t``, ``J = -A^T``, shape (n, 6).

    In m/m and m/rad; (n, 3) of a point mass.
    """
    return -structure_matrix(robot, position, orientation).T


def inverse_kinematics(
    robot: Robot, position: Sequence[float] | Array | None = None, orientation: Sequence[float] | Array | None = None
) -> Array:
    """Inverse kinematics: the lengths of taut, straight cables at a pose, with those on pulleys, shape (n,), in m.

    Raises UnreachableError where a cable has no length.
    """
    at, quaternion = validated_pose("inverse_kinematics", robot, position, orientation)
    return np.array([route.length for route in cable_routes(REAL, robot, at.tolist(), quaternion)])


@dataclass(frozen=True)
class ForwardSolution:
    """A pose that cable lengths lead to; ``residual`` is the root mean square of the lengths' errors there, in m."""

    position: Point
    orientation: Quaternion
    residual: float


def forward_kinematics(
    robot: Robot,
    lengths: Sequence[float] | Array,
    position: Sequence[float] | Array | None = None,
    orientation: Sequence[float] | Array | None = None,
    starts: int = DEFAULT_STARTS,
) -> tuple[ForwardSolution, ...]:
    """Forward kinematics: all distinct poses near a guess whose cable lengths fit ``lengths`` (n,) in m best.

    ``min |l(pose) - lengths|^2`` from the guess, by default the start, and from ``starts`` poses about it, the same
    each time. The first solution has the smallest residual; a minimum that misses the lengths three times as far is
    none.

    Raises ArgumentError where the lengths are not (n,), or fewer than the degrees of freedom: then statics decides too.
    """
    validate_robot("forward_kinematics: robot", robot)
    validate_integer("forward_kinematics: starts", starts, 0, "give the number of further starts")
    required = validate_array("forward_kinematics: lengths", lengths, (robot.cable_count,), "one length a cable in m")
    is_rigid = robot.platform.is_rigid_body
    freedoms = 6 if is_rigid else 3
    if robot.cable_count < freedoms:
        problem = f"of {robot.cable_count} cables do not determine {freedoms} degrees of freedom"
        of_ropes = "use forward_kinematics_of_ropes, where statics decides"
        hint = of_ropes if is_rigid else "compute the lengths at positions, as static_pose does"
        raise ArgumentError("forward_kinematics: lengths", lengths, problem, hint)
    at, quaternion = validated_pose("forward_kinematics", robot, position, orientation)
    scale, generator = float(np.mean(required)), np.random.default_rng(0)
    solutions: list[ForwardSolution] = []
    for index in range(1 + starts):
        offset = np.zeros(freedoms) if index == 0 else generator.standard_normal(freedoms)
        start = at + START_DISTANCE_RATIO * scale * offset[:3]
        turned = Rotation.from_rotvec(START_ANGLE * offset[3:]) if is_rigid else Rotation.identity()
        solution = _nearest_pose(robot, required, start, turned * _rotation(quaternion))
        if solution is not None and not any(is_same_pose(solution, other, scale) for other in solutions):
            solutions.append(solution)
    solutions.sort(key=lambda each: each.residual)
    limit = max(RESIDUAL_RATIO * solutions[0].residual, RESIDUAL_FLOOR * scale) if solutions else 0.0
    return tuple(solution for solution in solutions if solution.residual <= limit)


def _nearest_pose(robot: Robot, lengths: Array, start: Array, start_rotation: Rotation) -> ForwardSolution | None:
    """The pose of a local minimum, by least squares over position and rotation vector; None where there is none."""
    is_rigid = robot.platform.is_rigid_body

    def pose_at(variables: Array) -> tuple[Array, Quaternion]:
        rotation = Rotation.from_rotvec(variables[3:]) * start_rotation if is_rigid else start_rotation
        return start + variables[:3], _quaternion(rotation)

    def residuals(variables: Array) -> Array:
        try:
            return inverse_kinematics(robot, *pose_at(variables)) - lengths
        except UnreachableError:
            return np.full(len(lengths), UNREACHABLE_RESIDUAL)

    def jacobian(variables: Array) -> Array:
        matrix = length_jacobian(robot, *pose_at(variables))
        return np.hstack([matrix[:, :3], matrix[:, 3:] @ _left_jacobian(variables[3:])]) if is_rigid else matrix

    try:
        result = least_squares(
            residuals, np.zeros(6 if is_rigid else 3), jacobian, method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15
        )
        position, orientation = pose_at(result.x)
    except UnreachableError:
        return None
    x, y, z = position.tolist()
    residual = float(np.sqrt(np.mean(result.fun**2)))
    return ForwardSolution((x, y, z), orientation, residual) if residual < UNREACHABLE_RESIDUAL else None


def _left_jacobian(rotation_vector: Array) -> Array:
    """Angular velocity in the world's axes by the rate of the rotation vector, shape (3, 3)."""
    angle = float(np.linalg.norm(rotation_vector))
    x, y, z = rotation_vector
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < 1e-4:
        return np.eye(3) + 0.5 * skew + skew @ skew / 6.0
    first, second = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    matrix: Array = np.eye(3) + first * skew + second * skew @ skew
    return matrix


def is_same_pose(one: ForwardSolution, other: ForwardSolution, scale: float) -> bool:
    """Whether two solutions are one, but for rounding beside a length ``scale`` in m."""
    distance = float(np.linalg.norm(np.subtract(one.position, other.position)))
    angle = float((_rotation(one.orientation) * _rotation(other.orientation).inv()).magnitude())
    return distance < SAME_POSITION_RATIO * scale and angle < SAME_ANGLE


def validated_pose(
    caller: str, robot: Robot, position: Sequence[float] | Array | None, orientation: Sequence[float] | Array | None
) -> tuple[Array, Quaternion]:
    """A pose in m and as a unit quaternion, by default the start as declared.

    Raises ArgumentError if it is invalid, InputError where a point mass is to turn.
    """
    platform = validate_robot(f"{caller}: robot", robot).platform
    at = platform.start if position is None else position
    array = validate_array(f"{caller}: position", at, (3,), "the position [x, y, z] in m")
    if orientation is None:
        return array, platform.start_orientation
    quaternion = validate_quaternion(f"{caller}: orientation", orientation)
    if any(quaternion[1:]):
        require_rigid_body(robot)
    return array, quaternion


def require_rigid_body(robot: Robot) -> None:
    """Raise InputError for a point mass, which does not turn."""
    if not robot.platform.is_rigid_body:
        raise InputError(robot.name, "has a point mass, which does not turn", "give [platform] an inertia")


def turned_orientation(orientation: Quaternion, rotation_vector: Array) -> Quaternion:
    """An orientation turned by a rotation vector (3,) in rad, in the axes of the world."""
    if not np.any(rotation_vector):
        return orientation
    w, x, y, z = multiply(quaternion_of(REAL, rotation_vector.tolist()), orientation)
    return (float(w), float(x), float(y), float(z))


def _rotation(quaternion: Quaternion) -> Rotation:
    w, x, y, z = quaternion
    return Rotation.from_quat((x, y, z, w))


def _quaternion(rotation: Rotation) -> Quaternion:
    x, y, z, w = rotation.as_quat().tolist()
    return (w, x, y, z)
