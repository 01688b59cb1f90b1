"""Data of the figures on a campaign's page: quantile bands over time, histograms and grids."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from ..number_format import format_significant, page_unit
from ..recordings.quaternion_columns import rotation_vectors
from ..reports.downsampling import evenly_spaced_indices, pack_float32
from .campaign_dataset import SERIES_FOLDER, part_files
from .campaign_plan import Input, Plan
from .campaign_summary import Summary, column_values, rows_by_variant
from .dataset_schema import ORIENTATION_COLUMNS, RowColumn
from .platform_rotations import ROTATION_CHANNELS, start_orientations, summary_channels

Array = NDArray[np.float64]

# Quantiles of this many runs are as good as those of all, and memory stays bounded.
MAX_BAND_RUNS = 4000
BAND_QUANTILE_LEVELS = (0.025, 0.5, 0.975)

MAX_HISTOGRAM_BINS = 40
MAX_CURVE_NUMBERS = 50_000  # in all bands of a page, and in all outputs over a grid
MAX_GRID_POINTS, MIN_CURVE_POINTS = 2000, 50


@dataclass(frozen=True)
class QuantileBands:
    """Quantile bands of a path and a controller over ``time`` (P,) in s: ``quantiles`` (3, P) by channel, in SI units.

    Their levels are :data:`BAND_QUANTILE_LEVELS`, of ``run_count`` runs; empty where no run was completed.
    """

    time: Array
    quantiles: dict[str, Array]
    run_count: int


def quantile_bands(plan: Plan, folder: Path, variant: int, channels: tuple[str, ...]) -> QuantileBands:
    """Quantile bands of one path with one controller, of at most :data:`MAX_BAND_RUNS` runs spread evenly over all."""
    samples = np.unique(np.linspace(0, plan.count - 1, min(plan.count, MAX_BAND_RUNS)).round().astype(np.int64))
    run_indices = samples * len(plan.variants) + variant

    def values_of(name: str) -> Array:
        part_values = [_read_channel(part, name, run_indices) for part in part_files(folder, SERIES_FOLDER)]
        return np.concatenate([np.zeros(0), *part_values]).reshape(-1, max(plan.compute.series, 1))

    times = values_of("time")
    if not len(times):
        return QuantileBands(np.zeros(0), {}, 0)
    rotations: dict[str, Array] = {}
    if plan.is_rigid:
        quaternions = np.stack([values_of(name).ravel() for name in ORIENTATION_COLUMNS], axis=1)
        start = start_orientations(plan)[plan.paths[plan.variants[variant][0]].name]
        vectors = rotation_vectors(quaternions, start).T.reshape(-1, *times.shape)
        rotations = dict(zip(ROTATION_CHANNELS, vectors, strict=True))
    quantiles: dict[str, Array] = {}
    for name in channels:
        values = rotations[name] if name in rotations else values_of(name)
        quantiles[name] = np.nanquantile(values, BAND_QUANTILE_LEVELS, axis=0)
    return QuantileBands(times[0], quantiles, len(times))


def _read_channel(part: Path, name: str, run_indices: NDArray[np.int64]) -> Array:
    table = pq.read_table(part, columns=["index", name], partitioning=None)
    return np.asarray(table[name].to_numpy(), dtype=float)[np.isin(table["index"].to_numpy(), run_indices)]


@dataclass(frozen=True)
class CampaignResults:
    """Results of a campaign: the ``columns`` of its ``rows``, their ``summary``, and the dataset's ``folder``."""

    columns: Sequence[RowColumn]
    rows: pa.Table
    summary: Summary
    folder: Path


def figure_data(plan: Plan, cable_count: int, results: CampaignResults) -> dict[str, Any]:
    """Quantile bands and histograms of each path with each controller, packed for the page."""
    is_grid, names = plan.method == "grid", summary_channels(plan, cable_count)
    band_points, grid_points = _curve_points(plan, len(names), len(numeric_outputs(results.columns)))
    variants = []
    for variant, (path, controller, rows) in enumerate(rows_by_variant(plan, results.rows)):
        thinned_rows = rows.take(pa.array(evenly_spaced_indices(rows.num_rows, grid_points)))
        spreads = [each for each in results.summary.spreads if (each.path, each.controller) == (path, controller)]
        quantiles = {each.name: each.quantiles for each in spreads}
        bands: dict[str, Any] = {"time": "", "bands": []}
        if plan.paths and plan.compute.series > 1:
            bands = _band_data(quantile_bands(plan, results.folder, variant, names), names, band_points)
        outputs = [
            _spread_data(rows, thinned_rows, each, quantiles, is_grid) for each in numeric_outputs(results.columns)
        ]
        inputs = [pack_float32(_numeric_values(thinned_rows, each)) for each in plan.inputs] if is_grid else []
        variants.append({"label": variant_label(path, controller), **bands, "spreads": outputs, "inputs": inputs})
    axes = [{"label": _axis_label(each), "place": place} for place, each in enumerate(plan.inputs)]
    # The scripts that all pages share read choices; those of campaigns read variants.
    return {"choices": [], "variants": variants, "inputs": axes}


def _curve_points(plan: Plan, channel_count: int, output_count: int) -> tuple[int, int]:
    """Points of each band and of each output over a grid, so many as a page can hold for all variants."""
    numbers = MAX_CURVE_NUMBERS // len(plan.variants)
    band_points, grid_points = numbers // (1 + 3 * channel_count), numbers // max(1, output_count + len(plan.inputs))
    return max(MIN_CURVE_POINTS, band_points), int(np.clip(grid_points, MIN_CURVE_POINTS, MAX_GRID_POINTS))


def _axis_label(varied: Input) -> str:
    """Axis label of an input: its key, and the numbers that stand for its texts."""
    codes = ", ".join(f"{place} {words}" for place, words in enumerate(varied.distribution.texts))
    return f"{varied.key} ({codes})" if codes else varied.key


def _numeric_values(rows: pa.Table, varied: Input) -> Array:
    """Values of an input in each run; texts as their indices."""
    if not varied.distribution.texts:
        return column_values(rows, varied.key)
    return np.array([float(varied.distribution.texts.index(each)) for each in rows[varied.key].to_pylist()])


def numeric_outputs(columns: Sequence[RowColumn]) -> list[RowColumn]:
    """The numeric outputs."""
    return [each for each in columns if each.role == "output" and each.kind == "number"]


def variant_label(path: str, controller: str) -> str:
    """Label of a path with a controller."""
    return f"{path}, {controller}" if path else "at rest"


def column_label(name: str) -> str:
    """A column's name in words."""
    return name.replace("_", " ")


def channel_description(name: str) -> tuple[str, str, str]:
    """Title, label and unit of a time series."""
    if name in ROTATION_CHANNELS:
        return "Rotation", f"about {name[-1]}", "rad"
    _, is_tension, cable = name.rpartition("_")
    return ("Tension", f"cable {cable}", "N") if is_tension else ("Position", name, "m")


def _band_data(bands: QuantileBands, names: Sequence[str], max_points: int) -> dict[str, Any]:
    points = evenly_spaced_indices(bands.time.size, max_points)
    return {
        "time": pack_float32(bands.time[points]),
        "bands": [_channel_data(name, bands.quantiles.get(name), points) for name in names],
    }


def _channel_data(name: str, quantiles: Array | None, points: NDArray[np.int64]) -> dict[str, Any]:
    """A channel's median, and its band as distances from it: beside a long way float32 would round a narrow band.

    Both are drawn at some ``points``; the ``width`` is the largest at any time.
    """
    title, label, si_unit = channel_description(name)
    unit, unit_size = page_unit(si_unit)
    description = {"title": title, "label": label, "unit": unit}
    if quantiles is None:
        return {**description, "low": None, "middle": None, "high": None, "width": ""}
    low, middle, high = quantiles / unit_size
    return {
        **description,
        "low": pack_float32((low - middle)[points]),
        "middle": pack_float32(middle[points]),
        "high": pack_float32((high - middle)[points]),
        "width": format_significant(float(np.nanmax(high - low))),
    }


def _spread_data(
    rows: pa.Table, thinned_rows: pa.Table, column: RowColumn, quantiles: Mapping[str, Sequence[float]], is_grid: bool
) -> dict[str, Any]:
    """A histogram of an output, or its values over a grid."""
    unit, unit_size = page_unit(column.unit)
    common: dict[str, Any] = {"label": column_label(column.name), "unit": unit or "1", "words": ""}
    values = column_values(rows, column.name) / unit_size
    finite = values[np.isfinite(values)]
    if not finite.size:
        return {**common, "edges": None, "counts": None, "quantiles": [], "values": None}
    if is_grid:
        range_text = (
            f"{format_significant(float(finite.min()), 4)} to {format_significant(float(finite.max()), 4)} {unit}"
        ).rstrip()
        return {
            **common,
            "words": range_text,
            "values": pack_float32(column_values(thinned_rows, column.name) / unit_size),
        }
    counts, edges = np.histogram(finite, min(MAX_HISTOGRAM_BINS, max(5, int(np.sqrt(finite.size)))))
    low, _, middle, _, high = (each / unit_size for each in quantiles[column.name])
    words = f"{format_significant(low, 4)} to {format_significant(high, 4)} {unit}".rstrip()
    histogram = {
        "edges": pack_float32(edges),
        "counts": pack_float32(counts.astype(float)),
        "quantiles": [low, middle, high],
    }
    return {**common, "words": words, **histogram}
