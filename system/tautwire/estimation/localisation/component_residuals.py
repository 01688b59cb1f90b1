"""Component residuals at the measured ports, and the signals that they correlate with."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..policy import DEFAULT_POLICY

Array = NDArray[np.float64]

MIN_SAMPLES = 30
# Autocorrelations count up to a lag of the recording's length over this.
MAX_LAG_DIVISOR = 4


@dataclass(frozen=True)
class SignalCorrelation:
    """Correlation of a residual with a named signal."""

    name: str
    correlation: float


def strongest_correlation(
    residual: Array,
    signals: Mapping[str, Array],
    significance_level: float = DEFAULT_POLICY.localisation.correlation_level,
) -> SignalCorrelation | None:
    """Strongest significant correlation of a residual (N,) with any of the signals; None if none is significant.

    With correlation ``r`` and ``n`` independent samples ``r sqrt((n - 2) / (1 - r^2))`` has Student's distribution;
    Holm's correction over all signals. Neighbours are correlated in both, so that

        n = N / (1 + 2 sum_k rho_residual(k) rho_signal(k))

    Source: Bartlett (1935), J. R. Stat. Soc. 98, 536; Holm (1979), Scand. J. Stat. 6, 65.
    """
    is_finite = np.isfinite(residual)
    if np.sum(is_finite) < MIN_SAMPLES:
        return None
    standardised = _standardised(residual[is_finite])
    autocorrelation = _autocorrelation(standardised)
    names, correlations, p_values = [], [], []
    for name, signal in signals.items():
        other = _standardised(signal[is_finite])
        if not np.any(other):
            continue
        correlation = float(np.clip(np.mean(standardised * other), -1.0 + 1e-12, 1.0 - 1e-12))
        variance_inflation = 1.0 + 2.0 * float(np.sum(autocorrelation * _autocorrelation(other)))
        names.append(name)
        correlations.append(correlation)
        p_values.append(_correlation_p_value(correlation, len(standardised) / max(variance_inflation, 1.0)))
    is_significant = _holm_correction(np.array(p_values), significance_level)
    candidates = [
        SignalCorrelation(name, correlation)
        for name, correlation, significant in zip(names, correlations, is_significant, strict=True)
        if significant
    ]
    return max(candidates, key=lambda candidate: abs(candidate.correlation), default=None)


def _correlation_p_value(correlation: float, sample_count: float) -> float:
    """Two-sided p-value of a correlation of so many independent samples, by Student's distribution."""
    # Imported here: it takes long to import, and only traces need it.
    from scipy.stats import t as student

    degrees_of_freedom = sample_count - 2.0
    t_statistic = abs(correlation) * np.sqrt(max(degrees_of_freedom, 0.0) / (1.0 - correlation**2))
    return 2.0 * float(student.sf(t_statistic, degrees_of_freedom)) if degrees_of_freedom > 1.0 else 1.0


def _holm_correction(p_values: Array, significance_level: float) -> NDArray[np.bool_]:
    """Hypotheses rejected by their p-values (k,) at a family-wise error rate of ``significance_level``."""
    order = np.argsort(p_values)
    is_rejected = np.minimum.accumulate(p_values[order] * np.arange(len(p_values), 0, -1) <= significance_level)
    is_significant = np.zeros(len(p_values), dtype=bool)
    is_significant[order] = is_rejected
    return is_significant


def _standardised(values: Array) -> Array:
    """Values standardised to zero mean and unit mean square; zeros where they are constant."""
    centred = values - np.mean(values)
    rms = float(np.sqrt(np.mean(centred**2)))
    is_constant = rms <= 1e-12 * float(np.max(np.abs(values), initial=0.0))
    standardised: Array = np.zeros_like(centred) if is_constant else centred / rms
    return standardised


def _autocorrelation(values: Array) -> Array:
    """Autocorrelation of a standardised series (N,), at lags from 1 to a quarter of it."""
    power = np.abs(np.fft.rfft(values, 2 * len(values))) ** 2
    autocorrelation: Array = np.fft.irfft(power)[1 : len(values) // MAX_LAG_DIVISOR + 1] / len(values)
    return autocorrelation


PLATFORM = "platform"
MIN_CONSTANT_SHARE = 0.95


@dataclass(frozen=True)
class ComponentResidual:
    """Residual of one FMU alone in one measured quantity, measured less simulated, in ``unit``.

    ``residual`` (N,) is NaN where nothing was measured; ``mean`` its mean, which is subtracted from a tension's.
    ``rms`` is to be compared with ``expected_rms``, that of a correct model, by noise and by what the robot file states
    as uncertain; chance does not reach the ratio ``threshold``.
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
    def cable_number(self) -> int:
        """The number of its cable; 0 for the platform."""
        return 0 if self.component == PLATFORM else int(self.component.split()[1])

    @property
    def ratio(self) -> float:
        """Root mean square over that of a correct model."""
        return self.rms / self.expected_rms

    @property
    def is_significant(self) -> bool:
        """Whether the residual is more than noise and stated uncertainties."""
        return self.ratio > self.threshold

    @property
    def is_constant(self) -> bool:
        """Whether its mean is nearly all of it; that of a tension was subtracted."""
        return self.component == PLATFORM and abs(self.mean) > MIN_CONSTANT_SHARE * self.rms

    @property
    def oscillates(self) -> bool:
        """Whether it rings, and varies about its mean by more than noise and stated uncertainties."""
        variation = math.sqrt(max(self.rms**2 - self.mean**2, 0.0))
        return self.resonance_frequency is not None and variation > self.threshold * self.expected_rms


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
