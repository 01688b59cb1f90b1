"""Predicts what outputs will be at the end of a step and in its middle, from their past.

An output runs on the polynomial through its values, and those of its rates, at the last communication points. From how
many of these it is best predicted shows at the end of the step. What the longest polynomial missed by swings as the
system does, so its next miss is expected to go on like the last ones:

    e_n = c_1 e_(n-1) + c_2 e_(n-2),   c by least squares over the last steps, the same for all outputs

Source of the latter: Makhoul (1975), Linear prediction: a tutorial review, Proceedings of the IEEE 63(4), 561-580.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .hermite import Chain, Places, scaled, shares

Array = NDArray[np.float64]
Past = tuple[tuple[float, Array], ...]

POINTS, PAST = 3, 4
LEAST_MISSES, MOST_MISSES = 3, 8
DAMPED, LEAST_SQUARE = 1e-10, 1e-100
# So many times worse than a step before, and even the best prediction has met a corner.
CORNER, NEGLIGIBLE = 10.0, 1e-9
# So many times farther than points lie apart, a polynomial through them tells no more than their errors.
FARTHEST = 5.0
KEPT_WEIGHTS = 64


class Memory(NamedTuple):
    """What predictions are made from: the ``past``, oldest first, and the ``misses`` of the longest polynomial.

    Misses have a row for each of the last steps, the newest first; None right behind a corner. Of the past, ``smooth``
    points lie behind no corner. ``choice`` did best in the last step, and missed by ``miss``.
    """

    past: Past
    smooth: int = 1
    choice: int = 0
    miss: float = np.inf
    misses: Array | None = None


class Prediction:
    """Predicts those of the outputs shown that are at ``places``; ``nominal`` (number of places,) are their units.

    ``chains`` tell which outputs are rates of which. ``memory`` may be put back to what it was at an earlier time.
    """

    def __init__(self, chains: Sequence[Chain], places: Places, nominal: Array) -> None:
        lengths = sorted({len(chain.ends) for chain in chains})
        self._groups = [[chain for chain in chains if len(chain.ends) == length] for length in lengths]
        self._ends = [np.array([chain.ends for chain in group]).T for group in self._groups]
        found = [place for group in self._groups for place in _targets(group)]
        self._order = np.array([found.index(place) for place in places], dtype=np.intp)
        self._places = places
        self._nominal = nominal
        self._weights: dict[tuple[float, ...], list[Array]] = {}
        self._found: Array = np.zeros((1, len(places)))
        self.memory = Memory(())

    def forget(self, time: float, shown: Array) -> None:
        """Begin anew at ``time``."""
        self.memory = Memory(((time, shown.copy()),))

    def begin(self, time: float, shown: Array) -> None:
        """A step that ends at ``time``: set ``shown`` to what is expected of it."""
        if not len(self._places):
            return
        memory = self.memory = _within_reach(self.memory, time)
        points = memory.past[-min(memory.smooth, POINTS) :]
        values = np.array([value for _, value in points])
        weights = self._weights_for([at for at, _ in points], time)
        parts = [
            (weight @ values.take(ends, axis=1).reshape(-1, ends.shape[1])).reshape(len(points), -1)
            for ends, weight in zip(self._ends, weights, strict=True)
        ]
        self._found = np.concatenate(parts, axis=1).take(self._order, axis=1)
        if memory.misses is not None and len(memory.misses) >= LEAST_MISSES:
            swung = self._found[-1] + _next_miss(memory.misses) * self._nominal
            self._found = np.concatenate([self._found, swung[None, :]])
        shown[self._places] = self._found[min(memory.choice, len(self._found) - 1)]

    def end(self, time: float, shown: Array) -> None:
        """Learn from what is shown at ``time``, the end of the step."""
        memory = self.memory
        past = (*memory.past[1 - PAST :], (time, shown.copy()))
        if not len(self._places):
            self.memory = memory._replace(past=past)
            return
        misses = (shown[self._places] - self._found) / self._nominal
        sizes = np.abs(misses).max(axis=1)
        choice, miss = int(sizes.argmin()), float(sizes.min())
        points = min(memory.smooth, POINTS)
        if miss > CORNER * max(memory.miss, NEGLIGIBLE):
            # Begin and end of this step lie on the same side of the corner.
            self.memory = Memory(past, smooth=2, choice=1, miss=miss)
        elif points < POINTS:
            # There is one point more from now on, which is tried where all points were of use.
            self.memory = Memory(past, points + 1, choice + (choice == points - 1), miss)
        else:
            newest = misses[POINTS - 1 : POINTS]
            before = memory.misses
            kept = newest if before is None else np.concatenate([newest, before[: MOST_MISSES - 1]])
            self.memory = Memory(past, points, choice, miss, kept)

    def _weights_for(self, times: Sequence[float], end: float) -> list[Array]:
        """Of the past in what all polynomials say of a step's middle and end; for chains of each length."""
        step = end - times[-1]
        # Equal steps differ by what their times are rounded by.
        key = (round(step, 12), *(round((time - times[-1]) / step, 9) for time in times))
        if key not in self._weights:
            if len(self._weights) >= KEPT_WEIGHTS:
                self._weights.clear()
            self._weights[key] = [_all_weights(key[1:], ends.shape[0], step) for ends in self._ends]
        return self._weights[key]


def _within_reach(memory: Memory, time: float) -> Memory:
    """Without the points that lie too close together for ``time`` to be foretold from them."""
    times = [at for at, _ in memory.past[-min(memory.smooth, POINTS) :]]
    least = (time - times[-1]) / FARTHEST
    far = 1
    while far < len(times) and times[-far] - times[-far - 1] >= least:
        far += 1
    if far == len(times):
        return memory
    return memory._replace(smooth=far, choice=min(memory.choice, far - 1), misses=None)


def _targets(group: Sequence[Chain]) -> list[int]:
    """The places of what is found for a group of chains: first in the middle, then at the end, rate after rate."""
    length = len(group[0].ends)
    middles = [-1 if chain.middles is None else chain.middles[k] for k in range(length) for chain in group]
    return [*middles, *(chain.ends[k] for k in range(length) for chain in group)]


def _all_weights(times: tuple[float, ...], count: int, step: float) -> Array:
    """Of the polynomials through the last point, through the last two ... one below the other; times in steps."""
    points = len(times)
    found = np.zeros((points, 2, count, points, count))
    for used in range(1, points + 1):
        found[used - 1, :, :, points - used :] = scaled(shares(times[points - used :], count, (0.5, 1.0)), step)
    return found.reshape(points * 2 * count, points * count)


def _next_miss(misses: Array) -> Array:
    """What is to come after ``misses`` (N, n), the newest first."""
    told, last, before = misses[:-2].ravel(), misses[1:-1].ravel(), misses[2:].ravel()
    square, product, other = last @ last, last @ before, before @ before
    damped = DAMPED * (square + other) + LEAST_SQUARE
    square, other = square + damped, other + damped
    first, second = last @ told, before @ told
    found: Array = (
        (first * other - second * product) * misses[0] + (second * square - first * product) * misses[1]
    ) / (square * other - product * product)
    return found
