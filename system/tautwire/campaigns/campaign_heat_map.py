"""Heat maps of Sobol indices on a campaign's page: outputs over inputs, a table for each path and controller."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

from ..number_format import ABSENT_TEXT
from ..reports.page_rendering import HeatCell, Row
from .campaign_figures import column_label, variant_label
from .campaign_summary import SobolIndices

# Lower bounds of the levels 1 to 5 of a heat cell.
LEVEL_BOUNDS = (0.05, 0.2, 0.4, 0.6, 0.8)
HEAT_KEYS = (
    HeatCell(f"below {LEVEL_BOUNDS[0]:g}", 0),
    *(HeatCell(f"from {bound:g}", level) for level, bound in enumerate(LEVEL_BOUNDS, 1)),
)


@dataclass(frozen=True)
class HeatMap:
    """A heat map as a table: a row for each output, with a cell for each of the ``inputs``."""

    caption: str
    inputs: list[str]
    rows: list[Row]


def sobol_heat_maps(dependences: Sequence[SobolIndices]) -> list[HeatMap]:
    """Heat maps of the total Sobol indices, or of first-order ones where the design gives no total."""
    maps = []
    for variant in dict.fromkeys((each.path, each.controller) for each in dependences):
        matching = [each for each in dependences if (each.path, each.controller) == variant]
        indices = {(each.output, each.input): each for each in matching}
        inputs = list(dict.fromkeys(each.input for each in matching))
        order = "total" if all(each.total is not None for each in matching) else "first order"
        rows: list[Row] = [
            [column_label(output), *(_heat_cell(indices[output, name], order == "total") for name in inputs)]
            for output in dict.fromkeys(each.output for each in matching)
        ]
        # Headers break at spaces.
        titles = [name.replace(".", " ") for name in inputs]
        maps.append(HeatMap(f"Sobol indices, {order}, {variant_label(*variant)}", titles, rows))
    return maps


def _heat_cell(each: SobolIndices, is_total: bool) -> HeatCell:
    """An index on a ground by its size; a dash where its interval contains 0."""
    if not (each.is_total_significant if is_total else each.is_first_significant):
        return HeatCell(ABSENT_TEXT, 0)
    index = (each.total or 0.0) if is_total else each.first
    return HeatCell(f"{index:.2f}", bisect_right(LEVEL_BOUNDS, round(index, 2)))
