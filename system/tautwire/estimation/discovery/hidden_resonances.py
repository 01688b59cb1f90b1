"""Hidden oscillators, degrees of freedom that the model lacks, detected by frequency and site.

An attached mass on a spring exerts ``k (u - s)`` on its carrier, with ``s`` the motion of that, and

    u'' + 2 zeta w u' + w^2 u = w^2 s + 2 zeta w s'

On the platform ``s`` is its position; at an exit point or in a compliant rope, the tension. For each frequency this
force is one more series, and its gain in log-likelihood is a spectrum that no frequency of the motion itself can fake:
where the motion has a peak, its series has that too.

Source: the tuned absorber, Den Hartog (1956), Mechanical Vibrations, sec. 3.3; Ljung (1999), sec. 11.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter
from threadpoolctl import threadpool_limits

from tautwire_fmu.laws.formula import FORCE_TARGETS

from ...errors import TautwireError
from ...linear import linearise
from ...recordings.start_position import with_start
from ...robot.schema import Robot
from ..estimation_data import DataSet, DataSplit
from ..innovation_sensitivities import linearise_filter
from ..likelihood import Likelihood
from ..parameter_fit import Fitter
from ..trace_result import Resonance
from .formula_ports import FormulaPorts, PortSignals, Site, series_sensitivities

Array = NDArray[np.float64]

# Only the first so many samples are used.
MAX_SAMPLES = 10_000
DAMPING_RATIO = 0.02
LOG_FREQUENCY_STEP = 0.03
# Periods of the lowest frequency in the recording; the highest is below this share of the sampling rate.
MIN_PERIODS, MAX_FREQUENCY_RATIO = 4.0, 0.2
MAX_FREQUENCIES = 110
# Of the platform's unknown acceleration, m/s^2 per root hertz; the first is used under which the run follows the data.
ACCELERATION_NOISE_DENSITIES = (0.01, 0.03, 0.1, 0.3)
MAX_INNOVATION_VARIANCE = 3.0
# Gains in nats on both samples together and on each, and their ratio to the gain at any other frequency.
MIN_TOTAL_GAIN, MIN_SAMPLE_GAIN, MIN_GAIN_RATIO = 20.0, 5.0, 2.5
# A smaller ratio is enough where both peaks are as close as this share of the frequency.
SHARP_PEAK_DISTANCE, MIN_GAIN_RATIO_OF_SHARP_PEAKS = 0.035, 1.8
# Two frequencies within this share, or one over the duration, are equal; beyond twice that they differ.
FREQUENCY_TOLERANCE = 0.12
MODE_TOLERANCE = 0.06
MIN_OUTPUT_GAIN_RATIO = 0.25
# Least share of the available gain beyond chance that a peak explains.
MIN_EXPLAINED_RATIO = 0.1
CHANCE_SIGMAS = 3.0
RANK_TOLERANCE = 1e-9


class _Column(NamedTuple):
    site: Site
    series: Array


class _GainSpectrum(NamedTuple):
    """Gains in nats at each frequency (F,), and of each site alone (F, sites); ``available_gain`` bounds them."""

    joint_gains: Array
    site_gains: Array
    available_gain: float


@threadpool_limits.wrap(limits=1)
def find_resonances(robot: Robot, fitter: Fitter, evidence: DataSplit) -> tuple[Resonance, ...]:
    """Hidden oscillators on the platform or at the exit points, where both samples agree."""
    samples = [sample.first(MAX_SAMPLES) for sample in (evidence.estimation, evidence.validation)]
    frequencies = _frequency_grid(samples)
    modal_frequencies = _modal_frequencies(robot)
    spectra = [_gain_spectra_of(robot, fitter, sample, frequencies) for sample in samples]
    names = evidence.estimation.recording.channel_names
    candidates = []
    for group, outputs in ((0, names[:3]), (1, names[3:])):
        fit, judge = spectra[0][group], spectra[1][group]
        if not _peaks_agree(frequencies, fit, judge, MIN_PERIODS / frequencies[0]):
            continue
        peak_indices = [int(np.argmax(spectrum.joint_gains)) for spectrum in (fit, judge)]
        gains = [float(s.joint_gains[peak]) for s, peak in zip((fit, judge), peak_indices, strict=True)]
        frequency = float(np.average(frequencies[peak_indices], weights=gains))
        site_gains = fit.site_gains[peak_indices[0]] + judge.site_gains[peak_indices[1]]
        affected_outputs = tuple(
            n for n, gain in zip(outputs, site_gains, strict=True) if gain >= MIN_OUTPUT_GAIN_RATIO * np.max(site_gains)
        )
        if not np.any(np.abs(modal_frequencies - frequency) < MODE_TOLERANCE * modal_frequencies):
            candidates.append((sum(gains), Resonance(frequency, affected_outputs, ("fit", "check"))))
    best = max((gain for gain, _ in candidates), default=0.0)
    return tuple(resonance for gain, resonance in candidates if gain > best / MIN_GAIN_RATIO)


def _frequency_grid(samples: Sequence[DataSet]) -> Array:
    duration = min(sample.recording.duration for sample in samples)
    step = max(float(np.median(np.diff(sample.recording.time))) for sample in samples)
    slowest = MIN_PERIODS / duration
    count = min(MAX_FREQUENCIES, int(np.log(max(MAX_FREQUENCY_RATIO / step / slowest, 1.1)) / LOG_FREQUENCY_STEP))
    grid: Array = slowest * np.exp(LOG_FREQUENCY_STEP * np.arange(count + 1))
    return grid


def _modal_frequencies(robot: Robot) -> Array:
    try:
        return linearise(robot).modes.frequencies
    except TautwireError:
        return np.zeros(0)


def _peaks_agree(frequencies: Array, fit: _GainSpectrum, judge: _GainSpectrum, duration: float) -> bool:
    """Whether both samples, of at least ``duration`` seconds, have one clear peak at the same frequency."""
    peaks, other_gain, peak_gain = [], 0.0, 0.0
    for spectrum in (fit, judge):
        index = int(np.argmax(spectrum.joint_gains))
        if index in (0, len(frequencies) - 1) or spectrum.joint_gains[index] < max(
            MIN_SAMPLE_GAIN, MIN_EXPLAINED_RATIO * spectrum.available_gain
        ):
            return False
        tolerance = max(1.0 / duration, FREQUENCY_TOLERANCE * frequencies[index])
        peaks.append((frequencies[index], tolerance))
        peak_gain += float(spectrum.joint_gains[index])
        other_gain += float(
            np.max(spectrum.joint_gains[np.abs(frequencies - frequencies[index]) > 2.0 * tolerance], initial=0.0)
        )
    (first, first_tolerance), (second, second_tolerance) = peaks
    min_gain_ratio = (
        MIN_GAIN_RATIO_OF_SHARP_PEAKS if abs(first - second) < SHARP_PEAK_DISTANCE * first else MIN_GAIN_RATIO
    )
    return bool(
        abs(first - second) < max(first_tolerance, second_tolerance)
        and peak_gain > MIN_TOTAL_GAIN
        and peak_gain > min_gain_ratio * other_gain
    )


def _gain_spectra_of(
    robot: Robot, fitter: Fitter, sample: DataSet, frequencies: Array
) -> tuple[_GainSpectrum, _GainSpectrum]:
    """Gain spectra of one sample on the platform, and in the ropes."""
    likelihood, values = fitter.likelihood(robot, (), sample)
    acceleration_noise_density = _sufficient_noise_density(likelihood, values, sample)
    robot_at_start = with_start(robot, sample.start)
    ports = FormulaPorts(robot_at_start, likelihood.model.state_names)
    segments = linearise_filter(likelihood, values, sample.recording, acceleration_noise_density)
    signals = _concatenated([ports.signals(run) for run in segments])
    step = float(np.median(np.diff(sample.recording.time)))
    nuisances, oscillators = _nuisance_columns(signals, step), _oscillator_columns(signals, step, frequencies)
    return _accumulated_gains(
        robot_at_start, likelihood, values, sample, acceleration_noise_density, nuisances, oscillators, fitter
    )


def _sufficient_noise_density(likelihood: Likelihood, values: list[float], sample: DataSet) -> float:
    for acceleration_noise_density in ACCELERATION_NOISE_DENSITIES:
        innovations = likelihood.innovations(sample.recording, values, acceleration_noise_density)
        if float(np.nanmean(innovations.mean_square(sample.rows))) < MAX_INNOVATION_VARIANCE:
            return acceleration_noise_density
    return ACCELERATION_NOISE_DENSITIES[-1]


def _concatenated(parts: Sequence[PortSignals]) -> PortSignals:
    """Join segments, which overlap by one sample."""

    def join(columns: Sequence[dict[str, Array]]) -> dict[str, Array]:
        return {
            name: np.concatenate([*(column[name][:-1] for column in columns), columns[-1][name][-1:]])
            for name in columns[0]
        }

    ropes = tuple(join([part.ropes[index] for part in parts]) for index in range(len(parts[0].ropes)))
    return PortSignals(join([part.platform for part in parts]), ropes)


def _nuisance_columns(signals: PortSignals, step: float) -> list[_Column]:
    """Nuisance series of non-oscillating errors: loads, masses, stiffnesses and dampings."""
    columns = []
    for force, axis in zip(FORCE_TARGETS, "xyz", strict=True):
        speed = signals.platform[f"v{axis}"]
        displacement = signals.platform[axis] - signals.platform[axis][0]
        series = (np.ones_like(speed), displacement, speed, np.gradient(speed, step))
        columns += [_Column(Site(force), column) for column in series]
    for cable, rope in enumerate(signals.ropes, start=1):
        columns += [_Column(Site("tension", (cable,)), rope[name]) for name in ("tension", "strain_rate", "time")]
    return columns


def _oscillator_columns(signals: PortSignals, step: float, frequencies: Array) -> list[_Column]:
    """Series of an oscillator at each frequency: the axes, then the ropes."""
    columns: list[_Column] = []
    sites = [*map(Site, FORCE_TARGETS), *(Site("tension", (cable,)) for cable in range(1, len(signals.ropes) + 1))]
    for frequency in frequencies.tolist():
        carriers = [signals.platform[axis] for axis in "xyz"] + [rope["tension"] for rope in signals.ropes]
        columns += map(_Column, sites, _oscillator_response(np.array(carriers), frequency, step))
    return columns


def _oscillator_response(carriers: Array, frequency: float, step: float) -> Array:
    """Response ``u - s`` of oscillators that are at rest at the start, a row each."""
    angular_frequency = 2.0 * np.pi * frequency
    continuous_denominator = np.array([1.0, 2.0 * DAMPING_RATIO * angular_frequency, angular_frequency**2])
    numerator, denominator, _ = cont2discrete((continuous_denominator[1:], continuous_denominator), step, method="foh")
    displacement = carriers - carriers[:, :1]
    response: Array = lfilter(np.ravel(numerator), denominator, displacement, axis=1) - displacement
    return response


def _accumulated_gains(
    robot: Robot,
    likelihood: Likelihood,
    values: list[float],
    sample: DataSet,
    acceleration_noise_density: float,
    nuisances: Sequence[_Column],
    oscillators: Sequence[_Column],
    fitter: Fitter,
) -> tuple[_GainSpectrum, _GainSpectrum]:
    """Gains in nats by frequency beside the nuisances, from one run of the filter."""
    columns = [*nuisances, *oscillators]
    sites = [column.site for column in columns]
    initial_values = [column.series[:1] for column in columns]
    nuisance_count, width = len(nuisances), 3 + robot.cable_count
    inner, cross_products = np.zeros((nuisance_count, nuisance_count)), np.zeros((nuisance_count, len(oscillators)))
    information, score = np.zeros((len(oscillators) // width, width, width)), np.zeros(len(columns))
    ports = FormulaPorts(robot, likelihood.model.state_names)
    slopes, first_sample, next_row = np.zeros((len(likelihood.model.state_names), len(columns))), 0, 0
    squares, observation_count = 0.0, 0
    for segment in linearise_filter(likelihood, values, sample.recording, acceleration_noise_density):
        fitter.poll_interrupts()
        count = len(segment.step)
        time = ports.signals(segment).platform["time"]
        series = [column.series[None, first_sample : first_sample + count + 1] for column in columns]
        slopes, innovation_sensitivities = segment.propagate_sensitivities(
            slopes, *series_sensitivities(sites, series, initial_values, ports, segment, time)
        )
        first_sample += count
        rows = np.zeros(count, dtype=bool)
        rows[segment.is_recorded] = sample.rows[next_row : next_row + int(np.sum(segment.is_recorded))]
        next_row += int(np.sum(segment.is_recorded))
        is_observed = segment.observed[rows]
        matrix, residuals = innovation_sensitivities[rows][is_observed], segment.values[rows][is_observed]
        squares += float(residuals @ residuals)
        observation_count += len(residuals)
        inner += matrix[:, :nuisance_count].T @ matrix[:, :nuisance_count]
        cross_products += matrix[:, :nuisance_count].T @ matrix[:, nuisance_count:]
        oscillator_slopes = matrix[:, nuisance_count:].reshape(len(matrix), len(information), width)
        information += np.einsum("rfg,rfh->fgh", oscillator_slopes, oscillator_slopes, optimize=True)
        score += matrix.T @ residuals
    available_gain = 0.5 * (squares - observation_count) - CHANCE_SIGMAS * np.sqrt(0.5 * observation_count)
    return _gain_spectra(inner, cross_products, information, score, float(available_gain))


def _gain_spectra(
    inner: Array, cross_products: Array, information: Array, score: Array, available_gain: float
) -> tuple[_GainSpectrum, _GainSpectrum]:
    """Gain spectra with the nuisances projected out; ``available_gain`` is before that."""
    nuisance_count, width = len(inner), information.shape[1]
    projection = _solve_scaled(inner, np.column_stack([cross_products, score[:nuisance_count]]))
    available_gain -= 0.5 * float(score[:nuisance_count] @ projection[:, -1])
    residual_score = (score[nuisance_count:] - cross_products.T @ projection[:, -1]).reshape(-1, width)
    shaped, solved = (matrix.reshape(nuisance_count, -1, width) for matrix in (cross_products, projection[:, :-1]))
    residual_information = information - np.einsum("nfg,nfh->fgh", shaped, solved, optimize=True)
    spectra = []
    for group in (slice(0, 3), slice(3, width)):
        joint_gains = np.array(
            [_joint_gain(r[group, group], f[group]) for r, f in zip(residual_information, residual_score, strict=True)]
        )
        diagonal = np.maximum(np.diagonal(residual_information, axis1=1, axis2=2)[:, group], np.finfo(float).tiny)
        spectra.append(_GainSpectrum(joint_gains, 0.5 * residual_score[:, group] ** 2 / diagonal, available_gain))
    return spectra[0], spectra[1]


def _joint_gain(information: Array, score: Array) -> float:
    return float(0.5 * score @ _solve_scaled(information, score[:, None])[:, 0])


def _solve_scaled(information: Array, right_hand_side: Array) -> Array:
    scale = np.sqrt(np.maximum(np.diag(information), np.finfo(float).tiny))
    solved: Array = np.linalg.lstsq(
        information / np.outer(scale, scale), right_hand_side / scale[:, None], rcond=RANK_TOLERANCE
    )[0]
    return solved / scale[:, None]
