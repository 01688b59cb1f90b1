"""Probability distributions of the inputs of a plan, and their quantile functions."""

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
DISCRETE_KINDS = (LIST, LINSPACE)
# Names of each distribution's parameters; a list has any number of values.
PARAMETER_NAMES: Mapping[str, tuple[str, ...]] = {
    NORMAL: ("mean", "standard deviation"),
    UNIFORM: ("least", "largest"),
    TRIANGULAR: ("least", "most probable", "largest"),
    LOGNORMAL: ("median", "standard deviation of the logarithm"),
    LINSPACE: ("first", "last", "count"),
}
DISTRIBUTION_KINDS = (*PARAMETER_NAMES, LIST)


@dataclass(frozen=True)
class Distribution:
    """A probability distribution: its ``kind``, one of :data:`DISTRIBUTION_KINDS`, and its parameters ``numbers``.

    They are in the order of :data:`PARAMETER_NAMES`; those of a list of ``texts`` are indices, from zero.
    """

    kind: str
    numbers: tuple[float, ...]
    texts: tuple[str, ...] = ()

    @property
    def discrete_values(self) -> tuple[float, ...]:
        """The values of a discrete distribution, a list or a linspace; empty for others."""
        if self.kind == LINSPACE:
            first, last, count = self.numbers
            return tuple(np.linspace(first, last, int(count)).tolist())
        return self.numbers if self.kind == LIST else ()

    def value(self, number: float) -> float | str:
        """The value that a number encodes: the text of that index in a list of texts, else the number."""
        return self.texts[int(number)] if self.texts else number

    def quantile(self, probability: Array) -> Array:
        """Quantile function at probabilities (N,); discrete values are equally probable."""
        values = self.discrete_values
        if values:
            return np.array(values)[np.minimum((probability * len(values)).astype(int), len(values) - 1)]
        return np.asarray(_QUANTILE_FUNCTIONS[self.kind](probability, *self.numbers), dtype=float)


def _triangular_quantile(probability: Array, minimum: float, mode: float, maximum: float) -> Array:
    return np.asarray(stats.triang.ppf(probability, (mode - minimum) / (maximum - minimum), minimum, maximum - minimum))


_QUANTILE_FUNCTIONS: Mapping[str, Callable[..., Array]] = {
    NORMAL: lambda share, mean, deviation: np.asarray(stats.norm.ppf(share, mean, deviation)),
    UNIFORM: lambda share, least, largest: least + share * (largest - least),
    TRIANGULAR: _triangular_quantile,
    LOGNORMAL: lambda share, median, deviation: median * np.exp(stats.norm.ppf(share, 0.0, deviation)),
}


def parameter_problem(kind: str, numbers: Sequence[float]) -> str | None:
    """Problem that makes these parameters invalid for a distribution of this kind; None where they are valid."""
    names = PARAMETER_NAMES.get(kind)
    if names is not None and len(numbers) != len(names):
        return f"has {len(numbers)} numbers, {kind} takes {len(names)}: {', '.join(names)}"
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
