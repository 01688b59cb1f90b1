"""Finds where the passes of a step lead from how earlier passes changed what they were given."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MEMORY = 20
LENGTHS = 4
SAME_LENGTH = 0.1
LEAST_DIFFERENCE = 1e-10
LEAST_SINGULAR = 1e-9


class Secants:
    """Differences between passes of the same step: of what they were given, and of what they showed.

    With ``r = F(z) - z`` and columns ``dr``, ``dF`` of earlier passes, the next pass is given

        z' = F(z) + dF c,   c = argmin |r + dr c|

    All vectors are in units of their nominal values. Pairs are kept from step to step, since the coupling changes
    slowly; :meth:`forget` drops them where it does not.

    Source: Degroote, Bathe and Vierendeels (2009), Performance of a new partitioned procedure versus a monolithic
    procedure in fluid-structure interaction, Computers & Structures 87, 793-801.
    """

    def __init__(self) -> None:
        self._pairs: deque[tuple[Array, Array, float]] = deque(maxlen=MEMORY)
        self._last: tuple[Array, Array] | None = None

    def begin(self) -> None:
        """A new step: its first pass is no neighbour of the last step's."""
        self._last = None

    def forget(self) -> None:
        """Drop all pairs."""
        self._pairs.clear()

    def learn(self, given: Array, shown: Array) -> None:
        """One pass: it was given ``given`` and showed ``shown``."""
        if self._last is not None:
            change, response = given - self._last[0], shown - self._last[1]
            if np.max(np.abs(response - change)) > LEAST_DIFFERENCE:
                shrinks = float(np.linalg.norm(response) / np.linalg.norm(change))
                self._pairs.appendleft((response - change, response, shrinks))
        self._last = given, shown

    def contraction(self) -> float:
        """By how much a plain pass shrinks an error at most, as far as is known; one where nothing is."""
        return min(1.0, max((pair[2] for pair in self._pairs), default=1.0))

    def next(self) -> Array:
        """What to give to the next pass."""
        assert self._last is not None
        given, shown = self._last
        if not self._pairs:
            return shown
        residuals = np.column_stack([pair[0] for pair in self._pairs])
        responses = np.column_stack([pair[1] for pair in self._pairs])
        weights = np.linalg.lstsq(residuals, given - shown, rcond=LEAST_SINGULAR)[0]
        improved: Array = shown + responses @ weights
        return improved


class Lessons:
    """Secants by the length of the step, since a coupling is not the same for another; the last few lengths."""

    def __init__(self) -> None:
        self._taught: deque[tuple[float, Secants]] = deque(maxlen=LENGTHS)

    def of(self, step: float) -> Secants:
        """Those of steps of nearly the same length; empty where there were none."""
        for length, secants in self._taught:
            if abs(step - length) <= SAME_LENGTH * length:
                return secants
        self._taught.appendleft((step, Secants()))
        return self._taught[0][1]

    def forget(self) -> None:
        """Drop all."""
        self._taught.clear()
