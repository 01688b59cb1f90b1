"""Step doubling: the error of a run without rollback, from a second run with half the step."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..master import ComponentError, Coupling, FixedStep, Recorder, RunStatistics, StepSizeControl
from ..master.stepping import ExternalInputs, ReadLengths

Array = NDArray[np.float64]
Run = Callable[[int, StepSizeControl, Recorder], RunStatistics]

MAX_COMPARED_ROWS = 5000
# Error of the first run over its difference to the second, for a method of first order.
FIRST_ORDER_FACTOR = 2.0


class FirstPositionsRecorder:
    """A recorder that keeps the positions of the first rows, shape (N, 3), and passes every row on."""

    def __init__(self, count: int, recorder: Recorder | None = None) -> None:
        self._rows = np.empty((min(count, MAX_COMPARED_ROWS), 3))
        self._recorder = recorder
        self._count = 0

    def add(self, time: float, row: Array) -> None:
        """See :class:`tautwire.cosimulation.Recorder`."""
        if self._count < len(self._rows):
            self._rows[self._count] = row[:3]
            self._count += 1
        if self._recorder is not None:
            self._recorder.add(time, row)

    @property
    def positions(self) -> Array:
        """The positions recorded so far."""
        return self._rows[: self._count]


@dataclass(frozen=True)
class HalvedStep:
    """Half of each step that a :class:`FixedStep` of this length makes."""

    max_step: float
    coupling_tolerance: None = None

    def advance(
        self, coupling: Coupling, begin: float, span: float, external_inputs: ExternalInputs, read_lengths: ReadLengths
    ) -> None:
        """See :class:`tautwire.cosimulation.StepSizeControl`."""
        count = max(1, math.ceil(span / self.max_step * (1.0 - 1e-9)))
        FixedStep(0.5 * span / count).advance(coupling, begin, span, external_inputs, read_lengths)


def step_doubling_note(run: Run, time: Array, step: float, positions: Array) -> str:
    """A note on the error of ``positions`` (N, 3), recorded at ``time`` (N or more,) in steps of ``step``.

    ``run(count, step_size_control, recorder)`` repeats the run, up to ``count`` of its times. The error is twice the
    difference of the two, as for a method of first order; for second order it is half too large.
    """
    recorder = FirstPositionsRecorder(len(positions))
    try:
        run(len(positions), HalvedStep(step), recorder)
    except ComponentError as error:
        return f"the error is not known: with half the step, {error}"
    position_error = FIRST_ORDER_FACTOR * float(np.max(np.abs(positions - recorder.positions), initial=0.0))
    period = "" if len(positions) == len(time) else f" over the first {time[len(positions) - 1]:g} s"
    return f"estimated error of the position{period}: {position_error:.2g} m, by a second run with half the step"
