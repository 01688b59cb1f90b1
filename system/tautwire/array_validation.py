"""Validation of arguments that are arrays, lists or frames of numbers."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from .errors import ArgumentError, describe_value

Array = NDArray[np.float64]
Shape = tuple[int | None, ...]

MAX_QUATERNION_ERROR = 1e-9


def validate_array(where: str, value: object, shape: Shape, meaning: str) -> Array:
    """Converts an array, a list or a frame to finite floats; an entry of ``shape`` is None where any length is valid.

    ``meaning`` says what to pass, for messages. Raises ArgumentError, which names the first entry that is not finite.
    """
    hint = f"give {meaning}"
    try:
        array = np.asarray(value)
        if np.iscomplexobj(array) or array.dtype.kind in "mM":
            raise TypeError
        array = array.astype(np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise ArgumentError(where, value, f"is {describe_value(value)}, not an array of numbers", hint) from error
    if array.ndim != len(shape) or any(
        expected not in (None, actual) for expected, actual in zip(shape, array.shape, strict=True)
    ):
        raise ArgumentError(
            where, value, f"has the shape {_format_shape(array.shape)}, must have {_format_shape(shape)}", hint
        )
    non_finite = np.argwhere(~np.isfinite(array))
    if len(non_finite):
        index = tuple(non_finite[0])
        raise ArgumentError(where, value, f"{_format_index(index)} is {array[index]}, must be finite", hint)
    return array


def validate_increasing(
    where: str, value: object, meaning: str, min_length: int = 2, lower_bound: float = -np.inf
) -> Array:
    """Strictly increasing numbers (N,) above ``lower_bound``, at least ``min_length`` of them; raises ArgumentError."""
    array = validate_array(where, value, (None,), meaning)
    hint = f"give {meaning}"
    if len(array) < min_length:
        raise ArgumentError(where, value, f"has {len(array)} entries, must have {min_length} or more", hint)
    if array[0] <= lower_bound:
        raise ArgumentError(where, value, f"entry 1 is {float(array[0])!r}, must be above {lower_bound:g}", hint)
    decreases = np.flatnonzero(np.diff(array) <= 0.0)
    if len(decreases):
        index = int(decreases[0])
        before, after = float(array[index]), float(array[index + 1])
        problem = f"entry {index + 2} is {after!r} after {before!r}, must rise from entry to entry"
        raise ArgumentError(where, value, problem, hint)
    return array


def validate_point(where: str, value: object) -> tuple[float, float, float]:
    """A point as three finite coordinates in m; raises ArgumentError otherwise."""
    x, y, z = validate_array(where, value, (3,), "three finite coordinates x, y, z in m").tolist()
    return (x, y, z)


def validate_quaternion(where: str, value: object) -> tuple[float, float, float, float]:
    """A unit quaternion w, x, y, z; raises ArgumentError otherwise."""
    meaning = "the unit quaternion [w, x, y, z]"
    w, x, y, z = validate_array(where, value, (4,), meaning).tolist()
    norm = math.hypot(w, x, y, z)
    if abs(norm - 1.0) > MAX_QUATERNION_ERROR:
        raise ArgumentError(where, value, f"has norm {norm:.9g}, must have 1", f"give {meaning}")
    return (w, x, y, z)


def _format_shape(shape: Shape) -> str:
    lengths = ["N" if length is None else str(length) for length in shape]
    return f"({', '.join(lengths)}{',' if len(lengths) == 1 else ''})"


def _format_index(index: tuple[int, ...]) -> str:
    names = ("entry",) if len(index) == 1 else ("row", "column")
    return ", ".join(f"{name} {position + 1}" for name, position in zip(names, index, strict=False))
