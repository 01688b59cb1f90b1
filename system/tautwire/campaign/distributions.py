"""How a number of a plan is distributed, and what it is at a share of its probability."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

Array = NDArray[np.float64]

NORMAL, UNIFORM, TRIANGULAR, LOGNORMAL, LIST, LINSPACE = (
    "normal",
    "uniform",
    "triangular",
    "lognormal",
    "list",
    "linspace",
)
STEPPED = (LIST, LINSPACE)
# What a distribution's numbers are; a list has as many as it likes.
SHAPES: Mapping[str, tuple[str, ...]] = {
    NORMAL: ("mean", "standard deviation"),
    UNIFORM: ("least", "largest"),
    TRIANGULAR: ("least", "most probable", "largest"),
    LOGNORMAL: ("median", "standard deviation of the logarithm"),
    LINSPACE: ("first", "last", "count"),
}
KINDS = (*SHAPES, LIST)


@dataclass(frozen=True)
class Distribution:
    """A value's distribution: its ``kind``, one of :data:`KINDS`, and its ``numbers`` in the order of `SHAPES`.

    The numbers of a list of ``texts`` are their places, from zero.
    """

    kind: str
    numbers: tuple[float, ...]
    texts: tuple[str, ...] = ()

    @property
    def steps(self) -> tuple[float, ...]:
        """The values of a list or of a linspace, none of others."""
        if self.kind == LINSPACE:
            first, last, count = self.numbers
            return tuple(np.linspace(first, last, int(count)).tolist())
        return self.numbers if self.kind == LIST else ()

    def value(self, number: float) -> float | str:
        """What one of the numbers stands for."""
        return self.texts[int(number)] if self.texts else number

    def quantile(self, share: Array) -> Array:
        """The values below which these shares (N,) of the probability lie; steps are equally probable."""
        steps = self.steps
        if steps:
            return np.array(steps)[np.minimum((share * len(steps)).astype(int), len(steps) - 1)]
        return np.asarray(_QUANTILES[self.kind](share, *self.numbers), dtype=float)


def _triangular(share: Array, least: float, mode: float, largest: float) -> Array:
    return np.asarray(stats.triang.ppf(share, (mode - least) / (largest - least), least, largest - least))


_QUANTILES: Mapping[str, Callable[..., Array]] = {
    NORMAL: lambda share, mean, deviation: np.asarray(stats.norm.ppf(share, mean, deviation)),
    UNIFORM: lambda share, least, largest: least + share * (largest - least),
    TRIANGULAR: _triangular,
    LOGNORMAL: lambda share, median, deviation: median * np.exp(stats.norm.ppf(share, 0.0, deviation)),
}


def problem_of(kind: str, numbers: Sequence[float]) -> str | None:
    """Why these numbers make no distribution of this kind; None where they do."""
    shape = SHAPES.get(kind)
    if shape is not None and len(numbers) != len(shape):
        return f"has {len(numbers)} numbers, {kind} takes {len(shape)}: {', '.join(shape)}"
    if kind == LIST:
        return None if numbers else "is empty, a list has one value or more"
    if kind == LINSPACE:
        return None if numbers[2] >= 1 and numbers[2] == int(numbers[2]) else f"has a count of {numbers[2]:g}"
    if kind in (NORMAL, LOGNORMAL) and not numbers[1] > 0.0:
        return f"has a standard deviation of {numbers[1]:g}, must be above 0"
    if kind == LOGNORMAL and not numbers[0] > 0.0:
        return f"has a median of {numbers[0]:g}, must be above 0"
    if kind in (UNIFORM, TRIANGULAR) and not numbers[0] < numbers[-1]:
        return f"goes from {numbers[0]:g} to {numbers[-1]:g}, must rise"
    if kind == TRIANGULAR and not numbers[0] <= numbers[1] <= numbers[2]:
        return f"has its most probable value {numbers[1]:g} outside {numbers[0]:g} to {numbers[2]:g}"
    return None
