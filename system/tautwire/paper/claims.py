"""The ledger: what the paper claims, what our runs give, and whether the two agree."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Any, Literal

from .panels import time_figures
from .parameters import DATA, read_data
from .values import Values

Rule = Literal["near", "below", "above", "within", "axis"]
Verdict = Literal["reproduced", "reproduced after correction", "not reproducible"]
Number = float | tuple[float, float]

# A curve lies on a printed axis if it leaves it by no more than this share, and fills it by at least that one.
BEYOND, FILLED = 0.02, 0.5
ROUNDING = 1e-9


@dataclass(frozen=True)
class Claim:
    """A number of the paper, by a ``rule``; two numbers are a range.

    ``near``: in size no more than ``tolerance`` above it, ``below`` below it. ``corrections`` are what the corrected
    parameters change, in words. ``needs`` is the claim without which the printed parameters give another motion.
    ``digits`` are as printed.
    """

    id: str
    section: str
    quantity: str
    unit: str
    paper: Number
    tolerance: float
    below: float = 0.0
    rule: Rule = "near"
    corrections: tuple[str, ...] = ()
    why: str = ""
    needs: str = ""
    digits: str = ""

    def agrees(self, ours: Number | None) -> bool:
        """Whether a number of ours is what the paper claims."""
        if ours is None:
            return False
        if isinstance(ours, tuple):
            return isinstance(self.paper, tuple) and _lies_on(ours, self.paper)
        if isinstance(self.paper, tuple):
            return self.paper[0] <= ours <= self.paper[1]
        if self.rule == "below":
            return ours < self.paper
        if self.rule == "above":
            return ours > self.paper
        beyond = (ours - self.paper) * (-1.0 if self.paper < 0.0 else 1.0)
        return -self.below * (1.0 + ROUNDING) <= beyond <= self.tolerance * (1.0 + ROUNDING)


@dataclass(frozen=True)
class Entry:
    """A row of the ledger."""

    claim: Claim
    printed: Number | None
    corrected: Number | None
    same_motion: bool = True

    @property
    def verdict(self) -> Verdict:
        """As the printed parameters are, those that give the figures, or neither.

        With the printed ones only where their motion is the paper's, ``same_motion``.
        """
        if self.same_motion and self.claim.agrees(self.printed):
            return "reproduced"
        return "reproduced after correction" if self.claim.agrees(self.corrected) else "not reproducible"

    @property
    def why(self) -> str:
        """Which correction it took, and what else there is to say."""
        used = "; ".join(self.claim.corrections) if self.verdict == "reproduced after correction" else ""
        return "; ".join(part for part in (used, self.claim.why) if part)

    def document(self) -> dict[str, Any]:
        """The row as JSON has it."""
        return {
            "id": self.claim.id,
            "section": self.claim.section,
            "quantity": self.claim.quantity,
            "unit": self.claim.unit,
            "paper": list(self.claim.paper) if isinstance(self.claim.paper, tuple) else self.claim.paper,
            "printed_parameters": _rounded(self.printed),
            "corrected_parameters": _rounded(self.corrected),
            "verdict": self.verdict,
            "why": self.why,
        }


def judged(claims: Sequence[Claim], printed: Values, corrected: Values) -> tuple[Entry, ...]:
    """The rows of some claims; what needs a claim that the printed parameters break is not judged by these."""
    met = {claim.id for claim in claims if claim.agrees(printed.get(claim.id))}
    return tuple(
        Entry(claim, printed.get(claim.id), corrected.get(claim.id), not claim.needs or claim.needs in met)
        for claim in claims
    )


def text_claims() -> tuple[Claim, ...]:
    """The claims of the text."""
    content = read_data(DATA / "claims.toml")
    return tuple(_claim(table, content) for table in content["claim"])


def axis_claims() -> Iterator[Claim]:
    """That the curves lie on the printed axes, and fill them."""
    named = read_data(DATA / "claims.toml")["correction"]
    for each in time_figures():
        for panel in each.panels:
            if panel.y is None:
                continue
            label = panel.label.replace("$", "").replace("\\Delta ", "error ").replace("_", "")
            quantity, _, unit = label.rstrip(")").rpartition(" (")
            keys = panel.corrections or each.corrections
            yield Claim(
                id=panel.name,
                section=each.section,
                quantity=f"Fig. {int(each.number)}{panel.letter}: range of {quantity} on the printed axis",
                unit=unit,
                paper=panel.y,
                tolerance=0.0,
                needs=each.needs,
                rule="axis",
                corrections=tuple(named[key] for key in keys),
                why=panel.reason,
            )


def _lies_on(ours: tuple[float, float], axis: tuple[float, float]) -> bool:
    span = axis[1] - axis[0]
    inside = ours[0] >= axis[0] - BEYOND * span and ours[1] <= axis[1] + BEYOND * span
    return inside and ours[1] - ours[0] >= FILLED * span


def _claim(table: Mapping[str, Any], named: Mapping[str, Mapping[str, Any]]) -> Claim:
    paper, rule = table["paper"], table.get("rule", "near")
    digit = 0.0 if isinstance(paper, list) else _last_digit(paper)
    allowed, reasons = 0.0, [table.get("why", "")]
    if "tolerance" in table:
        reasons.append(f"{table['tolerance']:g} {table['unit']}".removesuffix(" 1") + " allowed")
    if "allowance" in table:
        allowance = named["allowance"][table["allowance"]]
        allowed = allowance["share"] * abs(float(paper))
        reasons += [allowance["why"]] if allowed > 0.5 * digit else []
    return Claim(
        id=table["id"],
        section=table["section"],
        quantity=table["quantity"],
        unit=table["unit"],
        paper=float(paper) if isinstance(paper, str) else (float(paper[0]), float(paper[1])),
        # Rounded digits are half a unit off either way, cut off ones up to a whole one below.
        tolerance=table.get("tolerance", max(digit, allowed)),
        below=table.get("tolerance", max(0.5 * digit, allowed)),
        rule=rule,
        corrections=tuple(named["correction"][key] for key in table.get("corrections", ())),
        why="; ".join(filter(None, reasons)),
        needs=table.get("needs", ""),
        digits=paper if isinstance(paper, str) else "",
    )


def _last_digit(text: str) -> float:
    """One unit of the last digit written."""
    exponent = Decimal(text).as_tuple().exponent
    return 10.0 ** int(exponent)


def _rounded(number: Number | None) -> float | Sequence[float] | None:
    if number is None:
        return None
    return [float(f"{each:.6g}") for each in number] if isinstance(number, tuple) else float(f"{number:.6g}")
