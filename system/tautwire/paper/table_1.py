"""Table 1 in the ledger: each column from the others and from our loops, uncertainties as they propagate."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ..materials.consistency import Check, checks
from ..materials.table import MaterialRow, Quantity
from .claims import Claim, Entry
from .material import MaterialRuns, amplitude_error, loop_modulus, loop_value
from .parameters import DATA, Parameters, SetName, read_data

SECTION = "3.2"
# Column: how it follows from the others, what it is called, unit, scale from SI.
COLUMNS = {
    "dynamic_modulus": ("sigma / eps", "|E*|", "GPa", 1e-9),
    "storage_modulus": ("|E*| cos phi", "E'", "GPa", 1e-9),
    "loss_factor": ("tan phi", "loss factor", "1", 1.0),
    "damping": ("E' eta / (2 pi f)", "c by Eq. 9", "GPa s", 1e-9),
}

SLACK = "within {:.2g} {} counts: what the digits of both sides leave open"


def table_entries(runs: MaterialRuns, sets: Mapping[SetName, Parameters]) -> Iterator[Entry]:
    """All rows; the corrected numbers are those of the loops of :class:`MaterialRuns`."""
    reasons = read_data(DATA / "claims.toml")["table_1"]
    rows = {row.frequency: row for row in runs.table.rows}
    for check in checks(runs.table):
        if check.column in COLUMNS and check.formula == COLUMNS[check.column][0]:
            row = rows[check.frequency]
            written = row.quantities[check.column]
            loop = loop_modulus(check.frequency, runs.loops[check.frequency])
            yield _value(check, written, loop_value(check.column, loop, check.frequency), reasons)
            if check.written_uncertainty is not None:
                errors = {name: _error(check, row, parameters.error_share) for name, parameters in sets.items()}
                yield _uncertainty(check, written, errors, reasons)


def _value(check: Check, written: Quantity, loop: float, reasons: Mapping[str, str]) -> Entry:
    formula, label, unit, scale = COLUMNS[check.column]
    # What the digits of the other columns leave open, and one unit of this one's last.
    slack = scale * (0.5 * (check.high - check.low) + written.digit)
    claim = Claim(
        id=f"table_1.{_place(check)}",
        section=SECTION,
        quantity=f"Table 1, {check.frequency:g} Hz: {label} from {formula}; corrected: the relaxing rope's loop",
        unit=unit,
        paper=_tidy(scale * check.written),
        tolerance=slack,
        below=slack,
        why="; ".join(filter(None, (SLACK.format(slack, unit), reasons.get(_place(check), "")))),
    )
    return Entry(claim, scale * check.recomputed, scale * loop)


def _error(check: Check, row: MaterialRow, share: float) -> float:
    """Propagated from the row's other columns; that of |E*|, whose columns have none, from sec. 3.1's."""
    return amplitude_error(row, share) * check.recomputed if check.uncertainty is None else check.uncertainty


def _uncertainty(check: Check, written: Quantity, errors: Mapping[SetName, float], reasons: Mapping[str, str]) -> Entry:
    _, label, unit, scale = COLUMNS[check.column]
    slack = scale * written.uncertainty_digit
    claim = Claim(
        id=f"table_1.{_place(check)}_uncertainty",
        section=SECTION,
        quantity=f"Table 1, {check.frequency:g} Hz: uncertainty of {label}, propagated",
        unit=unit,
        paper=_tidy(scale * (written.uncertainty or 0.0)),
        tolerance=slack,
        below=slack,
        why=reasons.get(f"{check.column}_uncertainty", ""),
    )
    return Entry(claim, scale * errors["printed"], scale * errors["corrected"])


def _place(check: Check) -> str:
    return f"{check.frequency:g}_hz.{check.column}"


def _tidy(value: float) -> float:
    """A printed number after a change of its unit, without the last bits of the product."""
    return float(f"{value:.10g}")
