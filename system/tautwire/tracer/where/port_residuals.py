"""What each FMU alone leaves at its measured ports: values only, for reports to show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .associations import Association

Array = NDArray[np.float64]

PLATFORM = "platform"


@dataclass(frozen=True)
class ComponentResidual:
    """What one FMU alone leaves of one measured quantity, measured less shown, in ``unit``.

    ``residual`` (N,) is NaN where nothing was measured; ``mean`` its mean, which is taken off a tension's. ``rms`` is
    to be compared with ``expected_rms``, what noise alone would leave; chance does not reach the ratio ``limit``.
    ``rings_at`` is the frequency (Hz) at which a force rings by itself, None where it does not.
    """

    component: str
    quantity: str
    unit: str
    residual: Array
    mean: float
    rms: float
    expected_rms: float
    limit: float
    moves_with: Association | None
    rings_at: float | None = None

    @property
    def ratio(self) -> float:
        """Root mean square over what noise alone would leave."""
        return self.rms / self.expected_rms

    @property
    def is_off(self) -> bool:
        """Whether it is more than noise."""
        return self.ratio > self.limit


def root_mean_square(values: Array) -> float:
    """Root mean square of what is finite; NaN where nothing is."""
    seen = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(seen**2))) if seen.size else float("nan")


@dataclass(frozen=True)
class Components:
    """Residuals at the measured ports at ``time`` (N,), cables before the platform's axes; what they say.

    ``blamed`` is the component in question, ``sentence`` says so with the figures; ``untold`` is what could not be
    told.
    """

    time: Array
    parts: tuple[ComponentResidual, ...]
    blamed: str
    sentence: str
    untold: tuple[str, ...]

    @property
    def ranking(self) -> tuple[ComponentResidual, ...]:
        """The parts, the one furthest above its noise first."""
        return tuple(sorted(self.parts, key=lambda part: -part.ratio))
