"""How an interval between two grid times is cut into macro steps: by a bound, or by a tolerance."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import TautwireError
from .coupling import Coupling
from .halving import Drives
from .kinks import WIDTH, step_over

Array = NDArray[np.float64]
Watch = Callable[[], Array]

SAFETY = 0.9
# Errors of steps may grow as they travel on; a third of the tolerance is theirs.
SHARE = 0.3
SMALLEST_SHARE = 1e-6
LEAST_GROWTH, LARGEST_GROWTH, LARGEST_CUT = 1.3, 4.0, 0.1
FINEST_AGREEMENT, COARSEST_AGREEMENT = 1e-12, 1e-7


class StepError(TautwireError):
    """The tolerance asks for steps too small to go on; carries time (s), step (s) and the error estimated (m)."""

    def __init__(self, time: float, step: float, error: float) -> None:
        self.time = time
        self.step = step
        self.error = error
        super().__init__(
            f"at {time:.6g} s a step of {step:.3g} s still errs by {error:.3g} m: give a larger --tolerance"
        )


class Stepping(Protocol):
    """Goes from ``begin`` over ``span`` seconds; ``drives(time, step)`` gives the driven inputs at both ends.

    ``agreement`` is the tolerance of the coupling that the steps deserve; None leaves it as it is.
    """

    @property
    def agreement(self) -> float | None:
        """See :class:`Coupling`, ``tolerance``."""
        ...

    def cover(self, coupling: Coupling, begin: float, span: float, drives: Drives, watch: Watch) -> None:
        """Advance the coupling; ``watch()`` reads the outputs whose error counts."""
        ...


@dataclass(frozen=True)
class FixedStep:
    """Equal macro steps no longer than ``longest`` (s)."""

    longest: float

    @property
    def agreement(self) -> None:
        """See :class:`Stepping`."""

    def cover(self, coupling: Coupling, begin: float, span: float, drives: Drives, watch: Watch) -> None:
        """See :class:`Stepping`."""
        count = max(1, math.ceil(span / self.longest * (1.0 - 1e-9)))
        for k in range(count):
            time = begin + k * span / count
            step_over(coupling, time, span / count, drives)


@dataclass
class AdaptiveStep:
    """Macro steps such that the errors of all steps of a run of ``duration`` (s) sum to at most ``tolerance`` (m).

    Each step is made whole and, from the saved states, in two halves, which are kept; for order p their error is the
    difference over ``2^p - 1``.
    """

    tolerance: float
    duration: float
    next: float = 0.02

    @property
    def agreement(self) -> float:
        """A tenth of the tolerance, of outputs whose nominal values are taken for metres."""
        return min(max(0.1 * self.tolerance, FINEST_AGREEMENT), COARSEST_AGREEMENT)

    def cover(self, coupling: Coupling, begin: float, span: float, drives: Drives, watch: Watch) -> None:
        """See :class:`Stepping`; raises StepError where no step is small enough."""
        done = 0.0
        while done < span * (1.0 - 1e-12):
            rest = span - done
            step = rest / math.ceil(rest / self.next * (1.0 - 1e-3))
            done += self._try(coupling, begin + done, step, drives, watch)

    def _try(self, coupling: Coupling, time: float, step: float, drives: Drives, watch: Watch) -> float:
        """Make one step, or the part of it before a kink; returns how far, zero if the error was too large."""
        before = coupling.save()
        try:
            first = step_over(coupling, time, step, drives)
            if first < step:
                # After a kink the whole step would go on as its halves do, and show no error.
                coupling.restore(before)
                step_over(coupling, time, first, drives)
                if first <= 2.0 * WIDTH:
                    return first
            cut, step = first < step, first
            whole = watch()
            coupling.restore(before)
            half = 0.5 * step
            step_over(coupling, time, half, drives)
            step_over(coupling, time + half, half, drives)
            error = float(np.max(np.abs(watch() - whole), initial=0.0)) / (2**coupling.order - 1)
            allowed = SHARE * self.tolerance * step / self.duration
            factor = SAFETY * (allowed / max(error, 1e-300)) ** (1.0 / coupling.order)
            # What redos have learnt serves steps of the same length only.
            if not (1.0 <= factor < LEAST_GROWTH or (cut and factor > 1.0)):
                self.next = step * min(max(factor, LARGEST_CUT), LARGEST_GROWTH)
            if error <= allowed:
                coupling.account.error = (coupling.account.error or 0.0) + error
                return step
            if self.next < SMALLEST_SHARE * self.duration:
                raise StepError(time, step, error)
            coupling.restore(before)
            return 0.0
        finally:
            coupling.release(before)
