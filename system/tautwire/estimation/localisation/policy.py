"""Policy of a localisation: when a component's residual is more than noise, and what it resembles.

Chosen and calibrated as :mod:`tautwire.estimation.policy` tells, which holds it.
"""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class ResonancePeakPolicy:
    """When a residual force has the peak of an attached oscillator, and not the slope of a mass or damping force."""

    # Over both its sides, as a ratio of power. Chosen, not calibrated.
    min_prominence: float = 30.0
    # Least share of the residual's power within a quarter of the peak's frequency. Chosen, not calibrated.
    min_power_ratio: float = 0.3
    half_width_ratio: float = 0.25


@dataclass(frozen=True)
class LocalisationPolicy:
    """When the residual of a component is more than that of a correct model, and what it resembles."""

    # Samples that are evaluated: the cost grows with them, and these are enough. Chosen, not calibrated.
    max_samples: int = 20_000
    # Standard deviations of a mean square over noise: eleven residuals of a robot with eight cables are looked at, and
    # noise is declared, not known. Chosen, not calibrated.
    significant_sigmas: float = 5.0
    # Of noise power: in long recordings every deviation is significant, and the noise of a smoothed path is known to
    # some tenths: a right model had 1.35 times its power where a tracker was slower than the log. Chosen.
    negligible_excess: float = 0.25
    # Family-wise error rate at which a residual correlates with one of several signals. Chosen, not calibrated.
    correlation_level: float = 0.01
    # Missing force after over before tensions are swapped: a wrong load cell leaves noise alone. Chosen.
    max_closure_ratio: float = 0.5
    resonance_peaks: ResonancePeakPolicy = field(default_factory=ResonancePeakPolicy)
