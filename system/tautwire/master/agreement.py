"""When the inputs and outputs of a step agree well enough for redos to end."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .bends import Bends

Array = NDArray[np.float64]

# From one step to the next of the same length, what is allowed grows less than so many times.
FAR = 10.0


class Agreement:
    """What outputs may still err by: the tolerance, or a share of what the polynomials of the step miss.

    The latter is not worked out where the error is far above what the step before was allowed. Not a bound of the
    error in the end, which is that of the polynomials.
    """

    def __init__(self, bends: Bends) -> None:
        self._bends = bends
        self._last = 0.0, np.inf

    def lacking(self, error: float, tolerance: float, share: float, begun: Array, shown: Array, step: float) -> bool:
        """Whether ``error`` is more than a ``step`` (s) may have that has ``begun`` so and now shows that.

        ``error`` and ``tolerance`` are relative to nominal values.
        """
        if not share or error <= tolerance:
            return error > tolerance
        length, allowed = self._last
        if step == length and error > FAR * allowed:
            return True
        allowed = max(tolerance, share * self._bends.largest(begun, shown, step))
        self._last = step, allowed
        return error > allowed
