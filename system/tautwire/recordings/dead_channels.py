"""Dead and frozen channels: outputs that are constant, show noise alone, stay at one value, or repeat each value."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..robot.schema import QUATERNION_COLUMNS
from .recording import Recording
from .white_noise_estimate import white_noise_deviation

Array = NDArray[np.float64]


@dataclass(frozen=True)
class DeadChannelPolicy:
    """When an output counts as dead, frozen, or repeated from a slower sensor."""

    # Standard deviation over noise: a live output exceeds the first, a dead one stays below the second; in between
    # nothing is decided. Chosen, not calibrated.
    live_noise_ratio: float = 10.0
    dead_noise_ratio: float = 1.2
    # Samples for which a frozen output stays at one value while others of its kind move. Chosen, not calibrated.
    min_frozen_samples: int = 40
    # A slower sensor: least share of repeated samples, and of equal intervals between new values, which the coarse
    # resolution of a fast sensor does not give. Chosen, not calibrated.
    min_repeated_ratio: float = 0.4
    min_even_ratio: float = 0.8
    # A load cell out of its range: least share of samples at its largest value, and ratio to those at the next one; a
    # smooth peak in coarse steps has 2.4. Chosen, not calibrated.
    min_saturated_share: float = 0.01
    min_saturated_ratio: float = 5.0


DEFAULT_DEAD_CHANNEL_POLICY = DeadChannelPolicy()


def without_dead_channels(
    recording: Recording, policy: DeadChannelPolicy = DEFAULT_DEAD_CHANNEL_POLICY
) -> tuple[Recording, tuple[str, ...]]:
    """The recording with cells emptied where an output carries no information, and notes that name it."""
    measured = recording.measured()
    notes: list[str] = []
    for kind in (slice(0, 3), slice(3, 3 + recording.cable_count)):
        columns, names = measured[:, kind], recording.channel_names[kind]
        notes += _clear_channels(columns, names, _constant_channels(columns), "is constant throughout: not used")
        notes += _clear_channels(
            columns, names, _noise_only_channels(columns, policy), "shows only noise while others move: not used"
        )
        hold_length = _hold_length(columns, policy)
        if hold_length > 1:
            _clear_repeats(columns)
            affected = ", ".join(
                name for name, column in zip(names, columns.T, strict=True) if np.isfinite(column).any()
            )
            notes.append(
                f"{affected}: each value is repeated about {hold_length} times: only the first of each was used"
            )
        for index, count in enumerate(_clear_frozen(columns, policy)):
            if count:
                notes.append(f"{names[index]}: frozen for {count} samples while others move: not used there")
    notes += _clear_saturated(measured[:, 3:], recording.channel_names[3:], policy)
    if count := _clear_lost_positions(measured[:, :3], recording.wound_lengths(), policy):
        notes.append(f"x, y, z: frozen for {count} samples while winches move: not used there")
    orientation, orientation_notes = _without_dead_orientation(recording, policy)
    notes += orientation_notes
    if not notes:
        return recording, ()
    messages = tuple(f"{recording.path}: {note}" for note in notes)
    return replace(recording, position=measured[:, :3], tension=measured[:, 3:], orientation=orientation), messages


def _clear_lost_positions(positions: Array, wound: Array, policy: DeadChannelPolicy) -> int:
    """Empty positions (N, 3) that a tracker repeats while ropes (N, n) are wound; returns the number of samples."""
    is_lost = np.zeros(len(positions), dtype=bool)
    noise = white_noise_deviation(positions)
    for rows in _repeated_stretches(~_changed_rows(positions), policy.min_frozen_samples):
        travel = float(np.ptp(wound[rows], axis=0).max())
        is_lost[rows] = bool(np.isfinite(positions[rows]).any()) and travel > policy.live_noise_ratio * noise
    positions[is_lost] = np.nan
    return int(np.sum(is_lost))


def _without_dead_orientation(recording: Recording, policy: DeadChannelPolicy) -> tuple[Array, list[str]]:
    """Quaternions (N, 4) without those that carry no information, and notes.

    They are one channel: constant throughout, repeated from a slower sensor, or frozen while positions move.
    """
    quaternions, name, notes = recording.orientation.copy(), ", ".join(QUATERNION_COLUMNS), list[str]()
    if not recording.has_orientation:
        return quaternions, notes
    if len(_constant_channels(quaternions)) == quaternions.shape[1]:
        return np.full_like(quaternions, np.nan), [f"{name} are constant throughout: not used"]
    hold_length = _hold_length(quaternions, policy)
    if hold_length > 1:
        _clear_repeats(quaternions)
        return quaternions, [f"{name}: each value is repeated about {hold_length} times: only the first was used"]
    is_frozen = np.zeros(len(quaternions), dtype=bool)
    for rows in _repeated_stretches(~_changed_rows(quaternions), policy.min_frozen_samples):
        is_frozen[rows] = _any_other_moves(recording.position, -1, rows, policy)
    quaternions[is_frozen] = np.nan
    if is_frozen.any():
        notes.append(f"{name}: frozen for {np.sum(is_frozen)} samples while positions move: not used there")
    return quaternions, notes


def _clear_channels(columns: Array, names: tuple[str, ...], indices: list[int], reason: str) -> list[str]:
    columns[:, indices] = np.nan
    return [f"{names[index]} {reason}" for index in indices]


def _finite(column: Array) -> Array:
    finite: Array = column[np.isfinite(column)]
    return finite


def _constant_channels(columns: Array) -> list[int]:
    """Indices of constant channels; even a robot at rest shows noise."""
    return [
        index for index, column in enumerate(columns.T) if len(_finite(column)) > 1 and np.ptp(_finite(column)) == 0.0
    ]


def _noise_only_channels(columns: Array, policy: DeadChannelPolicy) -> list[int]:
    """Indices of channels that show noise alone while all others vary by far more than theirs."""
    noise_ratios = {}
    for index, column in enumerate(columns.T):
        values = _finite(column)
        if len(values) > policy.min_frozen_samples:
            noise_ratios[index] = float(np.std(values)) / white_noise_deviation(values[:, None])
    dead = [index for index, ratio in noise_ratios.items() if ratio < policy.dead_noise_ratio]
    live_ratios = [ratio for ratio in noise_ratios.values() if ratio >= policy.dead_noise_ratio]
    return dead if live_ratios and min(live_ratios) > policy.live_noise_ratio else []


def _hold_length(columns: Array, policy: DeadChannelPolicy) -> int:
    """Samples for which a slower sensor holds each value; 1 where values are not repeated."""
    is_changed = _changed_rows(columns)
    changed_rows = np.flatnonzero(is_changed)
    if len(changed_rows) < policy.min_frozen_samples or np.mean(is_changed) > 1.0 - policy.min_repeated_ratio:
        return 1
    intervals = np.diff(changed_rows)
    median_interval = int(np.median(intervals))
    even_ratio = float(np.mean(np.abs(intervals - median_interval) <= 1))
    return median_interval if median_interval > 1 and even_ratio > policy.min_even_ratio else 1


def _changed_rows(columns: Array) -> NDArray[np.bool_]:
    """Rows (N,) in which some value differs from the row before, over the columns that have any value."""
    measured = columns[:, np.isfinite(columns).any(axis=0)]
    if not measured.shape[1]:
        return np.ones(len(columns), dtype=bool)
    is_different = np.any(~(measured[1:] == measured[:-1]), axis=1)
    return np.append(True, is_different)


def _clear_repeats(columns: Array) -> None:
    columns[~_changed_rows(columns)] = np.nan


def _clear_frozen(columns: Array, policy: DeadChannelPolicy) -> list[int]:
    """Empty the cells of each output that is frozen while another of its kind moves; returns their number by output."""
    counts = []
    original = columns.copy()
    for index, column in enumerate(original.T):
        is_frozen = np.zeros(len(column), dtype=bool)
        is_repeated = np.append(False, column[1:] == column[:-1])
        for rows in _repeated_stretches(is_repeated, policy.min_frozen_samples):
            is_frozen[rows] = _any_other_moves(original, index, rows, policy)
        columns[is_frozen, index] = np.nan
        counts.append(int(np.sum(is_frozen)))
    return counts


def _clear_saturated(tensions: Array, names: Sequence[str], policy: DeadChannelPolicy) -> list[str]:
    """Empty tensions (N, n) that stay at a cell's largest value while others move; returns notes.

    The smallest is left, as slack ropes have it.
    """
    notes, original = [], tensions.copy()
    for index, column in enumerate(original.T):
        values = np.abs(_finite(column))
        if not values.size or np.ptp(values) == 0.0:
            continue
        is_largest = np.abs(column) == values.max()
        count, next_value = int(np.sum(is_largest)), values[values < values.max()].max()
        least = max(policy.min_frozen_samples, policy.min_saturated_share * len(values))
        is_sharp = count > policy.min_saturated_ratio * int(np.sum(values == next_value))
        # A cell whose steps are larger than its noise repeats a value wherever it rests.
        below = np.where(is_largest, np.nan, column)
        is_fine = white_noise_deviation(_finite(below)[:, None]) > float(np.min(np.diff(np.unique(values))))
        is_held = is_largest & np.append(False, is_largest[:-1])
        is_clipped = count >= least and is_sharp and is_fine
        if is_clipped and _any_other_moves(original, index, is_held, policy):
            tensions[is_largest, index] = np.nan
            value = float(column[is_largest][0])
            notes.append(
                f"{names[index]}: at its largest value, {value:.6g} N, in {count} samples while others move, as load "
                "cells out of their range are: not used there"
            )
    return notes


def _repeated_stretches(is_repeated: NDArray[np.bool_], min_samples: int) -> Iterator[slice]:
    """Rows of stretches of so many samples at least that repeat the one before."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], is_repeated.astype(int), [0]])))
    for first, last in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if last - first >= min_samples:
            yield slice(first, last)


def _any_other_moves(columns: Array, index: int, rows: slice | NDArray[np.bool_], policy: DeadChannelPolicy) -> bool:
    """Whether another channel varies by more than noise in some rows."""
    for other, column in enumerate(columns.T):
        values = _finite(column[rows])
        if (
            other != index
            and len(values) >= policy.min_frozen_samples
            and np.std(values) > policy.live_noise_ratio * white_noise_deviation(_finite(column)[:, None])
        ):
            return True
    return False
