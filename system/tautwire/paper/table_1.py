"""Ledger entries of Table 1: each column from the others and from our loops, with propagated uncertainties."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from ..materials.consistency import ConsistencyCheck, consistency_checks
from ..materials.table import MaterialRow, Quantity
from .claims import Claim, LedgerEntry
from .material import RopeTestRuns, column_value, dynamic_modulus_error, loop_complex_modulus
from .parameters import DATA_FOLDER, PaperParameters, ParameterSetName, read_data

TABLE_1_SECTION = "3.2"
# Column: formula from the others, label, unit, scale from SI.
TABLE_1_COLUMNS = {
    "dynamic_modulus": ("sigma / eps", "|E*|", "GPa", 1e-9),
    "storage_modulus": ("|E*| cos phi", "E'", "GPa", 1e-9),
    "loss_factor": ("tan phi", "loss factor", "1", 1.0),
    "damping": ("E' eta / (2 pi f)", "c by Eq. 9", "GPa s", 1e-9),
}

TOLERANCE_TEXT = "within {:.2g} {} counts: what the digits of both sides leave open"


def table_1_entries(
    runs: RopeTestRuns, parameter_sets: Mapping[ParameterSetName, PaperParameters]
) -> Iterator[LedgerEntry]:
    """Entries of all rows; the corrected numbers are those of the loops of :class:`RopeTestRuns`."""
    reasons = read_data(DATA_FOLDER / "claims.toml")["table_1"]
    rows = {row.frequency: row for row in runs.table.rows}
    for check in consistency_checks(runs.table):
        if check.column in TABLE_1_COLUMNS and check.formula == TABLE_1_COLUMNS[check.column][0]:
            row = rows[check.frequency]
            written = row.quantities[check.column]
            loop = loop_complex_modulus(check.frequency, runs.loops[check.frequency])
            yield _value_entry(check, written, column_value(check.column, loop, check.frequency), reasons)
            if check.written_uncertainty is not None:
                errors = {
                    name: _propagated_error(check, row, parameters.error_share)
                    for name, parameters in parameter_sets.items()
                }
                yield _uncertainty_entry(check, written, errors, reasons)


def _value_entry(check: ConsistencyCheck, written: Quantity, loop: float, reasons: Mapping[str, str]) -> LedgerEntry:
    formula, label, unit, scale = TABLE_1_COLUMNS[check.column]
    # Half the range that the digits of the other columns allow, and one unit of this column's last digit.
    tolerance = scale * (0.5 * (check.high - check.low) + written.resolution)
    claim = Claim(
        id=f"table_1.{_entry_key(check)}",
        section=TABLE_1_SECTION,
        quantity=f"Table 1, {check.frequency:g} Hz: {label} from {formula}; corrected: the relaxing rope's loop",
        unit=unit,
        paper_value=_without_float_noise(scale * check.written),
        upper_tolerance=tolerance,
        lower_tolerance=tolerance,
        explanation="; ".join(
            filter(None, (TOLERANCE_TEXT.format(tolerance, unit), reasons.get(_entry_key(check), "")))
        ),
    )
    return LedgerEntry(claim, scale * check.recomputed, scale * loop)


def _propagated_error(check: ConsistencyCheck, row: MaterialRow, error_share: float) -> float:
    """Uncertainty propagated from the row's other columns; that of |E*|, whose columns have none, from sec. 3.1's."""
    return (
        dynamic_modulus_error(row, error_share) * check.recomputed if check.uncertainty is None else check.uncertainty
    )


def _uncertainty_entry(
    check: ConsistencyCheck, written: Quantity, errors: Mapping[ParameterSetName, float], reasons: Mapping[str, str]
) -> LedgerEntry:
    _, label, unit, scale = TABLE_1_COLUMNS[check.column]
    tolerance = scale * written.uncertainty_resolution
    claim = Claim(
        id=f"table_1.{_entry_key(check)}_uncertainty",
        section=TABLE_1_SECTION,
        quantity=f"Table 1, {check.frequency:g} Hz: uncertainty of {label}, propagated",
        unit=unit,
        paper_value=_without_float_noise(scale * (written.uncertainty or 0.0)),
        upper_tolerance=tolerance,
        lower_tolerance=tolerance,
        explanation=reasons.get(f"{check.column}_uncertainty", ""),
    )
    return LedgerEntry(claim, scale * errors["printed"], scale * errors["corrected"])


def _entry_key(check: ConsistencyCheck) -> str:
    return f"{check.frequency:g}_hz.{check.column}"


def _without_float_noise(value: float) -> float:
    """A printed number after a change of unit, rounded to remove floating-point noise."""
    return float(f"{value:.10g}")
