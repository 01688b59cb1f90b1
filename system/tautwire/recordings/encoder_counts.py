"""Encoder counts among recorded columns: what tells them, and the cable and the scale of each by the coordinates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from ..robot.schema import Robot

Array = NDArray[np.float64]

# So many counts, of so many values, none further from the last than this share of all.
MIN_COUNTS, MIN_VALUES, MAX_STEP = 10_000, 20, 0.2
# Rope lengths by the coordinates leave this share of a column's variance, and another cable's so many times as much.
MAX_MISFIT, MIN_CONTRAST = 0.01, 5.0


def are_counts(values: Array) -> bool:
    """Whether numbers (N,) are whole, of a wide range, and change by small steps of more than one size."""
    numbers = values[np.isfinite(values)]
    if len(numbers) < MIN_VALUES or np.any(numbers != np.round(numbers)):
        return False
    steps, extent = np.abs(np.diff(numbers)), float(np.ptp(numbers))
    is_wide = extent >= MIN_COUNTS and len(np.unique(numbers)) >= MIN_VALUES
    return bool(is_wide and steps.max() <= MAX_STEP * extent and np.ptp(steps) > 0.0)


def cables_and_scales(robot: Robot, counts: Sequence[Array], position: Array) -> tuple[NDArray[np.intp], Array] | None:
    """The cable of each column of counts (N,), from 0, and its scale in m per count, by positions (N, 3) in m.

    By linear regression of rope lengths on counts; None where these do not tell the cables.
    """
    rows = np.isfinite(position).all(axis=1) & np.isfinite(np.array(counts)).all(axis=0)
    if np.count_nonzero(rows) < MIN_VALUES:
        return None
    lengths = np.linalg.norm(np.array(robot.anchors) - position[rows][:, None], axis=2)
    lengths -= lengths.mean(axis=0)
    columns = np.array(counts)[:, rows]
    columns -= columns.mean(axis=1, keepdims=True)
    powers, covariances = (columns**2).sum(axis=1), columns @ lengths
    if not (powers.all() and (lengths**2).sum(axis=0).all()):
        return None
    misfits = 1.0 - covariances**2 / np.outer(powers, (lengths**2).sum(axis=0))
    order, cables = linear_sum_assignment(misfits)
    best = misfits[order, cables]
    others = np.where(np.eye(len(lengths.T), dtype=bool)[cables], np.inf, misfits).min(axis=1)
    if (best > MAX_MISFIT).any() or (others < MIN_CONTRAST * best).any():
        return None
    return cables, covariances[order, cables] / powers
