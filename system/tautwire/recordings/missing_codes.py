"""Numbers that programs write for one that is missing, such as -9999, in any column and for single samples too."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from .recording_table import Header

Array = NDArray[np.float64]

# As they stand in files, whatever unit the column is in; also ends of the ranges of 16 and 32 bits.
MISSING_CODES = (
    *(sign * code for code in (999.0, 9999.0, 99999.0, 999999.0, 999.9, 9999.9, 999.25, 1e6, 1e9) for sign in (-1, 1)),
    *(-32768.0, 32767.0, 65535.0, -2147483648.0, 2147483647.0, 4294967295.0),
)
# A code is so many times the extent of the other numbers from these, and a share of itself; at most half
# are codes, beside some samples.
MIN_DISTANCE, MIN_OWN_SHARE, MAX_SHARE, MIN_SAMPLES = 3.0, 0.5, 0.5, 20


def without_missing_codes(columns: Mapping[str, Array], header: Header) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Columns (N,) but time, in SI units, without codes of a missing number, as NaN, and a note on each.

    What the sensor shows otherwise is far away: counts that cross the code on their way are none.
    """
    changed, notes = dict(columns), []
    for name, values in columns.items():
        if name == "time":
            continue
        codes = {float(header.to_si(name, code)): code for code in MISSING_CODES}
        is_code = np.isin(values, list(codes))
        if not is_code.any() or not _is_apart(values, is_code):
            continue
        changed[name] = np.where(is_code, np.nan, values)
        found = sorted({codes[value] for value in values[is_code].tolist()})
        samples = "1 sample" if is_code.sum() == 1 else f"{is_code.sum()} samples"
        written = " and ".join(f"{code:.10g}" for code in found)
        notes.append(f"{name}: {samples} at {written}, as programs write where a number is missing, are not used")
    return changed, tuple(notes)


def _is_apart(values: Array, is_code: NDArray[np.bool_]) -> bool:
    others = values[~is_code & np.isfinite(values)]
    if others.size < MIN_SAMPLES or np.mean(is_code) > MAX_SHARE:
        return False
    extent = float(np.ptp(others))
    found = values[is_code]
    distance = np.minimum(np.abs(found - others.min()), np.abs(found - others.max()))
    return bool(np.all(distance > np.maximum(MIN_DISTANCE * extent, MIN_OWN_SHARE * np.abs(found))))
