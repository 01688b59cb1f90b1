"""Policy of what precedes the search: what recordings are cleaned of, and which noise and disturbance are believed.

Each threshold stands with its reason and how it was calibrated. Log-likelihoods are in nats, on all samples.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from ..recordings.dead_channels import DeadChannelPolicy
from ..recordings.outliers import OutlierPolicy


@dataclass(frozen=True)
class NoiseCheckPolicy:
    """When a recording contradicts the declared measurement noise, and when noise is coloured."""

    # Ratio of measured and declared standard deviation, either way: data sheets are no better than that. Chosen.
    max_noise_ratio: float = 1.5
    # Largest ratio of the spectrum's bands for white noise, whose estimates differ by chance. Chosen, not calibrated.
    max_band_ratio: float = 1.7
    # Ratio of the declared standard deviation to the spectrum's lowest band from which noise is coloured: 1.6 to 2.4
    # on load cells of six lifelike recordings, 1.1 by chance on a short one with outliers removed.
    min_colour_ratio: float = 1.25
    # Standstill: winch speeds within so many sigma of zero, for so many samples that a correlation of 0.15 is
    # significant. Chosen, not calibrated.
    standstill_sigmas: float = 5.0
    min_standstill_samples: int = 200


@dataclass(frozen=True)
class InitialStatePolicy:
    """When a recording starts in motion, and how uncertain its initial state is then."""

    # Standard deviation of self-stress where no tension is measured, as a share of the mean static one. Chosen.
    self_stress_ratio: float = 0.25
    # Standard deviations of an initial velocity from zero; a recording at rest must not pass for a moving one. Chosen.
    min_velocity_sigmas: float = 8.0
    # Window of the velocity estimate in s, twice as long where samples are few, and the fewest samples in it: short
    # beside a period of the motion, long beside one of the platform on its ropes. Chosen, not calibrated.
    velocity_window: float = 0.25
    min_window_samples: int = 10
    # Window of the oscillation about equilibrium in s: some periods of the platform on its ropes. Chosen.
    oscillation_window: float = 1.0
    # Largest amplitude of it as a share of the shortest rope: beyond, ropes have no reference. Chosen, not calibrated.
    max_amplitude_ratio: float = 0.02
    # Standard deviations of the initial state over the motion that was estimated. Chosen, not calibrated.
    prior_widening: float = 1.5


@dataclass(frozen=True)
class ClockOffsetPolicy:
    """When outputs that lag or lead have a clock of their own, and are no effect."""

    # Jackknife standard deviations by which offsets of two recordings differ: they know of no model error. Chosen.
    min_offset_sigmas: float = 6.0
    # In sample intervals: a smaller difference is no clock offset. Chosen, not calibrated.
    min_offset_intervals: float = 0.1
    # Remaining share of the innovations' mean square: at first order to be a candidate, at convergence to be a clock
    # and not a delay that some other error resembles. Chosen, not calibrated.
    max_candidate_variance_ratio: float = 0.8
    max_clock_variance_ratio: float = 0.33
    # Largest mean square that a clock running ahead in both recordings may leave; noise has 1. Chosen.
    max_explained_variance: float = 1.5
    # A delay of 0.1 s in both recordings was still on its way after five iterations, elsewhere in each, and passed for
    # a clock; half an oscillation period takes some ten.
    max_iterations: int = 25
    # Of the offset: a step that ends the iteration. Chosen, not calibrated.
    relative_tolerance: float = 0.002


@dataclass(frozen=True)
class PreprocessingPolicy:
    """What is removed from a recording before anything is fitted, and which declared noise is believed."""

    # Samples of each recording: a fit runs the filter over each some hundred times, 30 us a sample.
    max_samples: int = 100_000
    # In medians of the sample interval: one lost sample doubles a step.
    max_step_intervals: float = 1.5
    # Error of rope length in a gap, in standard deviations of the best sensor: a smaller one does not show.
    max_length_error_sigmas: float = 1.0
    # The same from which errors of recorded rope lengths are to be told from sensors' noise: below, they add a tenth to
    # its variance. Chosen, not calibrated.
    noticeable_length_error_sigmas: float = 0.3
    # Nats on FIT from which winch speeds are central differences of counts. Of seven lifelike recordings from counts
    # three gained 110, 190 and 3,200; the others nothing, or lost up to 1,600 where counts are coarse.
    min_speed_gain: float = 20.0
    # The same as a share of the nats that the model misses: beside a disturbance next to nothing, without one much
    # where an effect is hidden. Chosen, not calibrated.
    min_speed_gain_to_misfit: float = 0.1
    # Nats for each measured number from which winch speeds are cubic between samples before effects are known. True
    # linear ones were 0.001 less likely beside hidden friction, true cubic ones 0.008 beside hidden damping. Under the
    # effects found ``min_speed_gain`` decides.
    min_cubic_gain: float = 0.005
    # The same, without a disturbance, as a share of the nats that the model misses: a hidden frame that gives way made
    # cubic speeds explain more than a tenth where linear ones are true. Chosen.
    min_cubic_gain_to_misfit: float = 0.5
    dead_channels: DeadChannelPolicy = field(default_factory=DeadChannelPolicy)
    outliers: OutlierPolicy = field(default_factory=OutlierPolicy)
    noise_check: NoiseCheckPolicy = field(default_factory=NoiseCheckPolicy)
    initial_state: InitialStatePolicy = field(default_factory=InitialStatePolicy)
    clock_offsets: ClockOffsetPolicy = field(default_factory=ClockOffsetPolicy)

    def decisive_gain(self, misfit: float) -> float:
        """Nats by which other winch speeds have to be likelier where a model misses so many."""
        return max(self.min_speed_gain, self.min_speed_gain_to_misfit * misfit)


@dataclass(frozen=True)
class DisturbancePolicy:
    """What disturbance is likely before a recording is seen, and how exactly it is fitted. All chosen."""

    # Medians: a force of a thousandth of the weight, half of the sensors' noise with a memory, both with 1 Hz.
    force_to_weight: float = 1e-3
    coloured_noise_share: float = 0.7
    bandwidth: float = 1.0
    # Factors of one standard deviation about these: sizes are hardly known, bandwidths a little, data sheets better.
    size_factor: float = 100.0
    bandwidth_factor: float = 5.0
    noise_factor: float = 3.0
    # Factors by which sizes are larger where a fit may begin as well.
    start_factors: tuple[float, ...] = (30.0, 1000.0)
    # Nats below a more probable start at which a fit begins as well: in one recording 12 led 130 higher.
    max_start_deficit: float = 50.0
    # Levenberg's damping at first and at most, the longest step of a log, and the gain in nats that ends a fit, or one
    # given the uncertain parameters.
    first_damping: float = 1e-2
    max_damping: float = 1e4
    max_log_step: float = 2.0
    min_gain: float = 0.5
    min_coarse_gain: float = 2.0
    max_iterations: int = 12
    # Fits of uncertain parameters and disturbance in turn.
    max_alternations: int = 3
    # Samples of a first fit, from which the one to all samples begins, and iterations of the latter where it is coarse.
    coarse_samples: int = 1_000
    coarse_iterations: int = 2
    # Iterations over these first samples for each candidate that is ranked.
    ranking_iterations: int = 4
