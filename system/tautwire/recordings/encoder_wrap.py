"""Encoders that begin anew at the end of their range: rope lengths whose jumps are undone (phase unwrapping)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from .recording_table import Header

Array = NDArray[np.float64]

# Registers of 8 to 32 bits, decimal ones, and a turn in turns, radians, degrees or a tenth or a hundredth of these.
PERIODS = (*(2.0**bits for bits in range(8, 33)), *(10.0**digits for digits in range(3, 9)))
TURNS = (1.0, 2.0 * np.pi, 360.0, 3600.0, 36_000.0)
# A jump is more than the first share of the range, where nearly all steps are less than the second.
MIN_JUMP, MAX_STEP, STEP_QUANTILE = 0.5, 0.1, 0.9
PERIOD_TOLERANCE = 0.02
MIN_SAMPLES = 10


def without_wraps(columns: Mapping[str, Array], header: Header) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Rope lengths (N,) in m whose encoder's range ended, made continuous, and a note on each.

    The period is one of ``PERIODS`` or ``TURNS`` in the numbers of the recording, by the size of the jumps less the
    steps beside them; what jumps otherwise stays.
    """
    changed, notes = dict(columns), []
    for name, values in columns.items():
        if not name.startswith("rope_length_") or not np.isfinite(values).all():
            continue
        scale = abs(header.to_si(name, 1.0) - header.to_si(name, 0.0))
        jumps = _jumps(values)
        period = _period(values, jumps, scale)
        if period is None:
            continue
        turns = np.zeros(len(values))
        turns[jumps + 1] = -np.sign(np.diff(values)[jumps])
        changed[name] = values + period * scale * np.cumsum(turns)
        count = "1 jump" if len(jumps) == 1 else f"{len(jumps)} jumps"
        notes.append(f"{name} begins anew after {period:.9g}, as the range of its encoder ends: {count} undone")
    return changed, tuple(notes)


def _jumps(values: Array) -> NDArray[np.intp]:
    """Indices (k,) of the samples before jumps over most of the range, where other steps are short."""
    steps, extent = np.abs(np.diff(values)), float(np.ptp(values))
    if len(values) < MIN_SAMPLES or not np.quantile(steps, STEP_QUANTILE) <= MAX_STEP * extent:
        return np.array([], dtype=np.intp)
    return np.flatnonzero(steps > MIN_JUMP * extent)


def _period(values: Array, jumps: NDArray[np.intp], scale: float) -> float | None:
    """The period in the recording's numbers; None where the jumps have none that encoders have."""
    if not jumps.size:
        return None
    steps = np.diff(values)
    is_jump = np.zeros(len(steps), dtype=bool)
    is_jump[jumps] = True
    usual = np.interp(jumps, np.flatnonzero(~is_jump), steps[~is_jump])
    sizes = np.abs(steps[jumps] - usual) / scale
    nearest = min((*PERIODS, *TURNS), key=lambda period: abs(np.log(period / float(np.median(sizes)))))
    return nearest if np.all(np.abs(sizes / nearest - 1.0) <= PERIOD_TOLERANCE) else None
