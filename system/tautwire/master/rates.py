"""Rates of outputs whose FMU does not show them, worked out from what it has shown.

The rate now is that of the polynomial through the value now and those at the last communication points:

    y'(t) = sum over j of w_j y(t_j),   w_j the rate, at t, of the Lagrange polynomial that is one at t_j

With k points before the present one, h apart, it errs by h^k y^(k+1) / (k + 1). What one point fewer gives differs by
about the error of that lesser estimate.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Places = NDArray[np.intp]
Past = Sequence[tuple[float, Array]]


def rate_weights(times: Sequence[float]) -> Array:
    """The weights of values at ``times`` (s, all different) in the rate at the last one, in 1/s; shape (N,)."""
    *earlier, now = times
    weights = np.zeros(len(times))
    for place, time in enumerate(earlier):
        weight = 1.0 / (time - now)
        for other in earlier[:place] + earlier[place + 1 :]:
            weight *= (now - other) / (time - other)
        weights[place] = weight
    weights[-1] = -np.sum(weights[:-1])
    return weights


class Rates:
    """Fills the ``rates`` of an array of outputs from the past of its ``values``, both places in it of equal number."""

    def __init__(self, values: Places, rates: Places) -> None:
        self._values = values
        self._rates = rates
        self._known = self._coarse = np.zeros(len(values))
        self._now = self._coarse_now = 0.0

    @property
    def count(self) -> int:
        """Number of rates."""
        return len(self._rates)

    def begin(self, past: Past, time: float) -> None:
        """A step that ends at ``time``; ``past`` holds what was shown at the communication points before."""
        if not self.count:
            return
        self._known, self._now = self._weighed(past, time)
        # One point before the present one leaves nothing to compare with.
        self._coarse, self._coarse_now = self._weighed(past[1:] or past, time)

    def fill(self, shown: Array) -> None:
        """Set the rates that go with the values shown."""
        if self.count:
            shown[self._rates] = self._known + self._now * shown[self._values]

    def doubts(self, shown: Array) -> Array:
        """By how much each rate would be another with one point fewer."""
        doubts: Array = np.abs(shown[self._rates] - self._coarse - self._coarse_now * shown[self._values])
        return doubts

    def _weighed(self, past: Past, time: float) -> tuple[Array, float]:
        weights = rate_weights([at for at, _ in past] + [time])
        known = sum((weight * values[self._values] for weight, (_, values) in zip(weights, past, strict=False)), 0.0)
        return np.broadcast_to(known, self._values.shape), float(weights[-1])
