"""The time loop of a co-simulation: external inputs in, observed outputs recorded at every grid time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import ThreadpoolController

from ..errors import TautwireError
from ..fmus.component import Component, VariableBlock
from ..fmus.fmu_variables import Port
from ..fmus.variable_units import definition_from_exponents, same_unit
from .connections import unit_at
from .coupling_solver import CouplingSolver
from .step_size_control import StepSizeControl

Array = NDArray[np.float64]
Progress = Callable[[float], None]

METRE = ("m", definition_from_exponents({"m": 1}))


class InputSourceError(TautwireError):
    """What computes the external inputs failed; the message says when and why."""


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


@dataclass(frozen=True)
class PiecewiseCubicInput:
    """Cubic Hermite polynomials between samples, as pairs (value, rate) of each.

    ``time`` has shape (N,), ``values`` and ``rates`` (N, k); the external inputs are value_1, rate_1, value_2 ...
    """

    time: Array
    values: Array
    rates: Array

    def interval(self, index: int, time: float, step: float, outputs: Array) -> tuple[Array, Array]:
        """See :class:`InputSource`."""
        begin, end = self._at(index, time), self._at(index, time + step)
        return _interleave(*begin), _interleave(*end)

    def _at(self, index: int, time: float) -> tuple[Array, Array]:
        length = self.time[index + 1] - self.time[index]
        s, change = (time - self.time[index]) / length, self.values[index + 1] - self.values[index]
        b, c = (length * self.rates[row] - change for row in (index, index + 1))
        value = self.values[index] + s * change + s * (1.0 - s) * ((1.0 - s) * b - s * c)
        rate = change + (1.0 - s) * (1.0 - 3.0 * s) * b - s * (2.0 - 3.0 * s) * c
        return value, rate / length


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


@dataclass(frozen=True)
class Experiment:
    """An experiment: its external inputs, the grid ``times`` (N,) of its recorded rows, and the steps between them.

    ``output_units`` are those of the observed outputs, for outputs whose FMU states none.
    """

    input_source: InputSource
    times: Array
    step_size_control: StepSizeControl
    output_units: tuple[str, ...] = ()


def simulate(
    coupling: CouplingSolver,
    experiment: Experiment,
    observed_outputs: Sequence[Port],
    recorder: Recorder,
    progress: Progress | None = None,
) -> None:
    """Co-simulate an experiment and record the observed outputs at its grid times.

    Each interval of the grid is divided into macro steps of its own, so kinks of the inputs at grid times never fall
    inside a step. Components must be in initialization mode; the coupling's options should be those of the step-size
    control, see :attr:`StepSizeControl.solver_options`.

    Raises ComponentError where an FMU fails or has an output that is not finite; the recorder has the rows until then.
    """
    observed = _ObservedOutputs(coupling, observed_outputs, experiment.output_units)
    begin = float(experiment.times[0])
    start, _ = experiment.input_source.interval(0, begin, 0.0, observed.row)
    coupling.solve_initial_values(begin, start)
    for component in coupling.graph.components.values():
        component.run()
    observed.read(observed.row)
    recorder.add(begin, observed.row)
    # The master's systems of equations are small: BLAS threads would only wait for each other.
    with _thread_pools().limit(limits=1, user_api="blas"):
        _run_loop(coupling, experiment, observed, recorder, progress)


@cache
def _thread_pools() -> ThreadpoolController:
    """Cached: finding the thread pools among all libraries takes longer than a step."""
    return ThreadpoolController()


def _run_loop(
    coupling: CouplingSolver,
    experiment: Experiment,
    observed: _ObservedOutputs,
    recorder: Recorder,
    progress: Progress | None,
) -> None:
    times, row = experiment.times, observed.row
    for index in range(len(times) - 1):
        begin, span = float(times[index]), float(times[index + 1] - times[index])

        def external_inputs(time: float, step: float, index: int = index) -> tuple[Array, Array]:
            return experiment.input_source.interval(index, time, step, row)

        experiment.step_size_control.advance(coupling, begin, span, external_inputs, observed.lengths)
        observed.read(row)
        recorder.add(float(times[index + 1]), row)
        if progress is not None:
            progress((index + 1) / (len(times) - 1))


class _ObservedOutputs:
    """Reads the observed outputs, and those of them that are lengths, in metres; ``row`` is that of the last time."""

    def __init__(self, coupling: CouplingSolver, ports: Sequence[Port], assumed_units: Sequence[str]) -> None:
        self._coupling = coupling
        self._blocks: list[tuple[Component, VariableBlock, NDArray[np.intp]]] = []
        components = coupling.graph.components
        self.row = np.zeros(len(ports))
        units = [unit_at(components, port) for port in ports]
        is_length = [
            same_unit(unit, METRE) if unit[0] is not None else assumed == METRE[0]
            for unit, assumed in zip(units, assumed_units or [""] * len(ports), strict=True)
        ]
        self._length_mask = np.array(is_length, dtype=bool)
        for name in dict.fromkeys(port.component for port in ports):
            indices = [i for i, port in enumerate(ports) if port.component == name]
            block = components[name].block([ports[i].variable for i in indices])
            self._blocks.append((components[name], block, np.array(indices)))

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
