"""When the inputs and outputs of a step agree well enough for redos to end."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .bends import Bends

Array = NDArray[np.float64]

# From one step to the next of the same length, what is allowed hardly ever grows more than so many times.
FAR = 100.0
# Relative; steps that are equal differ by what their times are rounded by.
SAME = 1e-6


class Agreement:
    """What outputs may still err by: the tolerance, or a share of what the polynomials of a step miss.

    The latter is not worked out where the error is far above what the step before was allowed, unless no redo is left.
    This is how far redos are worth while; the step itself errs by what its polynomials miss.
    """

    def __init__(self, bends: Bends) -> None:
        self._bends = bends
        self.forget()

    def forget(self) -> None:
        """Drop what the step before was allowed."""
        self._length, self._allowed = 0.0, np.inf

    def lacking(
        self, error: float, tolerance: float, share: float, begun: Array, shown: Array, step: float, last: bool = False
    ) -> bool:
        """Whether ``error`` is more than a ``step`` (s) may have that has ``begun`` so and now shows that.

        ``error`` and ``tolerance`` are relative to nominal values; ``last`` tells that no redo is left.
        """
        if not share or error <= tolerance:
            return error > tolerance
        if not last and abs(step - self._length) <= SAME * step and error > FAR * self._allowed:
            return True
        self._length = step
        self._allowed = max(tolerance, share * self._bends.largest(begun, shown, step))
        return error > self._allowed
