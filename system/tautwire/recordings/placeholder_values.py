"""Placeholders among what was measured: one value that a sensor writes while it measures nothing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import AXES, QUATERNION_COLUMNS
from .quaternion_columns import with_continuous_signs, zero_quaternions

Array = NDArray[np.float64]

# A jump to a placeholder and back is so many times as large as a quantile of the steps.
STEP_QUANTILE, MIN_JUMP_RATIO = 0.9, 10.0
# Samples of a run, or so many runs of one value; what a sensor shows alone is short, or no zero of a tension.
MIN_REPEATS, MAX_DROPOUT = 2, 5
MAX_SHARE = 0.5


def without_placeholders(columns: Mapping[str, Array]) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Positions, quaternions and tensions (N,) without placeholders, as NaN, and a note on each.

    A placeholder is one value, repeated exactly in a run or in several, to which the coordinates together, the
    quaternion, or a sensor alone, jump and from which they jump back; that of one sensor is outside what it shows
    otherwise, and a coordinate's, or a tension's of 0, lasts for a few samples. A quaternion of zeros is no
    orientation, nor is one that stays the same wherever the position is lost.
    """
    changed, notes = dict(columns), []
    is_lost = np.zeros(len(next(iter(columns.values()), ())), dtype=bool)
    axes = [name for name in AXES if name in columns]
    for names in (axes, *([name] for name in columns if name in axes or name.startswith("tension_"))):
        rows = _placeholder_rows([changed[name] for name in names]) if names else np.array([], dtype=bool)
        if not rows.any() or (names != axes and not _is_of_one_sensor(names[0], changed[names[0]], rows)):
            continue
        count = f"{rows.sum()} samples at {_text([columns[name][rows][0] for name in names])}"
        notes.append(f"{', '.join(names)}: {count} are where nothing was measured, and not used")
        is_lost = rows if names == axes else is_lost
        for name in names:
            changed[name] = np.where(rows, np.nan, changed[name])
    if all(name in columns for name in QUATERNION_COLUMNS):
        quaternions = np.column_stack([columns[name] for name in QUATERNION_COLUMNS])
        rows = _lost_orientations(quaternions, is_lost)
        if rows.any():
            shown = "of zeros" if zero_quaternions(quaternions[rows]).all() else f"at {_text(quaternions[rows][-1])}"
            notes.append(f"{', '.join(QUATERNION_COLUMNS)}: {rows.sum()} samples {shown} are no orientation: not used")
            changed |= {name: np.where(rows, np.nan, columns[name]) for name in QUATERNION_COLUMNS}
    return changed, tuple(notes)


def _text(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.6g}" for value in values)


def _lost_orientations(quaternions: Array, is_lost: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Rows (N,) of quaternions (N, 4) that are placeholders, where ``is_lost`` says that positions are."""
    zeros = zero_quaternions(quaternions)
    # Of a sign that changes, which is no jump of the platform.
    continuous = with_continuous_signs(np.where(zeros[:, None], np.nan, quaternions))
    rows = zeros | _placeholder_rows(list(continuous.T))
    shown = quaternions[is_lost & ~zeros]
    return rows | (is_lost & bool(len(shown) > 1 and np.all(shown == shown[0])))


def _placeholder_rows(columns: Sequence[Array]) -> NDArray[np.bool_]:
    """Rows (N,) of the value that has the longest runs between jumps; none where a run has no jump at an end."""
    none = np.zeros(len(columns[0]), dtype=bool)
    measured = [column for column in columns if np.isfinite(column).any()]
    if not measured:
        return none
    values = np.column_stack(measured)
    steps = np.max(np.abs(np.diff(values, axis=0)), axis=1, initial=0.0)
    moving = steps[np.isfinite(steps) & (steps > 0.0)]
    if not moving.size:
        return none
    limit = MIN_JUMP_RATIO * float(np.quantile(moving, STEP_QUANTILE))
    edges = np.concatenate([[0], np.flatnonzero(steps != 0.0) + 1, [len(values)]])
    runs = _runs_between_jumps(edges, steps > limit)
    counts = Counter(tuple(values[first]) for first, _ in runs)
    runs = [run for run in runs if run[1] - run[0] >= MIN_REPEATS or counts[tuple(values[run[0]])] >= MIN_REPEATS]
    if not runs:
        return none
    longest = values[max(runs, key=lambda run: run[1] - run[0])[0]]
    rows = np.all(values == longest, axis=1)
    return rows if np.mean(rows) <= MAX_SHARE else none


def _runs_between_jumps(edges: NDArray[np.int64], is_jump: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Runs of rows between edges (M,) that begin and end with a jump (N - 1,), or with the recording."""
    is_end = np.concatenate([[True], is_jump, [True]])[edges]
    found = np.flatnonzero(is_end[:-1] & is_end[1:])
    return [(int(edges[run]), int(edges[run + 1])) for run in found]


def _is_of_one_sensor(name: str, column: Array, rows: NDArray[np.bool_]) -> bool:
    """Whether a placeholder is outside the range of the other values, by more than this, and no rest or slack rope."""
    others, value = column[~rows & np.isfinite(column)], float(column[rows][0])
    middle, extent = 0.5 * (others.max() + others.min()), float(np.ptp(others))
    edges = np.flatnonzero(np.diff(np.concatenate(([False], rows, [False])).astype(np.int8)))
    is_short = bool(np.all(np.diff(edges)[::2] <= MAX_DROPOUT))
    return abs(value - middle) > 1.5 * extent and (is_short or (value != 0.0 and name not in AXES))
