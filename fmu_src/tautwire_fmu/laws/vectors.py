"""Vectors of three scalars as tuples, for any kind of number."""

from typing import Any, Sequence

from .mathematics import Mathematics

Vector = Sequence[Any]


def add(a: Vector, b: Vector) -> Vector:
    """The sum ``a + b``."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def subtract(a: Vector, b: Vector) -> Vector:
    """The difference ``a - b``."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(factor: Any, a: Vector) -> Vector:
    """The multiple ``factor a``."""
    return (factor * a[0], factor * a[1], factor * a[2])


def dot(a: Vector, b: Vector) -> Any:
    """The inner product, without conjugation."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Vector, b: Vector) -> Vector:
    """The vector product ``a x b``."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def norm(m: Mathematics, a: Vector) -> Any:
    """The Euclidean length."""
    return m.sqrt(dot(a, a))
