"""Finds where the passes of a step lead from how earlier passes changed what they were given."""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LENGTHS = 4
SAME_LENGTH = 0.1
LEAST_DIFFERENCE = 1e-12
LEAST_NEW = 1e-3
# Of the share that a redo has once left over, how much is still held against the next step's.
REMEMBERED = 0.8


class Secants:
    """How passes answer to what they are given, learnt from what the passes of a step differ by.

    A pass that is given ``z`` shows ``F(z)``; with its residual ``r = F(z) - z`` the next one is given

        z' = F(z) - A r,   A dr = dF for any two passes of a step

    ``A`` is kept from step to step, since the coupling changes slowly, and changes as little as the newest passes ask
    for; :meth:`forget` drops it where the coupling jumps. All vectors are in units of their nominal values.

    Source: Bogaers, Kok, Reddy and Franz (2014), Quasi-Newton methods for implicit black-box FSI coupling, Computer
    Methods in Applied Mechanics and Engineering 279, 113-132.
    """

    def __init__(self, count: int) -> None:
        self._answers = np.zeros((count, count))
        self._directions: list[Array] = []
        self._last: tuple[Array, Array, float] | None = None
        self._correction = np.zeros(count)
        self._left = 1.0

    def begin(self) -> None:
        """A new step: its first pass is no neighbour of the last step's."""
        self._last = None
        self._directions = []

    def forget(self) -> None:
        """Drop all that was learnt."""
        self._answers.fill(0.0)
        self._directions = []
        self._left = 1.0

    def learn(self, given: Array, shown: Array) -> None:
        """One pass: it was given ``given`` and showed ``shown``."""
        residual = shown - given
        size = float(np.abs(residual).max(initial=0.0))
        if self._last is not None:
            earlier, shown_earlier, size_earlier = self._last
            if size > size_earlier:
                self.forget()
            if size_earlier > LEAST_DIFFERENCE:
                self._left = min(1.0, max(size / size_earlier, REMEMBERED * self._left))
            self._take(residual - earlier, shown - shown_earlier)
        self._last = residual, shown, size
        self._correction = self._answers @ residual

    def _take(self, change: Array, answer: Array) -> None:
        """Answer so to this change of the residual, as before to those across it and across this step's others."""
        new = change.copy()
        for direction in self._directions:
            new -= (direction @ new) * direction
        length = float(np.sqrt(new @ new))
        if length > max(LEAST_DIFFERENCE, LEAST_NEW * float(np.sqrt(change @ change))):
            new /= length
            self._answers += np.outer((answer - self._answers @ change) / (new @ change), new)
            self._directions.append(new)

    def error(self) -> float:
        """By how much the outputs of the last pass still err: what the next would change, and what that would miss."""
        assert self._last is not None
        return float(np.abs(self._correction).max(initial=0.0)) + self._left * self._last[2]

    def next(self) -> Array:
        """What to give to the next pass."""
        assert self._last is not None
        improved: Array = self._last[1] - self._correction
        return improved


class Lessons:
    """Secants by the length of the step, since a coupling is not the same for another; the last few lengths."""

    def __init__(self, count: int) -> None:
        self._count = count
        self._taught: deque[tuple[float, Secants]] = deque(maxlen=LENGTHS)

    def of(self, step: float) -> Secants:
        """Those of steps of nearly the same length; empty where there were none."""
        for length, secants in self._taught:
            if abs(step - length) <= SAME_LENGTH * length:
                return secants
        self._taught.appendleft((step, Secants(self._count)))
        return self._taught[0][1]

    def forget(self) -> None:
        """Drop all."""
        self._taught.clear()
