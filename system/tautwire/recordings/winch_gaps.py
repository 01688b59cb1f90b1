"""Short gaps of recorded winch speeds and rope lengths, a few samples long, which linear interpolation bridges."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..errors import RecordingError

# Samples in a row, and how much longer than they these may last; meanwhile a winch may have done anything.
MAX_GAP_SAMPLES, MAX_GAP_STRETCH = 5, 1.5

_SPEED, _LENGTH = "winch_speed_", "rope_length_"
WINCH_COLUMNS = (_SPEED, _LENGTH)


def bridge_winch_gaps(
    columns: Mapping[str, NDArray[np.float64]],
) -> tuple[dict[str, NDArray[np.float64]], tuple[str, ...]]:
    """Interpolate winch speeds (m/s) and rope lengths (m) linearly in time over gaps of at most ``MAX_GAP_SAMPLES``.

    And a note on each. ``columns`` are (N,), NaN where nothing was recorded. Gaps at the ends and longer ones stay.
    """
    bridged, notes = dict(columns), []
    for name, values in columns.items():
        if not is_winch_column_used(name, columns) or not np.isnan(values).any():
            continue
        is_short = _in_short_gaps(np.isnan(values), columns["time"])
        if is_short.any():
            time, is_known = columns["time"], ~np.isnan(values)
            bridged[name] = values.copy()
            bridged[name][is_short] = np.interp(time[is_short], time[is_known], values[is_known])
            samples = "1 sample" if is_short.sum() == 1 else f"{is_short.sum()} samples"
            notes.append(f"{name} is interpolated in {samples} without a number, from {time[is_short][0]:.6g} s")
    return bridged, tuple(notes)


def interpolated_at(
    rows: NDArray[Any],
    times: NDArray[Any],
    values: NDArray[np.float64],
    tolerance: float = 0.0,
    row_period: float = 0.0,
) -> NDArray[np.float64]:
    """Values (N,) at the times of ``rows`` (N,), linear between samples (M,) at ``times``; NaN inside of long gaps.

    A gap is long where more than ``MAX_GAP_SAMPLES`` of the series, or of rows ``row_period`` apart, would fit into it.
    Rows within the ``tolerance`` of a sample are in none. All times have one unit, in which ``times`` rise.
    """
    column = np.interp(rows - rows[:1], times - rows[:1], values)
    steps = np.diff(times)
    if len(steps):
        longest = (MAX_GAP_SAMPLES + 1) * max(float(np.median(steps)), row_period)
        after = np.clip(np.searchsorted(times, rows), 1, len(steps))
        is_sample = np.minimum(np.abs(times[after] - rows), np.abs(rows - times[after - 1])) <= tolerance
        column[(steps[after - 1] > longest) & ~is_sample] = np.nan
    return np.asarray(column, dtype=np.float64)


def long_gap_error(columns: Mapping[str, NDArray[np.float64]], file: str) -> RecordingError | None:
    """The error of a gap of few samples that lasts too long to be bridged; None where no gap is left."""
    time = columns["time"]
    for name, values in columns.items() if len(time) > 2 else ():
        rows = np.flatnonzero(np.isnan(values))
        if not len(rows) or not is_winch_column_used(name, columns):
            continue
        first, last = time[max(rows[0] - 1, 0)], time[min(rows[0] + 1, len(time) - 1)]
        problem = f"has no number between {first:.6g} s and {last:.6g} s"
        hint = f"only gaps of up to {_longest_gap(time):.3g} s are interpolated: cut the recording there"
        return RecordingError(f"{file}: column {name}", problem, hint)
    return None


def is_winch_column_used(name: str, names: Container[str]) -> bool:
    """Whether a column is a rope length or a winch speed that is read: a speed beside the length of its rope is not."""
    return name.startswith(_LENGTH) or (name.startswith(_SPEED) and name.replace(_SPEED, _LENGTH) not in names)


def _in_short_gaps(is_missing: NDArray[np.bool_], time: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Samples in gaps that are short, by their number and by time, and between numbers."""
    if len(time) < 3:
        return np.zeros(len(time), dtype=np.bool_)
    longest = _longest_gap(time)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], is_missing, [False])).astype(np.int8)))
    is_short = np.zeros(len(is_missing), dtype=np.bool_)
    for start, stop in edges.reshape(-1, 2):
        is_between = start > 0 and stop < len(is_missing)
        if stop - start <= MAX_GAP_SAMPLES and is_between and time[stop] - time[start - 1] <= longest:
            is_short[start:stop] = True
    return is_short


def _longest_gap(time: NDArray[np.float64]) -> float:
    """Time that a gap may last to be bridged, s."""
    return MAX_GAP_STRETCH * (MAX_GAP_SAMPLES + 1) * float(np.median(np.diff(time)))


class CellError(NamedTuple):
    """An error of a sample; ``bridgeable`` names the column of a winch where it is that of a cell without a number."""

    error: RecordingError
    bridgeable: str | None = None


def without_bridged_gaps(
    samples: Iterable[Sequence[CellError]], winch_columns: Iterable[str]
) -> Iterator[RecordingError]:
    """Errors of the samples in their order, less those of missing winch speeds and rope lengths that are bridged."""
    columns = frozenset(winch_columns)
    held: list[CellError] = []
    gap_lengths = dict.fromkeys(columns, 0)
    unseen = set(columns)
    for errors in samples:
        missing = {cell.bridgeable for cell in errors}
        for name in columns - missing:
            if gap_lengths[name]:
                held = [cell for cell in held if cell.bridgeable != name]
            gap_lengths[name] = 0
            unseen.discard(name)
        for name in columns & missing:
            gap_lengths[name] += 1
        held += errors
        too_long = unseen | {name for name in columns if gap_lengths[name] > MAX_GAP_SAMPLES}
        held = [CellError(cell.error) if cell.bridgeable in too_long else cell for cell in held]
        if not any(cell.bridgeable for cell in held):
            yield from (cell.error for cell in held)
            held = []
    yield from (cell.error for cell in held)
