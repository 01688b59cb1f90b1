"""Short gaps of recorded winch speeds and rope lengths, a few samples long, which linear interpolation bridges."""

from __future__ import annotations

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

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


def is_winch_column_used(name: str, names: Container[str]) -> bool:
    """Whether a column is a rope length or a winch speed that is read: a speed beside the length of its rope is not."""
    return name.startswith(_LENGTH) or (name.startswith(_SPEED) and name.replace(_SPEED, _LENGTH) not in names)


def _in_short_gaps(is_missing: NDArray[np.bool_], time: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Samples in gaps that are short, by their number and by time, and between numbers."""
    if len(time) < 3:
        return np.zeros(len(time), dtype=np.bool_)
    longest = MAX_GAP_STRETCH * (MAX_GAP_SAMPLES + 1) * float(np.median(np.diff(time)))
    edges = np.flatnonzero(np.diff(np.concatenate(([False], is_missing, [False])).astype(np.int8)))
    is_short = np.zeros(len(is_missing), dtype=np.bool_)
    for start, stop in edges.reshape(-1, 2):
        is_between = start > 0 and stop < len(is_missing)
        if stop - start <= MAX_GAP_SAMPLES and is_between and time[stop] - time[start - 1] <= longest:
            is_short[start:stop] = True
    return is_short


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
