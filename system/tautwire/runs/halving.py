"""The error of a run whose FMUs cannot redo a step: what the same run with half the steps differs by."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..master import Account, ComponentError, Coupling, FixedStep, Recorder, Stepping
from ..master.stepping import Drives, Watch

Array = NDArray[np.float64]
Run = Callable[[int, Stepping, Recorder], Account]

COMPARED = 5000
# What is left of an error of first order that halving takes half of.
FIRST_ORDER = 2.0


class Beginning:
    """A recorder that keeps the positions of the first rows, shape (N, 3), and hands every row on."""

    def __init__(self, count: int, recorder: Recorder | None = None) -> None:
        self._rows = np.empty((min(count, COMPARED), 3))
        self._recorder = recorder
        self._count = 0

    def add(self, time: float, row: Array) -> None:
        """See :class:`tautwire.master.Recorder`."""
        if self._count < len(self._rows):
            self._rows[self._count] = row[:3]
            self._count += 1
        if self._recorder is not None:
            self._recorder.add(time, row)

    @property
    def positions(self) -> Array:
        """The rows that came."""
        return self._rows[: self._count]


@dataclass(frozen=True)
class HalvedStep:
    """Half of each step that a :class:`FixedStep` of this length makes."""

    longest: float
    agreement: None = None

    def cover(self, coupling: Coupling, begin: float, span: float, drives: Drives, watch: Watch) -> None:
        """See :class:`tautwire.master.Stepping`."""
        count = max(1, math.ceil(span / self.longest * (1.0 - 1e-9)))
        FixedStep(0.5 * span / count).cover(coupling, begin, span, drives, watch)


def error_by_halving(run: Run, time: Array, step: float, first: Array) -> str:
    """What to tell of the error of positions ``first`` (N, 3), recorded at ``time`` (N or more,) in steps of ``step``.

    ``run(count, stepping, recorder)`` makes the run again, up to ``count`` of its times. The error is twice what it
    differs by, as for a method of first order; for one of second order it is a third too large.
    """
    again = Beginning(len(first))
    try:
        run(len(first), HalvedStep(step), again)
    except ComponentError as error:
        return f"the error is not known: with half the step, {error}"
    error_of_position = FIRST_ORDER * float(np.max(np.abs(first - again.positions), initial=0.0))
    part = "" if len(first) == len(time) else f" over the first {time[len(first) - 1]:g} s"
    return f"estimated error of the position{part}: {error_of_position:.2g} m, by a second run with half the step"
