"""Component residuals at the measured ports: values only, for reports to show."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .associations import SignalCorrelation

Array = NDArray[np.float64]

PLATFORM = "platform"


@dataclass(frozen=True)
class ComponentResidual:
    """Residual of one FMU alone in one measured quantity, measured less simulated, in ``unit``.

    ``residual`` (N,) is NaN where nothing was measured; ``mean`` its mean, which is subtracted from a tension's.
    ``rms`` is to be compared with ``expected_rms``, that of noise alone; chance does not reach the ratio ``threshold``.
    ``resonance_frequency`` (Hz) is that of a hidden oscillator, None where there is none.
    """

    component: str
    quantity: str
    unit: str
    residual: Array
    mean: float
    rms: float
    expected_rms: float
    threshold: float
    correlated_signal: SignalCorrelation | None
    resonance_frequency: float | None = None

    @property
    def ratio(self) -> float:
        """Root mean square over that of noise alone."""
        return self.rms / self.expected_rms

    @property
    def is_significant(self) -> bool:
        """Whether the residual is more than noise."""
        return self.ratio > self.threshold


def root_mean_square(values: Array) -> float:
    """Root mean square of what is finite; NaN where nothing is."""
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else float("nan")


@dataclass(frozen=True)
class FaultLocalisation:
    """Localisation of model error by ``residuals`` at the measured ports at ``time`` (N,), cables before the platform.

    ``faulty_component`` is the one in question, ``sentence`` says so with the figures; ``limitations`` name what could
    not be evaluated.
    """

    time: Array
    residuals: tuple[ComponentResidual, ...]
    faulty_component: str
    sentence: str
    limitations: tuple[str, ...]

    @property
    def ranking(self) -> tuple[ComponentResidual, ...]:
        """The residuals, the one furthest above its noise first."""
        return tuple(sorted(self.residuals, key=lambda part: -part.ratio))
