"""Outputs that show nothing: one value all along, noise alone, a value that stays for a while, or each one repeated."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ...recordings.recording import Recording
from ...recordings.roughness import roughness

Array = NDArray[np.float64]

# What a live output varies by, over its own noise, where a dead one stays within a fifth of its noise.
LIVE, DEAD = 10.0, 1.2
# Samples that a value stays without the others of its kind staying too.
FROZEN = 40
# Shares of repeats, and of intervals between new values that are alike, by which a slower sensor is known.
REPEATED, EVEN = 0.4, 0.8


def without_silent(recording: Recording) -> tuple[Recording, tuple[str, ...]]:
    """The recording with empty cells where an output showed nothing new, and notes that name it."""
    measured = recording.measured()
    notes: list[str] = []
    for kind in (slice(0, 3), slice(3, 3 + recording.cable_count)):
        columns, names = measured[:, kind], recording.channel_names[kind]
        notes += _emptied(columns, names, _constant(columns), "shows one value all along: not used")
        notes += _emptied(columns, names, _noise_alone(columns), "shows noise alone while others move: not used")
        every = _held(columns)
        if every > 1:
            _keep_new(columns)
            which = ", ".join(name for name, column in zip(names, columns.T, strict=True) if np.isfinite(column).any())
            notes.append(f"{which}: each value is repeated about {every} times: only the first of each was used")
        for place, count in enumerate(_unfreeze(columns)):
            if count:
                notes.append(
                    f"{names[place]}: stays at one value for {count} samples while others move: not used there"
                )
    if not notes:
        return recording, ()
    told = tuple(f"{recording.path}: {note}" for note in notes)
    return replace(recording, position=measured[:, :3], tension=measured[:, 3:]), told


def _emptied(columns: Array, names: tuple[str, ...], silent: list[int], why: str) -> list[str]:
    columns[:, silent] = np.nan
    return [f"{names[place]} {why}" for place in silent]


def _seen(column: Array) -> Array:
    seen: Array = column[np.isfinite(column)]
    return seen


def _constant(columns: Array) -> list[int]:
    """Where all values are the same and others are not; a robot that rests all along shows noise."""
    return [place for place, column in enumerate(columns.T) if len(_seen(column)) > 1 and np.ptp(_seen(column)) == 0.0]


def _noise_alone(columns: Array) -> list[int]:
    """Load cells or coordinates that stay within their own noise while all others leave it far behind."""
    varied = {}
    for place, column in enumerate(columns.T):
        seen = _seen(column)
        if len(seen) > FROZEN:
            varied[place] = float(np.std(seen)) / roughness(seen[:, None])
    quiet = [place for place, size in varied.items() if size < DEAD]
    others = [size for size in varied.values() if size >= DEAD]
    return quiet if others and min(others) > LIVE else []


def _held(columns: Array) -> int:
    """How many samples a value stays where a slower sensor's values are repeated; 1 where they are not."""
    changed = _new(columns)
    changes = np.flatnonzero(changed)
    if len(changes) < FROZEN or np.mean(changed) > 1.0 - REPEATED:
        return 1
    intervals = np.diff(changes)
    usual = int(np.median(intervals))
    even = float(np.mean(np.abs(intervals - usual) <= 1))
    return usual if usual > 1 and even > EVEN else 1


def _new(columns: Array) -> NDArray[np.bool_]:
    """Rows in which some value is not that of the row before; of rows where all are seen that ever are."""
    alive = columns[:, np.isfinite(columns).any(axis=0)]
    if not alive.shape[1]:
        return np.ones(len(columns), dtype=bool)
    different = np.any(~(alive[1:] == alive[:-1]), axis=1)
    return np.append(True, different)


def _keep_new(columns: Array) -> None:
    columns[~_new(columns)] = np.nan


def _unfreeze(columns: Array) -> list[int]:
    """Empties cells of an output that stays while another of its kind moves on; how many in each."""
    counts = []
    whole = columns.copy()
    for place, column in enumerate(whole.T):
        lost = np.zeros(len(column), dtype=bool)
        same = np.append(False, column[1:] == column[:-1])
        edges = np.flatnonzero(np.diff(np.concatenate([[0], same.astype(int), [0]])))
        for first, last in zip(edges[::2], edges[1::2], strict=True):
            if last - first >= FROZEN and _others_move(whole, place, first, last):
                lost[first:last] = True
        columns[lost, place] = np.nan
        counts.append(int(np.sum(lost)))
    return counts


def _others_move(columns: Array, place: int, first: int, last: int) -> bool:
    for other, column in enumerate(columns.T):
        seen = _seen(column[first:last])
        if other != place and len(seen) >= FROZEN and np.std(seen) > LIVE * roughness(_seen(column)[:, None]):
            return True
    return False
