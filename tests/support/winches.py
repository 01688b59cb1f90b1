"""Smooth speeds of winches, as the rig takes them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class SwayingWinches:
    """Speeds that sway, each with its size in m/s."""

    kinks = ()

    def __init__(self, sizes: Sequence[float]) -> None:
        self.sizes = np.array(sizes)

    def speed(self, time: float) -> Array:
        """In m/s."""
        return np.asarray(self.sizes * np.sin(3.0 * time))

    def travel(self, time: float) -> Array:
        """In m."""
        return np.asarray(self.sizes * (1.0 - np.cos(3.0 * time)) / 3.0)


class PayingOut:
    """Speeds that rise from rest to their size in m/s, with a time constant in s."""

    kinks = ()

    def __init__(self, sizes: Sequence[float], rise: float) -> None:
        self.sizes = np.array(sizes)
        self.rise = rise

    def speed(self, time: float) -> Array:
        """In m/s."""
        return np.asarray(self.sizes * (1.0 - np.exp(-time / self.rise)))

    def travel(self, time: float) -> Array:
        """In m."""
        return np.asarray(self.sizes * (time - self.rise * (1.0 - np.exp(-time / self.rise))))
