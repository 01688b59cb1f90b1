"""The section of the page on localisation: the residual of each FMU alone at its measured ports."""

from __future__ import annotations

import math

from ..tracer.verdict import Trace
from ..tracer.where.port_residuals import ComponentResidual
from . import charts
from .markup import TableColumn, bullet_list, escape_text, number_html, section, table
from .units import ABSENT_TEXT, format_significant

LOCALISATION_COLUMNS = (
    TableColumn("Component"), TableColumn("Quantity"), TableColumn("Residual", True), TableColumn("Expected", True), TableColumn("Times", True),
    TableColumn("Times expected, logarithmic"), TableColumn("Moves with", wide=True),
)  # fmt: skip
MIN_RATIO_SPAN = (0.5, 4.0)


def localisation_section(trace: Trace) -> str:
    """Residuals of each FMU alone against their expected noise, the largest ratio first."""
    components = trace.components
    lead = (
        "Before any effect is fitted, each FMU runs alone along the fit recording: a cable on the measured path with "
        "the recorded winch speed, against its load cell; the platform under the measured tensions, against its path. "
        "Expected is what noise alone would leave; once that, the line, is noise. “Moves with” names what the residual "
        "(measured minus computed) follows best, with the correlation: 100 % where it does so exactly, negative where "
        "it runs against it."
    )
    ratios = [part.ratio for part in components.residuals if math.isfinite(part.ratio) and part.ratio > 0.0]
    low = min([MIN_RATIO_SPAN[0], *(0.8 * ratio for ratio in ratios)])
    high = max([MIN_RATIO_SPAN[1], *(1.25 * ratio for ratio in ratios)])
    rows = [_component_row(part, low, high) for part in components.ranking]
    content = f"<p><strong>{escape_text(components.sentence)}</strong></p>"
    if rows:
        content += table("What each FMU alone leaves", LOCALISATION_COLUMNS, rows, "where", True)
    if components.limitations:
        content += bullet_list(components.limitations)
    return section("where", "Where it comes from", content, lead)


def _component_row(part: ComponentResidual, low: float, high: float) -> list[str]:
    unit = f'<span class="unit">{escape_text(part.unit)}</span>'
    association = part.correlated_signal
    association_text = f"{association.name} ({100.0 * association.correlation:.0f} %)" if association else ABSENT_TEXT
    if part.resonance_frequency is not None and part.is_significant:
        association_text = f"rings at {part.resonance_frequency:.2f} Hz"
    return [
        escape_text(part.component),
        escape_text(part.quantity),
        f"{number_html(format_significant(part.rms))} {unit}",
        f"{number_html(format_significant(part.expected_rms))} {unit}",
        number_html(format_significant(part.ratio)),
        charts.log_bar(part.ratio, low, high, tick=1.0, css_class="before" if part.is_significant else "after"),
        number_html(association_text),
    ]
