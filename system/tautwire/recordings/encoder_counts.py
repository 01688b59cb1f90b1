"""Encoder counts among recorded columns, and the cable and scale of columns that follow a rope's length."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

Array = NDArray[np.float64]

# So many counts, of so many values, none further from the last than this share of all.
MIN_COUNTS, MIN_VALUES, MAX_STEP = 10_000, 20, 0.2
# Of the variance of rope lengths by the coordinates a column leaves this share, and another so many times as much.
MAX_MISFIT, MIN_CONTRAST, SMALLEST_MISFIT = 0.01, 5.0, 1e-12
MAX_ROWS = 20_000


def are_counts(values: Array) -> bool:
    """Whether numbers (N,) are whole, of a wide range, and change by small steps of more than one size."""
    numbers = values[np.isfinite(values)]
    if len(numbers) < MIN_VALUES or np.any(numbers != np.round(numbers)):
        return False
    steps, extent = np.abs(np.diff(numbers)), float(np.ptp(numbers))
    is_wide = extent >= MIN_COUNTS and len(np.unique(numbers)) >= MIN_VALUES
    return bool(is_wide and steps.max() <= MAX_STEP * extent and np.ptp(steps) > 0.0)


@dataclass(frozen=True, eq=False)
class RopeScales:
    """Of each column (k,): its cable from 0, -1 for none; metres of rope for one of its numbers; and the misfit.

    The misfit is the share of the variance of rope lengths that the regression leaves.
    """

    cables: NDArray[np.intp]
    scales: Array
    misfits: Array


def rope_scales(lengths: Array, columns: Sequence[Array], cables: Sequence[int] | None = None) -> RopeScales | None:
    """Linear regression of rope lengths (N, n) in m, NaN where not known, on columns (N,) that follow them.

    Of the ``cables`` from 0 that are known; else each cable has the column that alone fits it. None where these do not
    fit.
    """
    rows = np.flatnonzero(np.isfinite(lengths).all(axis=1))
    for column in columns:
        rows = rows[np.isfinite(column[rows])]
    if len(rows) < MIN_VALUES:
        return None
    rows = rows[:: 1 + len(rows) // MAX_ROWS]
    lengths = lengths[rows] - lengths[rows].mean(axis=0)
    signals = np.array([column[rows] for column in columns])
    signals -= signals.mean(axis=1, keepdims=True)
    powers, covariances = (signals**2).sum(axis=1), signals @ lengths
    products = np.outer(powers, (lengths**2).sum(axis=0))
    misfits = 1.0 - np.divide(covariances**2, products, out=np.zeros_like(products), where=products > 0.0)
    # Below this the rounding of floats decides.
    misfits = np.maximum(misfits, SMALLEST_MISFIT)
    told = _cables_of(misfits) if cables is None else np.array(cables)
    if told is None:
        return None
    is_used = told >= 0
    best = misfits[is_used, told[is_used]]
    if (best > MAX_MISFIT).any():
        return None
    scales, left = np.full(len(told), np.nan), np.full(len(told), np.nan)
    scales[is_used], left[is_used] = covariances[is_used, told[is_used]] / powers[is_used], best
    return RopeScales(told, scales, left)


def _cables_of(misfits: Array) -> NDArray[np.intp] | None:
    """The cable of each column, -1 for none, by misfits (k, n); None where columns or cables compete."""
    if len(misfits) < misfits.shape[1]:
        return None
    columns, cables = linear_sum_assignment(misfits)
    best = misfits[columns, cables]
    others = misfits.copy()
    others[columns, cables] = np.inf
    competing = np.minimum(others[columns].min(axis=1), others[:, cables].min(axis=0))
    if (competing < MIN_CONTRAST * best).any():
        return None
    told = np.full(len(misfits), -1)
    told[columns] = cables
    return told
