"""Arrays and frames that a program hands to the library's own functions, checked."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .errors import ArgumentError, described

Array = NDArray[np.float64]
Shape = tuple[int | None, ...]


def array_of(where: str, value: object, shape: Shape, meaning: str) -> Array:
    """The finite numbers in an array, a list or a frame; an entry of ``shape`` is None where any length will do.

    ``meaning`` is what to give, for messages. Raises ArgumentError, which names the first entry that is not finite.
    """
    mend = f"give {meaning}"
    try:
        array = np.asarray(value)
        if np.iscomplexobj(array) or array.dtype.kind in "mM":
            raise TypeError
        array = array.astype(np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise ArgumentError(where, value, f"is {described(value)}, not an array of numbers", mend) from error
    if array.ndim != len(shape) or any(want not in (None, got) for want, got in zip(shape, array.shape, strict=True)):
        raise ArgumentError(where, value, f"has the shape {_shape(array.shape)}, must have {_shape(shape)}", mend)
    wrong = np.argwhere(~np.isfinite(array))
    if len(wrong):
        entry = tuple(wrong[0])
        raise ArgumentError(where, value, f"{_place(entry)} is {array[entry]}, must be finite", mend)
    return array


def rising_of(where: str, value: object, meaning: str, least: int = 2, above: float = -np.inf) -> Array:
    """Numbers (N,) above a bound that rise from one to the next, ``least`` or more of them; raises ArgumentError."""
    array = array_of(where, value, (None,), meaning)
    mend = f"give {meaning}"
    if len(array) < least:
        raise ArgumentError(where, value, f"has {len(array)} entries, must have {least} or more", mend)
    if array[0] <= above:
        raise ArgumentError(where, value, f"entry 1 is {float(array[0])!r}, must be above {above:g}", mend)
    falls = np.flatnonzero(np.diff(array) <= 0.0)
    if len(falls):
        place = int(falls[0])
        before, after = float(array[place]), float(array[place + 1])
        problem = f"entry {place + 2} is {after!r} after {before!r}, must rise from entry to entry"
        raise ArgumentError(where, value, problem, mend)
    return array


def point_of(where: str, value: object) -> tuple[float, float, float]:
    """Three coordinates in m; raises ArgumentError."""
    x, y, z = array_of(where, value, (3,), "three finite coordinates x, y, z in m").tolist()
    return (x, y, z)


def _shape(shape: Shape) -> str:
    lengths = ["N" if length is None else str(length) for length in shape]
    return f"({', '.join(lengths)}{',' if len(lengths) == 1 else ''})"


def _place(entry: tuple[int, ...]) -> str:
    names = ("entry",) if len(entry) == 1 else ("row", "column")
    return ", ".join(f"{name} {place + 1}" for name, place in zip(names, entry, strict=False))
