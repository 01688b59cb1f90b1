"""The ledger of claims: what the paper prints, what our runs give, and whether the two agree."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from typing import Any, Literal

from ..materials.material_table import MaterialRow, Quantity
from ..materials.table_consistency import ConsistencyCheck, consistency_checks
from .paper_figures import time_figures
from .paper_parameters import DATA_FOLDER, PaperParameters, ParameterSetName, read_data
from .rope_tests import RopeTestRuns, column_value, dynamic_modulus_error, loop_complex_modulus
from .simulation_records import ClaimValues

ComparisonRule = Literal["near", "below", "above", "within", "axis"]
ClaimVerdict = Literal["reproduced", "reproduced after correction", "not reproducible"]
ClaimNumber = float | tuple[float, float]

# A curve lies on a printed axis if it exceeds it by at most the first share of its span and fills at least the second.
MAX_AXIS_OVERSHOOT, MIN_AXIS_COVERAGE = 0.02, 0.5
ROUNDING_TOLERANCE = 1e-9

TABLE_1_SECTION = "3.2"
# Column: formula from the others, label, unit, scale from SI.
TABLE_1_COLUMNS = {
    "dynamic_modulus": ("sigma / eps", "|E*|", "GPa", 1e-9),
    "storage_modulus": ("|E*| cos phi", "E'", "GPa", 1e-9),
    "loss_factor": ("tan phi", "loss factor", "1", 1.0),
    "damping": ("E' eta / (2 pi f)", "c by Eq. 9", "GPa s", 1e-9),
}
TOLERANCE_TEXT = "within {:.2g} {} counts: what the digits of both sides leave open"


@dataclass(frozen=True)
class Claim:
    """A claimed number of the paper, compared by a ``rule``; two numbers are a range.

    ``near``: in size no more than ``upper_tolerance`` above it, ``lower_tolerance`` below it. ``corrections`` are what
    the corrected parameters change, in words. ``required_claim`` is the claim without which the printed parameters give
    another motion. ``printed_digits`` are as printed.
    """

    id: str
    section: str
    quantity: str
    unit: str
    paper_value: ClaimNumber
    upper_tolerance: float
    lower_tolerance: float = 0.0
    rule: ComparisonRule = "near"
    corrections: tuple[str, ...] = ()
    explanation: str = ""
    required_claim: str = ""
    printed_digits: str = ""

    def agrees(self, value: ClaimNumber | None) -> bool:
        """Whether a computed value agrees with the claim."""
        if value is None:
            return False
        if isinstance(value, tuple):
            return isinstance(self.paper_value, tuple) and _lies_on_axis(value, self.paper_value)
        if isinstance(self.paper_value, tuple):
            return self.paper_value[0] <= value <= self.paper_value[1]
        if self.rule == "below":
            return value < self.paper_value
        if self.rule == "above":
            return value > self.paper_value
        excess = (value - self.paper_value) * (-1.0 if self.paper_value < 0.0 else 1.0)
        return (
            -self.lower_tolerance * (1.0 + ROUNDING_TOLERANCE)
            <= excess
            <= self.upper_tolerance * (1.0 + ROUNDING_TOLERANCE)
        )


@dataclass(frozen=True)
class LedgerEntry:
    """A row of the ledger: a claim with the values of the printed and of the corrected parameters."""

    claim: Claim
    printed: ClaimNumber | None
    corrected: ClaimNumber | None
    same_motion: bool = True

    @property
    def verdict(self) -> ClaimVerdict:
        """Verdict: reproduced with the printed parameters, with the corrected ones, or with neither.

        With the printed ones only where their motion is the paper's, ``same_motion``.
        """
        if self.same_motion and self.claim.agrees(self.printed):
            return "reproduced"
        return "reproduced after correction" if self.claim.agrees(self.corrected) else "not reproducible"

    @property
    def explanation(self) -> str:
        """Explanation: the corrections that were needed, and remarks."""
        corrections = "; ".join(self.claim.corrections) if self.verdict == "reproduced after correction" else ""
        return "; ".join(part for part in (corrections, self.claim.explanation) if part)

    def document(self) -> dict[str, Any]:
        """The row as a JSON object."""
        return {
            "id": self.claim.id,
            "section": self.claim.section,
            "quantity": self.claim.quantity,
            "unit": self.claim.unit,
            "paper": list(self.claim.paper_value)
            if isinstance(self.claim.paper_value, tuple)
            else self.claim.paper_value,
            "printed_parameters": _rounded(self.printed),
            "corrected_parameters": _rounded(self.corrected),
            "verdict": self.verdict,
            "why": self.explanation,
        }


def judge_claims(claims: Sequence[Claim], printed: ClaimValues, corrected: ClaimValues) -> tuple[LedgerEntry, ...]:
    """Judge claims; one whose required claim the printed parameters violate is not judged by these."""
    satisfied = {claim.id for claim in claims if claim.agrees(printed.get(claim.id))}
    return tuple(
        LedgerEntry(
            claim,
            printed.get(claim.id),
            corrected.get(claim.id),
            not claim.required_claim or claim.required_claim in satisfied,
        )
        for claim in claims
    )


def text_claims() -> tuple[Claim, ...]:
    """The claims of the text."""
    content = read_data(DATA_FOLDER / "claims.toml")
    return tuple(_read_claim(table, content) for table in content["claim"])


def axis_claims() -> Iterator[Claim]:
    """The claims that the curves lie on the printed axes, and fill them."""
    correction_texts = read_data(DATA_FOLDER / "claims.toml")["correction"]
    for figure in time_figures():
        for panel in figure.panels:
            if panel.y is None:
                continue
            label = panel.label.replace("$", "").replace("\\Delta ", "error ").replace("_", "")
            quantity, _, unit = label.rstrip(")").rpartition(" (")
            keys = panel.corrections or figure.corrections
            yield Claim(
                id=panel.name,
                section=figure.section,
                quantity=f"Fig. {int(figure.number)}{panel.letter}: range of {quantity} on the printed axis",
                unit=unit,
                paper_value=panel.y,
                upper_tolerance=0.0,
                required_claim=figure.required_claim,
                rule="axis",
                corrections=tuple(correction_texts[key] for key in keys),
                explanation=panel.reason,
            )


def _lies_on_axis(extent: tuple[float, float], axis: tuple[float, float]) -> bool:
    span = axis[1] - axis[0]
    inside = extent[0] >= axis[0] - MAX_AXIS_OVERSHOOT * span and extent[1] <= axis[1] + MAX_AXIS_OVERSHOOT * span
    return inside and extent[1] - extent[0] >= MIN_AXIS_COVERAGE * span


def _read_claim(table: Mapping[str, Any], definitions: Mapping[str, Mapping[str, Any]]) -> Claim:
    paper, rule = table["paper"], table.get("rule", "near")
    digit_unit = 0.0 if isinstance(paper, list) else _last_digit_unit(paper)
    allowance_width, reasons = 0.0, [table.get("why", "")]
    if "tolerance" in table:
        reasons.append(f"{table['tolerance']:g} {table['unit']}".removesuffix(" 1") + " allowed")
    if "allowance" in table:
        allowance = definitions["allowance"][table["allowance"]]
        allowance_width = allowance["share"] * abs(float(paper))
        reasons += [allowance["why"]] if allowance_width > 0.5 * digit_unit else []
    return Claim(
        id=table["id"],
        section=table["section"],
        quantity=table["quantity"],
        unit=table["unit"],
        paper_value=float(paper) if isinstance(paper, str) else (float(paper[0]), float(paper[1])),
        # Rounded digits err by half a unit either way, truncated ones by up to a whole unit below.
        upper_tolerance=table.get("tolerance", max(digit_unit, allowance_width)),
        lower_tolerance=table.get("tolerance", max(0.5 * digit_unit, allowance_width)),
        rule=rule,
        corrections=tuple(definitions["correction"][key] for key in table.get("corrections", ())),
        explanation="; ".join(filter(None, reasons)),
        required_claim=table.get("needs", ""),
        printed_digits=paper if isinstance(paper, str) else "",
    )


def _last_digit_unit(text: str) -> float:
    """One unit of the last digit written."""
    exponent = Decimal(text).as_tuple().exponent
    return 10.0 ** int(exponent)


def _rounded(number: ClaimNumber | None) -> float | Sequence[float] | None:
    if number is None:
        return None
    return [float(f"{each:.6g}") for each in number] if isinstance(number, tuple) else float(f"{number:.6g}")


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
    explanation = "; ".join(filter(None, (TOLERANCE_TEXT.format(tolerance, unit), reasons.get(_entry_key(check), ""))))
    quantity = f"{label} from {formula}; corrected: the relaxing rope's loop"
    claim = _table_1_claim(check, quantity, scale * check.written, tolerance, explanation)
    return LedgerEntry(claim, scale * check.recomputed, scale * loop)


def _propagated_error(check: ConsistencyCheck, row: MaterialRow, error_share: float) -> float:
    """Uncertainty propagated from the row's other columns; that of |E*|, whose columns have none, from sec. 3.1's."""
    return (
        dynamic_modulus_error(row, error_share) * check.recomputed if check.uncertainty is None else check.uncertainty
    )


def _uncertainty_entry(
    check: ConsistencyCheck, written: Quantity, errors: Mapping[ParameterSetName, float], reasons: Mapping[str, str]
) -> LedgerEntry:
    _, label, _, scale = TABLE_1_COLUMNS[check.column]
    quantity, value = f"uncertainty of {label}, propagated", scale * (written.uncertainty or 0.0)
    explanation = reasons.get(f"{check.column}_uncertainty", "")
    claim = _table_1_claim(check, quantity, value, scale * written.uncertainty_resolution, explanation)
    claim = replace(claim, id=f"{claim.id}_uncertainty")
    return LedgerEntry(claim, scale * errors["printed"], scale * errors["corrected"])


def _table_1_claim(check: ConsistencyCheck, quantity: str, value: float, tolerance: float, explanation: str) -> Claim:
    return Claim(
        id=f"table_1.{_entry_key(check)}",
        section=TABLE_1_SECTION,
        quantity=f"Table 1, {check.frequency:g} Hz: {quantity}",
        unit=TABLE_1_COLUMNS[check.column][2],
        # A change of unit adds floating-point noise to a printed number.
        paper_value=float(f"{value:.10g}"),
        upper_tolerance=tolerance,
        lower_tolerance=tolerance,
        explanation=explanation,
    )


def _entry_key(check: ConsistencyCheck) -> str:
    return f"{check.frequency:g}_hz.{check.column}"
