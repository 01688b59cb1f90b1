"""The numbers that the figures of a campaign's page draw."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from ..report.series import packed, thinned
from ..report.units import significant
from .bands import Bands, bands_of
from .plan import Input, Plan
from .rows import RowColumn, series_columns
from .summary import Summary, numbers_of, parts_by_variant

Array = NDArray[np.float64]

BINS = 40
MOST_POINTS = 2000


def figures_of(
    plan: Plan, columns: Sequence[RowColumn], cable_count: int, summary: Summary, rows: pa.Table, folder: Path
) -> dict[str, Any]:
    """Bands and spreads of each path with each controller, ready to draw."""
    shown = numbers_shown(columns)
    variants = []
    for place, (path, controller, part) in enumerate(parts_by_variant(plan, rows)):
        kept = part.take(pa.array(thinned(part.num_rows, MOST_POINTS))) if part.num_rows else part
        quantiles = {
            each.name: each.quantiles for each in summary.spreads if (each.path, each.controller) == (path, controller)
        }
        bands: dict[str, Any] = {"time": "", "bands": []}
        if plan.paths and plan.compute.series > 1:
            names = series_columns(cable_count)
            bands = _bands(bands_of(plan, folder, place, names), names)
        variants.append(
            {
                "label": variant_label(path, controller),
                **bands,
                "spreads": [_spread(part, kept, each, quantiles, plan.method == "grid") for each in shown],
                "inputs": [packed(_steps_of(kept, each)) for each in plan.inputs] if plan.method == "grid" else [],
            }
        )
    inputs = [{"label": _axis(each), "place": place} for place, each in enumerate(plan.inputs)]
    # The scripts shared by all pages begin with choices where there are any; these begin by themselves.
    return {"choices": [], "variants": variants, "inputs": inputs}


def _axis(one: Input) -> str:
    """An input's key, and where its texts stand on an axis."""
    places = ", ".join(f"{place} {words}" for place, words in enumerate(one.distribution.texts))
    return f"{one.key} ({places})" if places else one.key


def _steps_of(rows: pa.Table, one: Input) -> Array:
    """What an input is in each run; of texts their places."""
    if not one.distribution.texts:
        return numbers_of(rows, one.key)
    return np.array([float(one.distribution.texts.index(each)) for each in rows[one.key].to_pylist()])


def numbers_shown(columns: Sequence[RowColumn]) -> list[RowColumn]:
    """The outputs that are numbers."""
    return [each for each in columns if each.role == "output" and each.kind == "number"]


def variant_label(path: str, controller: str) -> str:
    """What to call a path with a controller."""
    return f"{path}, {controller}" if path else "at rest"


def label_of(name: str) -> str:
    """A column's name as words."""
    return name.replace("_", " ")


def channel_kind(name: str) -> tuple[str, str, str]:
    """The title, the label and the unit of a series."""
    prefix, _, cable = name.rpartition("_")
    return ("Tension", f"cable {cable}", "N") if prefix else ("Position", name, "m")


def _bands(bands: Bands, names: Sequence[str]) -> dict[str, Any]:
    shown = []
    for name in names:
        title, label, unit = channel_kind(name)
        found = bands.quantiles.get(name)
        low, middle, high = (None, None, None) if found is None else map(packed, found)
        width = "" if found is None else significant(float(np.nanmax(found[2] - found[0])))
        shown.append(
            {"title": title, "label": label, "unit": unit, "low": low, "middle": middle, "high": high, "width": width}
        )
    return {"time": packed(bands.time), "bands": shown}


def _spread(
    rows: pa.Table, kept: pa.Table, column: RowColumn, quantiles: Mapping[str, Sequence[float]], is_grid: bool
) -> dict[str, Any]:
    """A histogram of an output, or its values over a grid."""
    told: dict[str, Any] = {"label": label_of(column.name), "unit": column.unit or "1", "words": ""}
    values = numbers_of(rows, column.name)
    known = values[np.isfinite(values)]
    if not known.size:
        return {**told, "edges": None, "counts": None, "quantiles": [], "values": None}
    if is_grid:
        ends = f"{significant(float(known.min()), 4)} to {significant(float(known.max()), 4)} {column.unit}".rstrip()
        return {**told, "words": ends, "values": packed(numbers_of(kept, column.name))}
    counts, edges = np.histogram(known, min(BINS, max(5, int(np.sqrt(known.size)))))
    low, _, middle, _, high = quantiles[column.name]
    words = f"{significant(low, 4)} to {significant(high, 4)} {column.unit}".rstrip()
    drawn = {"edges": packed(edges), "counts": packed(counts.astype(float)), "quantiles": [low, middle, high]}
    return {**told, "words": words, **drawn}
