"""The time loop of a co-simulation: external inputs in, observed outputs recorded at every grid time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from ..fmus.component import Component, VariableBlock
from .connections import Port
from .coupling import Coupling
from .step_size_control import StepSizeControl

Array = NDArray[np.float64]
Progress = Callable[[float], None]

# Iteration stops when the remaining error is below 6 % of the interpolation error at mid-step.
INTERPOLATION_ERROR_SHARE = 0.06


class InputSource(Protocol):
    """Source of external inputs: their values at both ends of an interval between samples."""

    def interval(self, index: int, time: float, step: float, outputs: Array) -> tuple[Array, Array]:
        """External inputs just after ``time`` and just before ``time + step``.

        ``index`` counts the intervals of the sample grid; ``outputs`` are the observed ones at its beginning. May be
        called more than once for the same interval, and with a step of zero before anything is recorded.
        """
        ...


@dataclass(frozen=True)
class PiecewiseLinearInput:
    """Piecewise linear signals between samples, as pairs (value, rate) of each.

    ``time`` has shape (N,), ``values`` (N, k); the external inputs are value_1, rate_1, value_2, rate_2 ...
    """

    time: Array
    values: Array

    def interval(self, index: int, time: float, step: float, outputs: Array) -> tuple[Array, Array]:
        """See :class:`InputSource`."""
        slope = (self.values[index + 1] - self.values[index]) / (self.time[index + 1] - self.time[index])
        start = self.values[index] + (time - self.time[index]) * slope
        return _interleave(start, slope), _interleave(start + step * slope, slope)


def _interleave(values: Array, rates: Array) -> Array:
    pairs = np.empty(2 * len(values))
    pairs[0::2] = values
    pairs[1::2] = rates
    return pairs


class Recorder(Protocol):
    """Recorder of the observed outputs, one grid time after the other."""

    def add(self, time: float, row: Array) -> None:
        """Record a row, shape (number of observed outputs,); it is overwritten afterwards."""
        ...


class MemoryRecorder:
    """Keeps all rows in memory; ``rows`` are those recorded so far, shape (N, number of observed outputs)."""

    def __init__(self, count: int, width: int) -> None:
        self._rows = np.empty((count, width))
        self.count = 0

    def add(self, time: float, row: Array) -> None:
        """See :class:`Recorder`."""
        self._rows[self.count] = row
        self.count += 1

    @property
    def rows(self) -> Array:
        """The rows recorded so far."""
        return self._rows[: self.count]


def simulate(
    coupling: Coupling,
    input_source: InputSource,
    times: Array,
    observed_outputs: Sequence[Port],
    step_size_control: StepSizeControl,
    recorder: Recorder,
    progress: Progress | None = None,
) -> None:
    """Co-simulate over the grid ``times`` and record the observed outputs there.

    Each interval of the grid is divided into macro steps of its own, so kinks of the inputs at grid times never fall
    inside a step. Components must be in initialization mode.

    Raises ComponentError where an FMU fails or has an output that is not finite; the recorder has the rows until then.
    """
    if step_size_control.coupling_tolerance is not None:
        coupling.tolerance = step_size_control.coupling_tolerance
    coupling.interpolation_error_share = INTERPOLATION_ERROR_SHARE
    observed = _ObservedOutputs(coupling, observed_outputs)
    outputs = np.zeros(len(observed_outputs))
    start, _ = input_source.interval(0, float(times[0]), 0.0, outputs)
    coupling.solve_initial_values(float(times[0]), start)
    for component in coupling.components.values():
        component.run()
    observed.read(outputs)
    recorder.add(float(times[0]), outputs)
    # The master's systems of equations are small: BLAS threads would only wait for each other.
    with _thread_pools().limit(limits=1, user_api="blas"):
        _run_loop(coupling, input_source, times, outputs, step_size_control, recorder, observed, progress)


@cache
def _thread_pools() -> ThreadpoolController:
    """Cached: finding the thread pools among all libraries takes longer than a step."""
    return ThreadpoolController()


def _run_loop(
    coupling: Coupling,
    input_source: InputSource,
    times: Array,
    outputs: Array,
    step_size_control: StepSizeControl,
    recorder: Recorder,
    observed: _ObservedOutputs,
    progress: Progress | None,
) -> None:
    for index in range(len(times) - 1):
        begin, span = float(times[index]), float(times[index + 1] - times[index])

        def external_inputs(time: float, step: float, index: int = index) -> tuple[Array, Array]:
            return input_source.interval(index, time, step, outputs)

        step_size_control.advance(coupling, begin, span, external_inputs, observed.lengths)
        observed.read(outputs)
        recorder.add(float(times[index + 1]), outputs)
        if progress is not None:
            progress((index + 1) / (len(times) - 1))


class _ObservedOutputs:
    """Reads the observed outputs, and those of them that are lengths (unit m)."""

    def __init__(self, coupling: Coupling, ports: Sequence[Port]) -> None:
        self._coupling = coupling
        self._blocks: list[tuple[Component, VariableBlock, NDArray[np.intp]]] = []
        units = [coupling.components[p.component].variables[p.variable].unit for p in ports]
        self._length_mask = np.array([unit == "m" for unit in units], dtype=bool)
        for name in dict.fromkeys(port.component for port in ports):
            indices = [i for i, port in enumerate(ports) if port.component == name]
            block = coupling.components[name].block([ports[i].variable for i in indices])
            self._blocks.append((coupling.components[name], block, np.array(indices)))

    def read(self, row: Array) -> None:
        self._coupling.update_inputs()
        for component, block, indices in self._blocks:
            component.read(block)
            if not np.all(np.isfinite(block.values)):
                component.raise_not_finite(block)
            row[indices] = block.values

    def lengths(self) -> Array:
        row = np.empty(len(self._length_mask))
        self.read(row)
        return row[self._length_mask]
