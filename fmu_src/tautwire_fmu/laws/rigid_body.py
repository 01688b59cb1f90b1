"""Equations of motion of the platform as a rigid body: Newton's for its centre of mass, Euler's about it.

    (m + sum of added masses) a = sum of forces - (m + sum of added masses) g e_z
    dL/dt = sum of (R (b_i - c)) x F_i + external moment
    omega = R I^-1 R^T L,   dR/dt = omega x R

The z axis points up. R turns the platform's axes into those of the world. In the platform's frame b_i is the attachment
of cable i and c the centre of mass; I is the inertia about c. L is the angular momentum about the centre of mass in the
axes of the world, so that it stays constant where no moment acts. Forces that effects add act at the centre of mass,
which masses that they add may shift; an external force acts at the origin of the platform's frame.

Source: Goldstein, Poole and Safko (2002), Classical Mechanics, 3rd edition, sections 1.2, 4.9 and 5.5.
"""

import math
from itertools import permutations
from operator import mul
from typing import Any, List, NamedTuple, Sequence, Tuple

from .rotation import Matrix
from .vectors import Vector, add, cross, dot, subtract

MAX_JACOBI_SWEEPS = 30


class Inertia(NamedTuple):
    """Inertia about the centre of mass in the platform's axes, by rows in kg m^2, and its inverse."""

    matrix: Matrix
    inverse: Matrix


class Attitude(NamedTuple):
    """Rotation matrix, and the angular velocity (rad/s) and acceleration (rad/s^2) in the platform's axes."""

    rotation: Matrix
    velocity: Vector
    acceleration: Vector


def transform(matrix: Matrix, vector: Vector) -> Vector:
    """The product of a matrix, given by its rows, and a vector."""
    (a, b, c), (d, e, f), (g, h, i) = matrix
    x, y, z = vector
    return (a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z)


def transform_back(rotation: Matrix, vector: Vector) -> Vector:
    """The product of the transposed matrix and a vector: from the world's axes to those of the platform."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    x, y, z = vector
    return (a * x + d * y + g * z, b * x + e * y + h * z, c * x + f * y + i * z)


def inertia_of(matrix: Matrix) -> Inertia:
    """Inertia with its inverse, by cofactors; ``matrix`` is symmetric."""
    first, second, third = matrix
    rows = (cross(second, third), cross(third, first), cross(first, second))
    determinant = dot(first, rows[0])
    x, y, z = (tuple(entry / determinant for entry in row) for row in rows)
    return Inertia(matrix, (x, y, z))


def principal_axes(matrix: Sequence[Sequence[float]]) -> Matrix:
    """Principal axes of an inertia, a symmetric matrix of floats: unit vectors by rows, nearest to x, y and z.

    By Jacobi's method, which leaves the axes of a diagonal matrix as they are. Source: Golub and Van Loan (2013),
    Matrix Computations, section 8.5.
    """
    entries = [list(map(float, row)) for row in matrix]
    axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    for _ in range(MAX_JACOBI_SWEEPS):
        for p, q in ((0, 1), (0, 2), (1, 2)):
            if entries[p][q] == 0.0:
                continue
            ratio = (entries[q][q] - entries[p][p]) / (2.0 * entries[p][q])
            tangent = math.copysign(1.0, ratio) / (abs(ratio) + math.hypot(ratio, 1.0))
            cosine = 1.0 / math.hypot(tangent, 1.0)
            sine = tangent * cosine
            _turn_rows(entries, p, q, cosine, sine)
            entries = [list(column) for column in zip(*entries)]
            _turn_rows(entries, p, q, cosine, sine)
            entries[p][q] = entries[q][p] = 0.0
            _turn_rows(axes, p, q, cosine, sine)
    nearest = max(permutations(axes), key=lambda rows: sum(abs(row[k]) for k, row in enumerate(rows)))
    x, y, z = (tuple(math.copysign(1.0, row[k]) * entry for entry in row) for k, row in enumerate(nearest))
    return (x, y, z)


def _turn_rows(matrix: List[List[float]], p: int, q: int, cosine: float, sine: float) -> None:
    """Replace two rows of a matrix by their rotation in the plane of both."""
    first, second = matrix[p], matrix[q]
    matrix[p] = [cosine * a - sine * b for a, b in zip(first, second)]
    matrix[q] = [sine * a + cosine * b for a, b in zip(first, second)]


def moment_matrix(arms: Sequence[Sequence[Any]], forces: Sequence[Sequence[Any]]) -> Matrix:
    """Matrix whose rows are ``sum of F_x a``, ``sum of F_y a`` and ``sum of F_z a``, in N m: linear in the forces.

    ``arms`` are from the centre of mass in the platform's axes (m) and ``forces`` in the world's (N), each as one
    sequence for every axis. See :func:`moment`.
    """
    x, y, z = (tuple(sum(map(mul, arm, force)) for arm in arms) for force in forces)
    return (x, y, z)


def moment(rotation: Matrix, matrix: Matrix) -> Vector:
    """Moment ``sum of (R a_i) x F_i`` in the world's axes, in N m; ``matrix`` as :func:`moment_matrix` gives it."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = matrix
    return (
        (d * zx + e * zy + f * zz) - (g * yx + h * yy + i * yz),
        (g * xx + h * xy + i * xz) - (a * zx + b * zy + c * zz),
        (a * yx + b * yy + c * yz) - (d * xx + e * xy + f * xz),
    )


def angular_velocity(inertia: Inertia, rotation: Matrix, momentum: Vector) -> Vector:
    """Angular velocity in the platform's axes, in rad/s, by the angular momentum (N m s) in the world's."""
    return transform(inertia.inverse, transform_back(rotation, momentum))


def angular_acceleration(inertia: Inertia, rotation: Matrix, velocity: Vector, total_moment: Vector) -> Vector:
    """Angular acceleration ``I^-1 (M - omega x I omega)`` in the platform's axes, in rad/s^2.

    ``velocity`` is the angular velocity in the platform's axes, ``total_moment`` in N m in the world's.
    """
    gyroscopic_moment = cross(velocity, transform(inertia.matrix, velocity))
    return transform(inertia.inverse, subtract(transform_back(rotation, total_moment), gyroscopic_moment))


def rotation_rate(rotation: Matrix, velocity: Vector) -> Matrix:
    """Rate of the rotation matrix, in 1/s, by the angular velocity in the platform's axes."""
    x, y, z = rotation
    return (cross(x, velocity), cross(y, velocity), cross(z, velocity))


def rotation_matrices(attitude: Attitude) -> Tuple[Matrix, Matrix, Matrix]:
    """Rotation matrix and its first and second rate: they take an arm to its position, velocity and acceleration."""
    rate = rotation_rate(attitude.rotation, attitude.velocity)
    tangential = rotation_rate(attitude.rotation, attitude.acceleration)
    centripetal = rotation_rate(rate, attitude.velocity)
    x, y, z = (add(a, b) for a, b in zip(tangential, centripetal))
    return attitude.rotation, rate, (x, y, z)
