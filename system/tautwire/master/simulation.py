"""The time loop: drives a wired system from one time to the next and records what was asked for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from .component import Block, Component
from .coupling import Coupling
from .stepping import Stepping
from .wiring import Port

Array = NDArray[np.float64]
Progress = Callable[[float], None]

# Of what the polynomials of a step miss: redos that would find less than this add nothing.
SHARE = 0.06


class Source(Protocol):
    """What drives a system: values of the driven inputs at both ends of an interval between samples."""

    def interval(self, index: int, time: float, step: float, shown: Array) -> tuple[Array, Array]:
        """Driven inputs just after ``time`` and just before ``time + step``.

        ``index`` counts the intervals of the sample grid; ``shown`` holds the recorded outputs at its begin. May be
        asked more than once for the same interval, and with a step of zero before anything is recorded.
        """
        ...


@dataclass(frozen=True)
class Sampled:
    """Signals that are linear between samples; drives pairs (value, rate) of each.

    ``time`` has shape (N,), ``values`` (N, k); the driven inputs are value_1, rate_1, value_2, rate_2 ...
    """

    time: Array
    values: Array

    def interval(self, index: int, time: float, step: float, shown: Array) -> tuple[Array, Array]:
        """See :class:`Source`."""
        slope = (self.values[index + 1] - self.values[index]) / (self.time[index + 1] - self.time[index])
        start = self.values[index] + (time - self.time[index]) * slope
        return _paired(start, slope), _paired(start + step * slope, slope)


def _paired(values: Array, rates: Array) -> Array:
    pairs = np.empty(2 * len(values))
    pairs[0::2] = values
    pairs[1::2] = rates
    return pairs


class Recorder(Protocol):
    """Takes the observed outputs of one grid time after the other."""

    def add(self, time: float, row: Array) -> None:
        """Keep a row, shape (number of observed outputs,); it is overwritten afterwards."""
        ...


class Kept:
    """Keeps all rows in memory; ``rows`` holds those that came, shape (N, number of observed outputs)."""

    def __init__(self, count: int, width: int) -> None:
        self._rows = np.empty((count, width))
        self.count = 0

    def add(self, time: float, row: Array) -> None:
        """See :class:`Recorder`."""
        self._rows[self.count] = row
        self.count += 1

    @property
    def rows(self) -> Array:
        """The rows that came."""
        return self._rows[: self.count]


def simulate(
    coupling: Coupling,
    source: Source,
    times: Array,
    observed: Sequence[Port],
    stepping: Stepping,
    recorder: Recorder,
    progress: Progress | None = None,
) -> None:
    """Co-simulate over the grid ``times`` and record the observed outputs there.

    Each interval of the grid is cut into macro steps of its own, so kinks of the source at grid times never fall
    inside a step. Components must be in initialization mode.

    Raises ComponentError where an FMU fails or shows a value that is not finite; the recorder has what came before.
    """
    if stepping.agreement is not None:
        coupling.tolerance = stepping.agreement
    coupling.share = SHARE
    window = _Window(coupling, observed)
    shown = np.zeros(len(observed))
    start, _ = source.interval(0, float(times[0]), 0.0, shown)
    coupling.settle(float(times[0]), start)
    for component in coupling.components.values():
        component.run()
    window.read(shown)
    recorder.add(float(times[0]), shown)
    # The master's own systems of equations are small: threads of BLAS only wait for each other.
    with _thread_pools().limit(limits=1, user_api="blas"):
        _march(coupling, source, times, shown, stepping, recorder, window, progress)


@cache
def _thread_pools() -> ThreadpoolController:
    """To look for them among all libraries takes longer than many a step."""
    return ThreadpoolController()


def _march(
    coupling: Coupling,
    source: Source,
    times: Array,
    shown: Array,
    stepping: Stepping,
    recorder: Recorder,
    window: _Window,
    progress: Progress | None,
) -> None:
    for index in range(len(times) - 1):
        begin, span = float(times[index]), float(times[index + 1] - times[index])

        def drives(time: float, step: float, index: int = index) -> tuple[Array, Array]:
            return source.interval(index, time, step, shown)

        stepping.cover(coupling, begin, span, drives, window.lengths)
        window.read(shown)
        recorder.add(float(times[index + 1]), shown)
        if progress is not None:
            progress((index + 1) / (len(times) - 1))


class _Window:
    """Reads the observed outputs, and those of them that are lengths."""

    def __init__(self, coupling: Coupling, observed: Sequence[Port]) -> None:
        self._coupling = coupling
        self._blocks: list[tuple[Component, Block, NDArray[np.intp]]] = []
        units = [coupling.components[p.component].variables[p.variable].unit for p in observed]
        self._lengths = np.array([unit == "m" for unit in units], dtype=bool)
        for name in dict.fromkeys(port.component for port in observed):
            places = [i for i, port in enumerate(observed) if port.component == name]
            block = coupling.components[name].block([observed[i].variable for i in places])
            self._blocks.append((coupling.components[name], block, np.array(places)))

    def read(self, row: Array) -> None:
        self._coupling.pass_on_guessed()
        for component, block, places in self._blocks:
            component.read(block)
            if not np.all(np.isfinite(block.values)):
                component.refuse(block)
            row[places] = block.values

    def lengths(self) -> Array:
        row = np.empty(len(self._lengths))
        self.read(row)
        return row[self._lengths]
