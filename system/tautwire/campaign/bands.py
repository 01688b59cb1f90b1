"""Bands over time: what the middle of all runs did along a path."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
from numpy.typing import NDArray

from .dataset import SERIES, parts_of
from .plan import Plan

Array = NDArray[np.float64]

# Quantiles of so many runs are as good as of all, and memory stays what it is.
MOST_RUNS = 4000
SHARES = (0.025, 0.5, 0.975)


@dataclass(frozen=True)
class Bands:
    """The runs of a path and a controller over ``time`` (P,) in s: ``quantiles`` (3, P) by channel, in SI units.

    They are at :data:`SHARES` of ``runs`` runs; empty where no run came to an end.
    """

    time: Array
    quantiles: dict[str, Array]
    runs: int


def bands_of(plan: Plan, folder: Path, variant: int, channels: tuple[str, ...]) -> Bands:
    """The bands of one path with one controller, of at most :data:`MOST_RUNS` runs spread evenly over all."""
    samples = np.unique(np.linspace(0, plan.count - 1, min(plan.count, MOST_RUNS)).round().astype(np.int64))
    wanted = samples * len(plan.variants) + variant
    points = plan.compute.series
    time, quantiles, runs = np.zeros(0), {}, 0
    for name in ("time", *channels):
        kept = [_column(part, name, wanted) for part in parts_of(folder, SERIES)]
        values = np.concatenate([np.zeros(0), *kept]).reshape(-1, max(points, 1))
        if not len(values):
            return Bands(np.zeros(0), {}, 0)
        if name == "time":
            time, runs = values[0], len(values)
        else:
            quantiles[name] = np.nanquantile(values, SHARES, axis=0)
    return Bands(time, quantiles, runs)


def _column(part: Path, name: str, wanted: NDArray[np.int64]) -> Array:
    table = pq.read_table(part, columns=["index", name], partitioning=None)
    return np.asarray(table[name].to_numpy(), dtype=float)[np.isin(table["index"].to_numpy(), wanted)]
