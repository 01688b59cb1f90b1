"""Step-size control: macro steps bounded by a length, or chosen by an error estimate."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import TautwireError
from .coupling_solver import DEFAULT_OPTIONS, CouplingSolver, SolverOptions
from .macro_step import EVENT_WIDTH, ExternalInputs, step_with_events

Array = NDArray[np.float64]
ReadLengths = Callable[[], Array]

SAFETY_FACTOR = 0.9
# Local errors may grow as they propagate, so they get less than a third of the global error tolerance.
LOCAL_ERROR_SHARE = 0.3
MIN_STEP_SHARE = 1e-6
MIN_STEP_GROWTH, MAX_STEP_FACTOR, MIN_STEP_FACTOR = 1.3, 4.0, 0.1
MIN_COUPLING_TOLERANCE, MAX_COUPLING_TOLERANCE = 1e-12, 1e-7


class StepSizeError(TautwireError):
    """The error tolerance requires a step below the smallest one; carries time (s), step (s) and the estimate (m)."""

    def __init__(self, time: float, step: float, error: float) -> None:
        self.time = time
        self.step = step
        self.error = error
        super().__init__(
            f"at {time:.6g} s even a step of {step:.3g} s has an error of {error:.3g} m: give a larger --tolerance"
        )


class StepSizeControl(Protocol):
    """Step-size control over an interval; ``external_inputs(time, step)`` returns the inputs at both ends.

    ``solver_options`` are those of a solver that fits the steps.
    """

    @property
    def solver_options(self) -> SolverOptions:
        """See :class:`SolverOptions`."""
        ...

    def advance(
        self,
        coupling: CouplingSolver,
        begin: float,
        span: float,
        external_inputs: ExternalInputs,
        read_lengths: ReadLengths,
    ) -> None:
        """Advance the coupling by ``span`` (s); ``read_lengths()`` reads the outputs whose error counts."""
        ...


@dataclass(frozen=True)
class FixedStep:
    """Equal macro steps no longer than ``max_step`` (s); each may still be split at events, or rejected and halved.

    A ``subdivision`` makes so many steps of each of them, which step doubling compares.
    """

    max_step: float
    subdivision: int = 1

    @property
    def solver_options(self) -> SolverOptions:
        """See :class:`StepSizeControl`."""
        return DEFAULT_OPTIONS

    def advance(
        self,
        coupling: CouplingSolver,
        begin: float,
        span: float,
        external_inputs: ExternalInputs,
        read_lengths: ReadLengths,
    ) -> None:
        """See :class:`StepSizeControl`."""
        count = self.subdivision * max(1, math.ceil(span / self.max_step * (1.0 - 1e-9)))
        for k in range(count):
            time = begin + k * span / count
            step_with_events(coupling, time, span / count, external_inputs)


@dataclass
class AdaptiveStep:
    """Adaptive macro steps for a global error tolerance ``tolerance`` (m) over a run of ``duration`` (s).

    The local error tolerance of a step is ``LOCAL_ERROR_SHARE * tolerance * step / duration``, so that local errors
    sum to at most 0.3 times ``tolerance``; its substeps are rejected as those of fixed steps are. Step doubling: each
    step is made whole and, after a rollback, in two halves, which are accepted; for order p their error is the
    difference over ``2^p - 1``.
    """

    tolerance: float
    duration: float
    next_step: float = 0.02

    @property
    def solver_options(self) -> SolverOptions:
        """A convergence tolerance of a tenth of the global error tolerance, as if nominal values were metres."""
        return SolverOptions(min(max(0.1 * self.tolerance, MIN_COUPLING_TOLERANCE), MAX_COUPLING_TOLERANCE))

    def advance(
        self,
        coupling: CouplingSolver,
        begin: float,
        span: float,
        external_inputs: ExternalInputs,
        read_lengths: ReadLengths,
    ) -> None:
        """See :class:`StepSizeControl`; raises StepSizeError where no step is small enough."""
        elapsed = 0.0
        while elapsed < span * (1.0 - 1e-12):
            remaining = span - elapsed
            step = remaining / math.ceil(remaining / self.next_step * (1.0 - 1e-3))
            elapsed += self._try_step(coupling, begin + elapsed, step, external_inputs, read_lengths)

    def _try_step(
        self,
        coupling: CouplingSolver,
        time: float,
        step: float,
        external_inputs: ExternalInputs,
        read_lengths: ReadLengths,
    ) -> float:
        """Try one step, or its part before an event; returns its length, zero if the error was too large."""
        checkpoint = coupling.save()
        try:
            first_substep = step_with_events(coupling, time, step, external_inputs)
            if first_substep < step:
                # After an event the whole step would take the same substeps as its halves, and show no error.
                coupling.restore(checkpoint)
                step_with_events(coupling, time, first_substep, external_inputs)
                if first_substep <= 2.0 * EVENT_WIDTH:
                    return first_substep
            shortened, step = first_substep < step, first_substep
            whole_step_lengths = read_lengths()
            coupling.restore(checkpoint)
            half = 0.5 * step
            step_with_events(coupling, time, half, external_inputs)
            step_with_events(coupling, time + half, half, external_inputs)
            order = coupling.graph.convergence_order
            error = float(np.max(np.abs(read_lengths() - whole_step_lengths), initial=0.0)) / (2**order - 1)
            allowed_error = LOCAL_ERROR_SHARE * self.tolerance * step / self.duration
            factor = SAFETY_FACTOR * (allowed_error / max(error, 1e-300)) ** (1.0 / order)
            # The quasi-Newton history serves steps of the same size only, so small changes do not pay.
            if not (1.0 <= factor < MIN_STEP_GROWTH or (shortened and factor > 1.0)):
                self.next_step = step * min(max(factor, MIN_STEP_FACTOR), MAX_STEP_FACTOR)
            if error <= allowed_error:
                coupling.record_estimated_error(error)
                return step
            if self.next_step < MIN_STEP_SHARE * self.duration:
                raise StepSizeError(time, step, error)
            coupling.restore(checkpoint)
            return 0.0
        finally:
            coupling.release(checkpoint)
