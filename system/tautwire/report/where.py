"""The part of the page that tells where a robot errs: each FMU alone at its measured ports."""

from __future__ import annotations

import math

from ..tracer.verdict import Trace
from ..tracer.where.port_residuals import ComponentResidual
from . import charts
from .markup import Column, bullets, number, section, table, text
from .units import ABSENT, significant

COLUMNS = (
    Column("Component"), Column("Quantity"), Column("Residual", True), Column("Expected", True), Column("Times", True),
    Column("Times expected, logarithmic"), Column("Moves with", wide=True),
)  # fmt: skip
LEAST_SPAN = (0.5, 4.0)


def where(trace: Trace) -> str:
    """What each FMU alone leaves, against what noise would leave there, the worst first."""
    found = trace.components
    lead = (
        "Before any effect is fitted, each FMU runs alone along the fit recording: a cable on the measured path with "
        "the recorded winch speed, against its load cell; the platform under the measured tensions, against its path. "
        "Expected is what noise alone would leave; once that, the line, is noise. “Moves with” names what the residual "
        "(measured minus computed) follows best, with the correlation: 100 % where it does so exactly, negative where "
        "it runs against it."
    )
    ratios = [part.ratio for part in found.parts if math.isfinite(part.ratio) and part.ratio > 0.0]
    low = min([LEAST_SPAN[0], *(0.8 * ratio for ratio in ratios)])
    high = max([LEAST_SPAN[1], *(1.25 * ratio for ratio in ratios)])
    rows = [_row(part, low, high) for part in found.ranking]
    content = f"<p><strong>{text(found.sentence)}</strong></p>"
    if rows:
        content += table("What each FMU alone leaves", COLUMNS, rows, "where", True)
    if found.untold:
        content += bullets(found.untold)
    return section("where", "Where it comes from", content, lead)


def _row(part: ComponentResidual, low: float, high: float) -> list[str]:
    unit = f'<span class="unit">{text(part.unit)}</span>'
    moved = part.moves_with
    told = f"{moved.name} ({100.0 * moved.correlation:.0f} %)" if moved else ABSENT
    if part.rings_at is not None and part.is_off:
        told = f"rings at {part.rings_at:.2f} Hz"
    return [
        text(part.component),
        text(part.quantity),
        f"{number(significant(part.rms))} {unit}",
        f"{number(significant(part.expected_rms))} {unit}",
        number(significant(part.ratio)),
        charts.log_bar(part.ratio, low, high, mark=1.0, name="before" if part.is_off else "after"),
        number(told),
    ]
