"""Policy of a discovery: what is said of a residual that no known effect explains.

Chosen and calibrated as :mod:`tautwire.estimation.policy` tells, which holds it.
"""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True)
class SpectralLinePolicy:
    """Which lines in the innovations' spectrum may be a shaker's."""

    # Power over the median of the frequencies about a line: of one output chance exceeds it at one of 4096.
    min_power_ratio: float = 12.0
    # The strongest of them: harmonics of one line would crowd out the others. Chosen, not calibrated.
    max_count: int = 4


@dataclass(frozen=True)
class FormulaPolicy:
    """How formulas are searched, and which are more than a known effect by another name."""

    # Rounds of linearising, selecting and fitting; a round that does not improve ends the search. Chosen.
    max_rounds: int = 3
    # Terms are selected on the first so many samples, and fitted to all. Chosen, not calibrated.
    max_selection_samples: int = 10_000
    # Terms at most: with more nobody reads a formula. Chosen, not calibrated.
    max_terms: int = 6
    # Exchanges of a selected term for a better one, each term twice. Chosen, not calibrated.
    max_exchanges: int = 12
    # Fractions of the linear step at which a fit may start: the model bends where the step is large. Chosen.
    step_fractions: tuple[float, ...] = (1.0, 0.3)
    # Standard deviations by which a coefficient differs from zero, since it is the best of some thousand. Chosen.
    min_coefficient_sigmas: float = 4.0
    # Standard deviations within which two shape parameters count as equal. Chosen, not calibrated.
    equal_shape_sigmas: float = 4.0
    # Least share of a formula's gain that no term resembling a known effect achieves. Chosen, not calibrated.
    min_novel_gain_ratio: float = 0.05


@dataclass(frozen=True)
class ResonancePolicy:
    """When both recordings show the same hidden oscillator."""

    # Only the first so many samples are used: each frequency is one more column. Chosen, not calibrated.
    max_samples: int = 10_000
    # Periods of the lowest frequency in the recording; the highest is below this share of the sampling rate. Chosen.
    min_periods: float = 4.0
    max_frequency_ratio: float = 0.2
    # Of the platform's unknown acceleration, m/s^2 per root hertz: the first is used under which innovations are no
    # larger in the mean square than the next field, so that the run follows the data. Chosen, not calibrated.
    acceleration_noise_densities: tuple[float, ...] = (0.01, 0.03, 0.1, 0.3)
    max_innovation_variance: float = 3.0
    # Nats on both samples together, and on each: chance gives the best of 110 frequencies less. Chosen.
    min_total_gain: float = 20.0
    min_sample_gain: float = 5.0
    # Ratio of the gain at a peak to that at any other frequency; errors of other kinds are broad. Chosen.
    min_gain_ratio: float = 2.5
    # A smaller ratio is enough where both peaks are as close as this share of the frequency: a load that swings with a
    # good part of the platform's mass has a sharp peak on a pedestal.
    sharp_peak_distance: float = 0.035
    min_gain_ratio_of_sharp_peaks: float = 1.8
    # Two frequencies within this share, or one over the duration, are equal; beyond twice that they differ. Chosen.
    frequency_tolerance: float = 0.12
    # Of a mode of the model itself: a peak as near is that mode, wrongly excited. Chosen, not calibrated.
    mode_tolerance: float = 0.06
    # Of the largest gain of a site: outputs with less are not named. Chosen, not calibrated.
    min_output_gain_ratio: float = 0.25
    # Least share of the available gain beyond chance that a peak explains, and chance in its standard deviations.
    min_explained_ratio: float = 0.1
    chance_sigmas: float = 3.0


@dataclass(frozen=True)
class DiscoveryPolicy:
    """What is said of a residual that no known effect explains."""

    spectral_lines: SpectralLinePolicy = field(default_factory=SpectralLinePolicy)
    formulas: FormulaPolicy = field(default_factory=FormulaPolicy)
    resonances: ResonancePolicy = field(default_factory=ResonancePolicy)
