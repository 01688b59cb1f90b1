"""How much of the motion within a step its polynomials miss, from what the middle of the step shows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .hermite import Chain, scaled, shares

Array = NDArray[np.float64]

# Values with two rates at both ends make a polynomial of the fifth degree, near enough to that of a step.
LEAST_LENGTH = 3
KEPT_WEIGHTS = 64


class Bends:
    """What outputs in the middle of a step differ by from the polynomials through their values and rates at its ends.

    For a chain of three that is ``h^6 / 46080`` times the sixth rate, for the second rate 24 of it over ``h^2``.
    ``nominal`` are the units of all outputs shown.
    """

    def __init__(self, chains: Sequence[Chain], nominal: Array) -> None:
        known = [c for c in chains if c.middles is not None and len(c.ends) >= LEAST_LENGTH]
        lengths = sorted({len(chain.ends) for chain in known})
        groups = [[chain for chain in known if len(chain.ends) == length] for length in lengths]
        self._groups = [
            (np.array([chain.ends for chain in group]).T, np.array([chain.middles for chain in group]).T)
            for group in groups
        ]
        self._units = [nominal[middles] for _, middles in self._groups]
        self._weights: dict[float, list[Array]] = {}

    def largest(self, begun: Array, shown: Array, step: float) -> float:
        """The largest of a ``step`` (s) that has ``begun`` with these outputs and now shows those; in nominal units."""
        found = 0.0
        for (ends, middles), units, weight in zip(self._groups, self._units, self._weights_for(step), strict=True):
            missed = weight @ np.concatenate([begun[ends], shown[ends]]) - shown[middles]
            found = max(found, float(np.abs(missed / units).max()))
        return found

    def _weights_for(self, step: float) -> list[Array]:
        key = round(step, 12)
        if key not in self._weights:
            if len(self._weights) >= KEPT_WEIGHTS:
                self._weights.clear()
            counts = [ends.shape[0] for ends, _ in self._groups]
            self._weights[key] = [
                scaled(shares((0.0, 1.0), count, (0.5,)), step).reshape(count, 2 * count) for count in counts
            ]
        return self._weights[key]
