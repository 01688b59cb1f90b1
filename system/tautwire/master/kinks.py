"""Cuts a macro step where an output changes its sign at which others have a kink, such as a cable going slack.

Between kinks outputs are smooth and a step has its full order. A step over a kink has only the second, whatever is
iterated: the polynomial through value and rate at both ends cannot bend.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from .coupling import Coupling
from .halving import Drives, step_held

Array = NDArray[np.float64]

# A kink nearer than this is stepped over; the error is of second order in it.
WIDTH = 1e-6
NEAREST = 0.2 * WIDTH
MOST_PIECES = 40
# Of what is left of a step: no piece leaves less.
LEAST_REST = 1e-6
LANDING = 1e-3


def step_over(coupling: Coupling, time: float, step: float, drives: Drives) -> float:
    """One macro step from ``time``, where states can be restored in pieces: cut at kinks, and where redos are lost.

    ``drives(time, step)`` gives the driven inputs at both ends. A sign that changes twice within a step is not seen.
    Returns the length of the first piece: ``step`` where it was made whole.
    """
    if not (coupling.can_redo and coupling.can_cut):
        coupling.step(time, step, *drives(time, step))
        return step
    done, first, reach = 0.0, step, step
    for _ in range(MOST_PIECES):
        rest = step - done
        piece = rest if reach > (1.0 - LEAST_REST) * rest else reach
        made, lost = _step_to_kink(coupling, time + done, piece, drives)
        first = first if done else made
        if made == rest:
            return first
        done += made
        reach = made if lost else 2.0 * reach
    coupling.step(time + done, step - done, *drives(time + done, step - done))
    return first


def _step_to_kink(coupling: Coupling, time: float, step: float, drives: Drives) -> tuple[float, bool]:
    """Step up to the first kink, or over it where it is near; returns how far, and whether a longer step was lost."""
    signs = np.sign(coupling.kinks())
    reached, before = step_held(coupling, time, step, drives)
    lost, step = reached < step, reached
    try:
        end = coupling.kinks()
        changed = np.flatnonzero(np.sign(end) != signs)
        if not len(changed) or step <= 2.0 * WIDTH:
            return step, lost

        def at(span: float) -> Array:
            coupling.restore(before)
            coupling.step(time, span, *drives(time, span))
            return coupling.kinks()

        before_kink = _landing(at, step, signs, end, changed)
        if before_kink > WIDTH:
            return before_kink, lost
        at(2.0 * WIDTH)
        coupling.forget(time + 2.0 * WIDTH)
        return 2.0 * WIDTH, lost
    finally:
        coupling.release(before)


def _landing(at: Callable[[float], Array], step: float, signs: Array, end: Array, changed: NDArray[np.intp]) -> float:
    """The end of a step that comes just before the first kink, and makes it; zero where that is less than ``WIDTH``.

    Near a kink two solutions of a step can agree with themselves, one bent, one not; hence the way back from the root.
    """
    begin = at(WIDTH)
    if np.any(np.sign(begin) != signs):
        return 0.0
    reached, back = step, 0.0
    while True:
        near = max(LANDING * reached, NEAREST)
        if reached - WIDTH <= near:
            at(WIDTH)
            return 0.0
        known = {WIDTH: begin, reached: end}
        root = min(_root(at, known, int(place), near) for place in changed)
        # Never less far back than half of what is left, so that this comes to an end.
        back = max(near, 4.0 * back)
        reached = max(root - back, 0.5 * (WIDTH + root))
        end = at(reached)
        changed = np.flatnonzero(np.sign(end) != signs)
        if not len(changed):
            return reached


def _root(at: Callable[[float], Array], known: Mapping[float, Array], place: int, near: float) -> float:
    """Where the output at ``place`` changes its sign between two spans at which it is known already."""

    def shown(span: float) -> float:
        return float((known[span] if span in known else at(span))[place])

    return float(brentq(shown, min(known), max(known), xtol=near))
