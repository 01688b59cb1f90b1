"""With which of some known signals a residual moves, told before anything is fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ALPHA = 0.01
FEWEST = 30
# Share of a recording up to which samples apart count as alike.
FURTHEST_LAG = 4


@dataclass(frozen=True)
class Association:
    """A signal by name, and the correlation of a residual with it."""

    name: str
    correlation: float


def strongest(residual: Array, signals: Mapping[str, Array], alpha: float = ALPHA) -> Association | None:
    """The signal with which a residual (N,) correlates most of those where it does significantly; None if none does.

    With correlation ``r`` and ``n`` independent samples ``r sqrt((n - 2) / (1 - r^2))`` has Student's distribution;
    Holm's correction over all signals. Neighbours are alike in both, so that

        n = N / (1 + 2 sum_k rho_residual(k) rho_signal(k))

    Source: Bartlett (1935), J. R. Stat. Soc. 98, 536; Holm (1979), Scand. J. Stat. 6, 65.
    """
    # Imported here: it takes long to import, and only traces need it.
    from scipy.stats import t as student

    seen = np.isfinite(residual)
    if np.sum(seen) < FEWEST:
        return None
    left = _standard(residual[seen])
    alike = _autocorrelation(left)
    names, correlations, chances = [], [], []
    for name, signal in signals.items():
        other = _standard(signal[seen])
        if not np.any(other):
            continue
        correlation = float(np.clip(np.mean(left * other), -1.0 + 1e-12, 1.0 - 1e-12))
        spread = 1.0 + 2.0 * float(np.sum(alike * _autocorrelation(other)))
        free = len(left) / max(spread, 1.0) - 2.0
        size = abs(correlation) * np.sqrt(max(free, 0.0) / (1.0 - correlation**2))
        names.append(name)
        correlations.append(correlation)
        chances.append(2.0 * float(student.sf(size, free)) if free > 1.0 else 1.0)
    told = _holm(np.array(chances), alpha)
    found = [Association(n, c) for n, c, sure in zip(names, correlations, told, strict=True) if sure]
    return max(found, key=lambda each: abs(each.correlation), default=None)


def _holm(chances: Array, alpha: float) -> NDArray[np.bool_]:
    """Which of some chances (k,) are too small for all together to err with more than ``alpha``."""
    order = np.argsort(chances)
    kept = np.minimum.accumulate(chances[order] * np.arange(len(chances), 0, -1) <= alpha)
    told = np.zeros(len(chances), dtype=bool)
    told[order] = kept
    return told


def _standard(values: Array) -> Array:
    """Mean zero and mean square one; zeros where nothing moves."""
    away = values - np.mean(values)
    size = float(np.sqrt(np.mean(away**2)))
    still = size <= 1e-12 * float(np.max(np.abs(values), initial=0.0))
    standard: Array = np.zeros_like(away) if still else away / size
    return standard


def _autocorrelation(values: Array) -> Array:
    """Of a standard series (N,), at lags from 1 to a quarter of it."""
    power = np.abs(np.fft.rfft(values, 2 * len(values))) ** 2
    found: Array = np.fft.irfft(power)[1 : len(values) // FURTHEST_LAG + 1] / len(values)
    return found
