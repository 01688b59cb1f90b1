"""Policy of an identification: every threshold that decides something, with its reason and how it was calibrated.

"Calibrated blind" means on the recordings of docs/tracer.md: 74 that hide an effect, 200 that hide nothing.
Log-likelihoods are in nats, on all samples unless a field says otherwise.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from .discovery.policy import DiscoveryPolicy
from .localisation.policy import LocalisationPolicy
from .preprocessing_policy import DisturbancePolicy, PreprocessingPolicy


@dataclass(frozen=True)
class ResidualAnalysisPolicy:
    """When a residual counts as white noise."""

    # Standard deviations of chance limits on variance and correlation: 200 of 200 blind recordings without an effect
    # passed for noise.
    whiteness_sigmas: float = 4.0
    # With many samples everything is significant: 3 % of variance or correlation is no effect worth a name.
    # Chosen, not calibrated.
    negligible_deviation: float = 0.03
    # Lags at which correlation is tested; more need longer recordings. Chosen, not calibrated.
    autocorrelation_lags: int = 20
    # Below, chance limits at 20 lags are too wide to tell noise from more. Chosen, not calibrated.
    min_samples: int = 100


@dataclass(frozen=True)
class FitPolicy:
    """How exactly parameters are fitted, and to how much of the data first."""

    # Acceleration noise density (m/s^2 per root hertz) and relative change of the cost at which to stop, by stage: a
    # run that follows the measurements has no far minima. Then without noise. Chosen, not calibrated.
    coarse_stages: tuple[tuple[float, float], ...] = ((0.1, 1e-3), (0.01, 1e-3))
    # Relative change of the cost at which the last stage stops: far below ties of some nats. Chosen, not calibrated.
    fine_cost_tolerance: float = 1e-7
    # For fits that are only ranked, whose ties are wide enough for it (``SelectionPolicy``). Chosen, not calibrated.
    coarse_cost_tolerance: float = 1e-4
    # Runs with sensitivities in one stage, so that no fit takes minutes. Chosen, not calibrated.
    max_evaluations: int = 15
    # The part of the data that ranks hypotheses: a third of the samples, of 800 to 20,000. Chosen, not calibrated.
    head_divisor: int = 3
    min_head_samples: int = 800
    max_head_samples: int = 20_000
    disturbance: DisturbancePolicy = field(default_factory=DisturbancePolicy)


@dataclass(frozen=True)
class ScoreTestPolicy:
    """Which hypotheses the score test sends on to a fit."""

    # Nats on estimation data: less is what chance gives some of some 80 hypotheses. Chosen, not calibrated.
    min_predicted_gain: float = 4.0
    # Of the best gain: what explains less than 2 % of it is not the first effect to add. Chosen, not calibrated.
    min_gain_ratio: float = 0.02
    # How many of the best are fitted: each fit costs seconds. Chosen, not calibrated.
    max_fits: int = 8
    # How many of these may come from the second test, with process noise. Chosen, not calibrated.
    max_rough_fits: int = 3
    # One effect on each of eight cables must not crowd out the others. Chosen, not calibrated.
    max_fits_per_effect: int = 3
    # Beside a disturbance, where all cables are one of them: values of single cables come later. Three slacks and three
    # moduli left no place for sag: slack had 6,685 nats, sag 13,946.
    max_fits_beside_disturbance: int = 2
    # Acceleration noise density (m/s^2 per root hertz) of the second test: where a model has lost the phase of an
    # oscillation, scores ask for damping whatever it lacks. Tried on a planar robot whose payload lacks 1 kg: found.
    rough_noise_density: float = 0.1


@dataclass(frozen=True)
class GridSearchPolicy:
    """Where a grid search ends."""

    # Nats: where gains are this small, smaller values of the parameter have no effect either. Chosen, not calibrated.
    negligible_gain: float = 0.01
    # Of the natural log of a detectable value: one per cent of the value. Chosen, not calibrated.
    log_value_tolerance: float = 0.01


@dataclass(frozen=True)
class SelectionPolicy:
    """What is accepted beside what, and how much work a round is worth."""

    # Default of --alpha: likelihood ratios above n / alpha come by chance in fewer than 1 % of recordings, whatever
    # the model (universal inference); 0 of 200 blind recordings without an effect got a name.
    false_alarm_rate: float = 0.01
    # Effects at most; blind recordings hide two at most. Chosen, not calibrated.
    max_rounds: int = 4
    # Nats within which two hypotheses explain as much, so that fewer parameters win: a likelihood ratio of 150.
    # Chosen, not calibrated.
    tie_nats: float = 5.0
    # Fits to a part of the data count as tied within these nats plus this share of the log-likelihood, which their
    # cost tolerance of 1e-4 explains ten times over. Chosen, not calibrated.
    coarse_tie_nats: float = 50.0
    coarse_tie_ratio: float = 1e-3
    # How many of the best predictions are fitted to all samples whatever their coarse fit says. Chosen.
    always_refitted: int = 2
    # How many of the first round's best effects are fitted with winch speeds interpolated otherwise. Chosen.
    fits_with_other_interpolation: int = 3
    # Standard deviations by which the mean square of innovations may exceed that of white noise by chance. Chosen.
    max_chance_deviations: float = 3.0
    # Mean square of innovations below which a model needs no larger form of the same effects; white noise has 1.
    # Chosen, not calibrated.
    max_noise_mean_square: float = 1.1
    # Replacements in the backward elimination: two that replace each other have to end. Chosen, not calibrated.
    max_swaps: int = 4
    # Samples by which starting values are ranked, and alternatives that deserve a fit to all samples; two effects
    # took 69 s of processor time where fits to more of it took 118 s, with the same answer.
    coarse_samples: int = 600

    # Effects that leave white noise together, from which one whose form is not exact may be all there is: a tilted
    # pulley was three anchors.
    min_suspicious_effects: int = 3

    # Share of the best evidence within which hypotheses explain as much beside a disturbance: no effect of the list has
    # quite the form of nature's. A modulus of 1.25 beside a little relaxation had 759 nats, relaxation alone 838.
    form_tie_ratio: float = 0.1

    # Nats for each validation sample that an effect has to gain beside a disturbance: less may be what the disturbance,
    # whose spectrum is no robot's, leaves to it. Blind recordings of 4,000 samples with an effect that is not on the
    # list gave up to 24 nats to one that is; what was on the list had 320 or more, drums of a real robot 0.27 a sample.
    min_evidence_rate: float = 0.01
    # Share of the first effect's evidence that a further one needs beside a disturbance: less may be what the first
    # one's form leaves. Relaxation had 18 nats after a modulus with 842, and 59 beside a drum in layers with 830.
    min_evidence_ratio: float = 0.1
    # Share of the evidence of a relaxation within a sample from which damping, its limit, is taken in its place.
    # Dampings by a power of the strain rate had 58 % and 83 %.
    min_limit_evidence_ratio: float = 0.5
    # Share of the best evidence from which a nonlinear rival is looked for at other optima: a hysteresis had 1,612 nats
    # where relaxation had 3,376, and at its own values 7,563 where that had 7,074; another 26 % of 10,100, then 110 %.
    min_rival_evidence_ratio: float = 0.2
    # Share of the best evidence from which a rival of fewer parameters is fitted beside a disturbance of its own: a
    # modulus had 5,829 nats of a relaxation's 6,507, 168 GPa in place of 195.
    min_simpler_evidence_ratio: float = 0.5
    # Share of an effect's evidence that values of single cables have to gain: they add no name. Drums of a real robot,
    # 0.93 to 0.97, gained more than 18 and less than 36 nats of 357.
    min_cable_evidence_ratio: float = 0.05
    # Share of the strongest effect's evidence below which another is small where there is no disturbance: beside a
    # friction of 1 + mu tanh in place of exp(mu tanh), a sensor's gain had 1,631 nats of 2.9 million.
    min_exact_evidence_ratio: float = 0.01

    def required_evidence(self, threshold: float, first_evidence: float, has_disturbance: bool) -> float:
        """The evidence that a further effect needs: more than chance, and than what the first one's form may leave."""
        return max(threshold, self.min_evidence_ratio * first_evidence) if has_disturbance else threshold

    def tie(self, evidence: float, has_disturbance: bool) -> float:
        """The nats within which a hypothesis ties with the best one, which has that evidence."""
        return max(self.tie_nats, self.form_tie_ratio * evidence) if has_disturbance else self.tie_nats

    def coarse_tie(self, log_likelihood: float) -> float:
        """The nats within which a fit to a part of the data ties with one of that log-likelihood."""
        return self.coarse_tie_nats + self.coarse_tie_ratio * abs(log_likelihood)


@dataclass(frozen=True)
class ProfileLikelihoodPolicy:
    """How exactly the ends of 95 % intervals are found, and with how many runs at most."""

    # A fall of the sum of squares below the fit that the fit's cost tolerance does not explain. Chosen.
    significant_fall: float = 0.1
    # Of 1.96^2: where the rise at 1.96 deviations is this near the parabola's, the end by curvature is taken. Chosen.
    max_parabola_deviation: float = 0.1
    # Of the distance from the fit to an end, to which the end is found. Chosen, not calibrated.
    end_tolerance: float = 0.01
    # Of the parameter's scale: first distance of the search where the curvature is unknown. Chosen, not calibrated.
    first_relative_distance: float = 1e-3
    # Doublings reach a million times the first distance. Chosen, not calibrated.
    max_distance_doublings: int = 20
    # How often the fit may turn out not to be the best before the curvature's interval is told. Chosen.
    max_recentrings: int = 3
    # Runs over the sample, in all and in one fit of the others: more is not worth an end. Chosen, not calibrated.
    max_runs: int = 300
    max_evaluations: int = 15


@dataclass(frozen=True)
class StabilityPolicy:
    """What intervals beside a disturbance hold."""

    # Stretches of a recording whose scores are compared. Chosen, not calibrated.
    stretches: int = 8
    # Of a parameter's distance from neutral, for what the effect's formula lacks beside nature's.
    form_tolerance: float = 0.05
    # Of the fitted random force's size: estimates under the smaller one are held as well. Two frictions of 0.0231 came
    # out as 0.0215 and 0.0199 to 0.0218 under the fitted force, and as 0.0231 and 0.0223 to 0.0234 under a tenth of it.
    smaller_force_ratio: float = 0.1
    # Mean square of whitened innovations above which a smaller force cannot be: 1.5 with these frictions, 24 on a real
    # robot whose drums alone are known.
    max_mean_square: float = 2.0


@dataclass(frozen=True)
class IdentifiabilityPolicy:
    """What counts as detectable and as confusable."""

    # Normal quantile of the probability, 90 %, with which an effect of the stated size is found. Chosen.
    power_quantile: float = 1.2816
    # Nats that fitting a parameter on other samples is expected to cost: for one parameter asymptotically one.
    fit_cost_nats: float = 1.0
    # Cosine between signatures: above it a fifth of an effect or less is its own. Chosen, not calibrated.
    min_confusable_cosine: float = 0.9


@dataclass(frozen=True)
class CosimulationPolicy:
    """When the co-simulated FMUs confirm what the filter found."""

    # Errors over what noise alone would leave; rightly named effects left at most 1.2 in 55 of 55 blind recordings.
    max_error_ratio: float = 1.5
    # The same of what noisy winch speeds make drift. Over a run the mean square of one random walk exceeds 5.6 times
    # its expectation once in 100, and 2.25 times, as at a ratio of 1.5, once in 10.
    max_drift_ratio: float = 2.36
    # Of the FMUs' own integration of effects' states, far below any sensor's noise: a hysteresis on three steel ropes
    # differed by 0.07 um and 0.014 N from 1e-9, in less than half its time.
    relative_tolerance: float = 1e-5


@dataclass(frozen=True)
class SizePolicy:
    """When an effect is small, and when what is left is, beside a disturbance. All chosen on a few recordings."""

    # Least share of what was missed, and least size in standard deviations of one sample's noise: below, an effect is
    # listed apart.
    min_share: float = 0.02
    min_size: float = 1.0
    # Share of what was missed below which no further effect is looked for: what is left is seldom one effect's. At 4 %
    # and at 2 % searches ended with relaxation where damping and a modulus were hidden.
    max_left_share: float = 0.01
    # Share of what the largest effect explains that its form may leave: a further one is small below it, and exact
    # sensors that miss more are not explained. Sag by another parabola left 3 % to an offset, a bungee 44 %.
    max_left_share_of_form: float = 0.05
    # Share of what was missed from which a further effect, in another component, is nothing that the first one's form
    # leaves: beside a relaxation with 17,243 nats a drum with 221 explained 14 %.
    min_share_elsewhere: float = 0.1
    # Least share that all effects together explain, where much is left: below, nothing on the list explains it.
    min_explained_share: float = 0.25
    # Half-width of an effect's amplitude over stretches, relative to it, above which it is none: two tanks that fill
    # were payloads with 0.37 and 0.39; drag, linear in speed, had 0.03 to 0.12 on three lifelike recordings.
    max_amplitude_spread: float = 0.3
    # Size of an effect over that of what is missed, or of what all effects change if that is larger, above which others
    # nearly cancel it: a bungee was a hanging load and offsets of load cells with 9.5 and 8.7; listed ones had 2.0.
    max_size_to_missed: float = 4.0
    # Standard deviation of a time constant, relative to it, above which no delay of the effect shows. A rope that
    # stiffens with its tension was a relaxation with 0.4 to 1.2; effects of the list had 0.2 at most.
    max_time_deviation: float = 0.5
    # Standard deviations within which an uncertain number of the robot without effects is taken at its best.
    max_calibration_sigmas: float = 3.0
    # Size of what is missed in co-simulation, in standard deviations of one sample's noise, that passes for a random
    # force that the sensors hardly show: 4 on the one lifelike recording with nothing hidden, 20 to 120 on others.
    max_size_of_disturbance: float = 8.0
    # What is larger passes too where a disturbance takes it up, its force over the weight and its errors over the
    # sensors' noise below these: with nothing hidden ten lifelike recordings had 0.006 and 2 at most, one 0.02 and 6.
    max_force_to_weight: float = 0.008
    max_sensor_error: float = 3.0


@dataclass(frozen=True)
class TimeLimitPolicy:
    """Shares of the time limit at which searches end; the rest is for co-simulations and the report. Chosen."""

    # Effects: three rounds of co-simulations follow, which take as long as a third of a whole trace.
    selection: float = 0.6
    # Values of single cables: what they tell is worth more than another alternative.
    values_of_cables: float = 0.75
    # Formulas and resonances, which one more co-simulation confirms.
    discovery: float = 0.6
    # Effects beside a disturbance, where exact sensors show that no form is exact; and fewer, where none is steady.
    second_search: float = 0.85
    # Intervals, what could have been seen, and the component in question.
    refinement: float = 0.9
    # Samples for each second of the limit at most, but no fewer than the second number: co-simulations take their time
    # for each sample.
    samples_per_second: float = 200.0
    min_samples: int = 6_000


@dataclass(frozen=True)
class IdentificationPolicy:
    """Policy of an identification, by theme."""

    preprocessing: PreprocessingPolicy = field(default_factory=PreprocessingPolicy)
    residual_analysis: ResidualAnalysisPolicy = field(default_factory=ResidualAnalysisPolicy)
    fit: FitPolicy = field(default_factory=FitPolicy)
    score_test: ScoreTestPolicy = field(default_factory=ScoreTestPolicy)
    grid_search: GridSearchPolicy = field(default_factory=GridSearchPolicy)
    selection: SelectionPolicy = field(default_factory=SelectionPolicy)
    profile_likelihood: ProfileLikelihoodPolicy = field(default_factory=ProfileLikelihoodPolicy)
    stability: StabilityPolicy = field(default_factory=StabilityPolicy)
    identifiability: IdentifiabilityPolicy = field(default_factory=IdentifiabilityPolicy)
    cosimulation: CosimulationPolicy = field(default_factory=CosimulationPolicy)
    size: SizePolicy = field(default_factory=SizePolicy)
    localisation: LocalisationPolicy = field(default_factory=LocalisationPolicy)
    discovery: DiscoveryPolicy = field(default_factory=DiscoveryPolicy)
    time_limit: TimeLimitPolicy = field(default_factory=TimeLimitPolicy)


DEFAULT_POLICY = IdentificationPolicy()
