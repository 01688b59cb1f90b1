"""Recorded unit quaternions: their norm, and a sign that is continuous along time."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from ..robot.schema import QUATERNION_COLUMNS
from .sensor_gaps import bridge_short_gaps

Array = NDArray[np.float64]

# Of written quaternions: three decimals err by less, another scale or order of columns by more.
MAX_NORM_ERROR = 0.01


def quaternion_problem(quaternion: Mapping[str, float]) -> tuple[str, str] | None:
    """What is wrong with the quaternion of a sample, by its columns, and the hint; None where it is valid or missing.

    All four numbers are missing (NaN) or none; they are all zero, as a tracker writes them that has lost the platform,
    or their norm is within 1 % of 1.
    """
    if not any(quaternion.values()):
        return None
    missing = [name for name, value in quaternion.items() if np.isnan(value)]
    empty = f"leave all of {', '.join(quaternion)} empty where the tracker lost the platform"
    hint = f"write a unit quaternion, of counts with their factor and in place of angles by conversion, or {empty}"
    if missing:
        is_lost = len(missing) == len(quaternion)
        return None if is_lost else (f"has no number in {', '.join(missing)}, and has in the others", hint)
    norm = float(np.hypot.reduce(list(quaternion.values())))
    if abs(norm - 1.0) <= MAX_NORM_ERROR:
        return None
    return f"has the norm {norm:.4g} in {', '.join(quaternion)}, must be within {MAX_NORM_ERROR:.0%} of 1", hint


def zero_quaternions(quaternions: Array) -> NDArray[np.bool_]:
    """Rows (N,) of quaternions (N, 4) that are zero: no orientation, as trackers write that have lost the platform."""
    return np.all(quaternions == 0.0, axis=1)


def are_valid(quaternions: Array) -> bool:
    """Whether :func:`quaternion_problem` sees none in any row of (N, 4)."""
    is_missing = np.isnan(quaternions)
    norms = np.linalg.norm(quaternions[~is_missing.any(axis=1)], axis=1)
    is_partial = is_missing.any(axis=1) & ~is_missing.all(axis=1)
    return bool(not is_partial.any() and np.all(np.abs(norms - 1.0) <= MAX_NORM_ERROR))


def unit_quaternions(recorded: Array) -> Array:
    """Quaternions (N, 4) with norm 1 and a sign that is continuous along time, NaN where there are none; read-only."""
    continuous = with_continuous_signs(recorded)
    unit = np.asarray(continuous / np.linalg.norm(continuous, axis=1, keepdims=True))
    unit.setflags(write=False)
    return unit


def bridged_quaternions(time: Array, quaternions: Array) -> Array:
    """Unit quaternions (N, 4), between the samples of a tracker slower than the log too."""
    return unit_quaternions(bridge_short_gaps(time, quaternions))


def with_continuous_signs(recorded: Array) -> Array:
    """Quaternions (N, 4), each with the sign that brings it nearest to the last one before it that was measured."""
    is_known = np.isfinite(recorded).all(axis=1)
    known = recorded[is_known]
    changes = np.where(np.sum(known[1:] * known[:-1], axis=1) < 0.0, -1.0, 1.0)
    continuous = recorded.copy()
    continuous[is_known] = known * np.cumprod(np.concatenate([np.ones(min(len(known), 1)), changes]))[:, None]
    return continuous


def rotation_vectors(quaternions: Array, reference: Sequence[float] | None = None) -> Array:
    """Rotation vectors (N, 3), in rad and the world's axes, from a reference to unit quaternions (N, 4).

    The default is the first that is known. NaN where there is no quaternion; beyond half a turn, those of the shorter
    way.
    """
    known = np.flatnonzero(np.isfinite(quaternions).all(axis=1))
    if not len(known):
        return np.full((len(quaternions), 3), np.nan)
    start = quaternions[known[0]] if reference is None else np.array(reference, dtype=float)
    return rotations_between(np.broadcast_to(start, quaternions.shape), quaternions)


def rotations_between(start: Array, end: Array) -> Array:
    """Rotation vectors (N, 3), in rad and the world's axes, between unit quaternions (N, 4); NaN where either is."""
    vectors = np.full((len(end), 3), np.nan)
    known = np.isfinite(start).all(axis=1) & np.isfinite(end).all(axis=1)
    if np.any(known):
        first, second = (Rotation.from_quat(np.roll(each[known], -1, axis=1)) for each in (start, end))
        vectors[known] = (second * first.inv()).as_rotvec()
    return vectors


def missing_quaternion_columns(names: Container[str]) -> tuple[str, ...]:
    """Columns of the quaternion that a recording lacks although it has others of them; none where it has none."""
    missing = tuple(name for name in QUATERNION_COLUMNS if name not in names)
    return () if len(missing) == len(QUATERNION_COLUMNS) else missing
