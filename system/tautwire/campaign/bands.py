"""Quantile bands over time of all runs along a path."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
from numpy.typing import NDArray

from .dataset import SERIES_FOLDER, part_files
from .plan import Plan

Array = NDArray[np.float64]

# Quantiles of this many runs are as good as those of all, and memory stays bounded.
MAX_BAND_RUNS = 4000
BAND_QUANTILE_LEVELS = (0.025, 0.5, 0.975)


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
    point_count = plan.compute.series
    time, quantiles, run_count = np.zeros(0), {}, 0
    for name in ("time", *channels):
        part_values = [_read_channel(part, name, run_indices) for part in part_files(folder, SERIES_FOLDER)]
        values = np.concatenate([np.zeros(0), *part_values]).reshape(-1, max(point_count, 1))
        if not len(values):
            return QuantileBands(np.zeros(0), {}, 0)
        if name == "time":
            time, run_count = values[0], len(values)
        else:
            quantiles[name] = np.nanquantile(values, BAND_QUANTILE_LEVELS, axis=0)
    return QuantileBands(time, quantiles, run_count)


def _read_channel(part: Path, name: str, run_indices: NDArray[np.int64]) -> Array:
    table = pq.read_table(part, columns=["index", name], partitioning=None)
    return np.asarray(table[name].to_numpy(), dtype=float)[np.isin(table["index"].to_numpy(), run_indices)]
