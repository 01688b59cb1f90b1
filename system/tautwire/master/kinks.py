"""Cuts a macro step where an output changes its sign at which others have a kink, such as a cable going slack.

Between kinks outputs are smooth and a step has its full order. A step over a kink has only the second, whatever is
iterated: the polynomial through value and rate at both ends cannot bend.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from .coupling import Coupling

Array = NDArray[np.float64]
Drives = Callable[[float, float], tuple[Array, Array]]

# A kink nearer than this is stepped over; the error is of second order in it.
WIDTH = 1e-6
NEAREST = 0.2 * WIDTH
MOST_CUTS = 20
LANDING = 1e-3


def step_over(coupling: Coupling, time: float, step: float, drives: Drives) -> float:
    """One macro step from ``time``, cut at the kinks inside it where states can be restored.

    ``drives(time, step)`` gives the driven inputs at both ends. A sign that changes twice within a step is not seen.
    Returns the length of the first piece: ``step`` where there was no kink.
    """
    done, first = 0.0, step
    if coupling.can_cut and coupling.kinks().size:
        for _ in range(MOST_CUTS):
            cut = _step_to_kink(coupling, time + done, step - done, drives)
            if cut is None:
                return first
            first = first if done else cut
            done += cut
    coupling.step(time + done, step - done, *drives(time + done, step - done))
    return first


def _step_to_kink(coupling: Coupling, time: float, step: float, drives: Drives) -> float | None:
    """Step up to the first kink, or over it where it is near; returns how far, None where the whole step is made."""
    signs = np.sign(coupling.kinks())
    before = coupling.attempt(time, step, *drives(time, step))
    if before is None:
        return None
    try:
        end = coupling.kinks()
        changed = np.flatnonzero(np.sign(end) != signs)
        if not len(changed) or step <= 2.0 * WIDTH:
            return None

        def at(span: float) -> Array:
            coupling.restore(before)
            coupling.step(time, span, *drives(time, span))
            return coupling.kinks()

        before_kink = _landing(at, step, signs, end, changed)
        if before_kink > WIDTH:
            return before_kink
        at(2.0 * WIDTH)
        coupling.forget(time + 2.0 * WIDTH)
        return 2.0 * WIDTH
    finally:
        coupling.release(before)


def _landing(at: Callable[[float], Array], step: float, signs: Array, end: Array, changed: NDArray[np.intp]) -> float:
    """The end of a step that comes just before the first kink, and makes it; zero where that is less than ``WIDTH``.

    Near a kink two solutions of a step can agree with themselves, one bent, one not; hence the way back from the root.
    """
    if np.any(np.sign(at(WIDTH)) != signs):
        return 0.0
    near = max(LANDING * step, NEAREST)

    def shown(span: float, place: int) -> float:
        return float((end if span == step else at(span))[place])

    while True:
        root = min(float(brentq(shown, WIDTH, step, args=(int(place),), xtol=near)) for place in changed)
        back = near
        while root - back > WIDTH:
            if np.all(np.sign(at(root - back)) == signs):
                return float(root - back)
            back *= 4.0
        if near <= NEAREST:
            at(WIDTH)
            return 0.0
        # The kink is not much farther than its place is uncertain: look closer.
        near = max(LANDING * root, NEAREST)
