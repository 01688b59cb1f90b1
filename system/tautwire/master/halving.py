"""Halves a macro step in which redos lead nowhere, or at which an FMU gives up, until they lead somewhere.

Too long for what couples its components, a step has no solution that redos could find, and what they end with is
arbitrary. The standard lets an FMU that discards a step go back to a saved state and try a shorter one.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .checkpoint import Checkpoint
from .component import ComponentError
from .coupling import Coupling

Array = NDArray[np.float64]
Drives = Callable[[float, float], tuple[Array, Array]]

MOST_HALVINGS = 4


def step_held(coupling: Coupling, time: float, step: float, drives: Drives) -> tuple[float, Checkpoint]:
    """A step from ``time``, or its first half, quarter and so on, that is not lost; returns how far, and from where.

    ``drives(time, step)`` gives the driven inputs at both ends. States have to be restorable; the one returned is to
    be let go. The shortest step is kept even if it is lost.

    Raises ComponentError where an FMU fails even in the shortest: the first, of the whole step.
    """
    failed: ComponentError | None = None
    for _ in range(MOST_HALVINGS):
        try:
            before = _attempt(coupling, time, step, drives)
        except ComponentError as error:
            if not error.can_restore:
                raise
            failed = failed or error
        else:
            if not coupling.lost:
                return step, before
            coupling.restore(before)
            coupling.release(before)
        step *= 0.5
    try:
        return step, _attempt(coupling, time, step, drives)
    except ComponentError as error:
        raise failed or error from error


def _attempt(coupling: Coupling, time: float, step: float, drives: Drives) -> Checkpoint:
    before = coupling.attempt(time, step, *drives(time, step))
    assert before is not None
    return before
