"""Sources of inputs beside a controller: loads on the platform, none, several together, and a view of all columns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..cosimulation import InputSource

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SampledLoad:
    """A load on the platform as a zero-order hold: ``loads`` (N, 3) in N or N m, each held to the next sample."""

    loads: Array

    def interval(self, index: int, time: float, step: float, outputs: Array) -> tuple[Array, Array]:
        """See :class:`tautwire.cosimulation.InputSource`."""
        input_values = np.column_stack([self.loads[index], np.zeros(3)]).ravel()
        return input_values, input_values


@dataclass(frozen=True)
class ZeroInput:
    """``count`` inputs that stay zero."""

    count: int

    def interval(self, index: int, time: float, step: float, outputs: Array) -> tuple[Array, Array]:
        """See :class:`tautwire.cosimulation.InputSource`."""
        return np.zeros(self.count), np.zeros(self.count)


@dataclass(frozen=True)
class JoinedSources:
    """Concatenates the inputs of several sources."""

    sources: tuple[InputSource, ...]

    def interval(self, index: int, time: float, step: float, outputs: Array) -> tuple[Array, Array]:
        """See :class:`tautwire.cosimulation.InputSource`."""
        pairs = [source.interval(index, time, step, outputs) for source in self.sources]
        return np.concatenate([start for start, _ in pairs]), np.concatenate([end for _, end in pairs])


@dataclass(frozen=True)
class AllColumnsSource:
    """A source that is shown all recorded columns, NaN where no FMU has the output; ``indices`` are the others'."""

    source: InputSource
    indices: tuple[int, ...]
    count: int

    def interval(self, index: int, time: float, step: float, outputs: Array) -> tuple[Array, Array]:
        """See :class:`tautwire.cosimulation.InputSource`."""
        columns = np.full(self.count, np.nan)
        columns[list(self.indices)] = outputs
        return self.source.interval(index, time, step, columns)
