"""Hidden oscillators, degrees of freedom that the model lacks, detected by frequency and site.

An attached mass on a spring exerts ``k (u - s)`` on its carrier, with ``s`` the motion of that, and

    u'' + 2 zeta w u' + w^2 u = w^2 s + 2 zeta w s'

On the platform ``s`` is its position; at an exit point or in a compliant rope, the tension. For each frequency this
force is one more series, and its gain in log-likelihood is a spectrum that no frequency of the motion itself can fake:
where the motion has a peak, its series has that too.

Source: the tuned absorber, Den Hartog (1956), Mechanical Vibrations, sec. 3.3; Ljung (1999), sec. 11.4.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter
from threadpoolctl import threadpool_limits

from tautwire_fmu.laws.formula import FORCE_TARGETS

from ...errors import TautwireError
from ...robot.schema import Robot
from ..estimation_data import DataSet, DataSplit
from ..filter_linearisation import LinearisedSegment, linearise_filter
from ..likelihood import Likelihood
from ..parameter_fit import Fitter
from ..policy import DEFAULT_POLICY
from ..trace_result import Resonance
from .formula_ports import FormulaPorts, PortSignals, RunRows, Site, sensitivities_along_run
from .policy import ResonancePolicy

Array = NDArray[np.float64]

DAMPING_RATIO = 0.02
LOG_FREQUENCY_STEP, MAX_FREQUENCIES = 0.03, 110
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
def find_resonances(
    robot: Robot, fitter: Fitter, split: DataSplit, policy: ResonancePolicy = DEFAULT_POLICY.discovery.resonances
) -> tuple[Resonance, ...]:
    """Hidden oscillators on the platform or at the exit points, where both samples agree."""
    data_sets = [data.first(policy.max_samples) for data in (split.estimation, split.validation)]
    frequencies = _frequency_grid(data_sets, policy)
    modal_frequencies = _modal_frequencies(robot)
    spectra = [_gain_spectra_of(robot, fitter, data, frequencies, policy) for data in data_sets]
    names = split.estimation.recording.channel_names
    candidates = []
    for group, outputs in ((0, names[:3]), (1, names[3:])):
        pair = (spectra[0][group], spectra[1][group])
        if not _peaks_agree(frequencies, pair, policy):
            continue
        peak_indices = [int(np.argmax(spectrum.joint_gains)) for spectrum in pair]
        gains = [float(s.joint_gains[peak]) for s, peak in zip(pair, peak_indices, strict=True)]
        frequency = float(np.average(frequencies[peak_indices], weights=gains))
        site_gains = pair[0].site_gains[peak_indices[0]] + pair[1].site_gains[peak_indices[1]]
        affected_outputs = tuple(
            n
            for n, gain in zip(outputs, site_gains, strict=True)
            if gain >= policy.min_output_gain_ratio * np.max(site_gains)
        )
        if not np.any(np.abs(modal_frequencies - frequency) < policy.mode_tolerance * modal_frequencies):
            candidates.append((sum(gains), Resonance(frequency, affected_outputs, split.roles)))
    best = max((gain for gain, _ in candidates), default=0.0)
    return tuple(resonance for gain, resonance in candidates if gain > best / policy.min_gain_ratio)


def _frequency_grid(data_sets: Sequence[DataSet], policy: ResonancePolicy) -> Array:
    """Frequencies (F,) in Hz, evenly spaced on a logarithmic scale, that all data sets can show."""
    duration = min(data.recording.duration for data in data_sets)
    step = max(float(np.median(np.diff(data.recording.time))) for data in data_sets)
    slowest = policy.min_periods / duration
    count = min(
        MAX_FREQUENCIES, int(np.log(max(policy.max_frequency_ratio / step / slowest, 1.1)) / LOG_FREQUENCY_STEP)
    )
    grid: Array = slowest * np.exp(LOG_FREQUENCY_STEP * np.arange(count + 1))
    return grid


def _modal_frequencies(robot: Robot) -> Array:
    try:
        # Imported here: python-control takes half a second, and few commands that estimate need it.
        from ...linear import linearise

        return linearise(robot, swing=0.0).modes.frequencies
    except TautwireError:
        return np.zeros(0)


def _peaks_agree(frequencies: Array, spectra: Sequence[_GainSpectrum], policy: ResonancePolicy) -> bool:
    """Whether the spectra of both data sets have one clear peak at the same frequency."""
    duration = policy.min_periods / frequencies[0]
    peaks, other_gain, peak_gain = [], 0.0, 0.0
    for spectrum in spectra:
        index = int(np.argmax(spectrum.joint_gains))
        if index in (0, len(frequencies) - 1) or spectrum.joint_gains[index] < max(
            policy.min_sample_gain, policy.min_explained_ratio * spectrum.available_gain
        ):
            return False
        tolerance = max(1.0 / duration, policy.frequency_tolerance * frequencies[index])
        peaks.append((frequencies[index], tolerance))
        peak_gain += float(spectrum.joint_gains[index])
        other_gain += float(
            np.max(spectrum.joint_gains[np.abs(frequencies - frequencies[index]) > 2.0 * tolerance], initial=0.0)
        )
    (first, first_tolerance), (second, second_tolerance) = peaks
    min_gain_ratio = (
        policy.min_gain_ratio_of_sharp_peaks
        if abs(first - second) < policy.sharp_peak_distance * first
        else policy.min_gain_ratio
    )
    return bool(
        abs(first - second) < max(first_tolerance, second_tolerance)
        and peak_gain > policy.min_total_gain
        and peak_gain > min_gain_ratio * other_gain
    )


def _gain_spectra_of(
    robot: Robot, fitter: Fitter, data: DataSet, frequencies: Array, policy: ResonancePolicy
) -> tuple[_GainSpectrum, _GainSpectrum]:
    """Gain spectra of one data set on the platform, and in the ropes."""
    likelihood, values = fitter.likelihood(robot, (), data)
    noise_density = _sufficient_noise_density(likelihood, values, data, policy)
    robot_at_start = data.placed(robot)

    def run() -> tuple[Iterator[LinearisedSegment], FormulaPorts]:
        segments = linearise_filter(likelihood, values, data.recording, noise_density)
        return segments, FormulaPorts(robot_at_start, likelihood.model.state_names)

    segments, ports = run()
    signals = _concatenated([ports.signals(segment) for segment in segments])
    step = float(np.median(np.diff(data.recording.time)))
    nuisances = _nuisance_columns(signals, step)
    columns = [*nuisances, *_oscillator_columns(signals, step, frequencies)]

    def series_in(signals: PortSignals, first_sample: int) -> list[Array]:
        fitter.poll_interrupts()
        rows = slice(first_sample, first_sample + len(signals.platform["time"]))
        return [column.series[None, rows] for column in columns]

    run_rows = sensitivities_along_run(*run(), [column.site for column in columns], series_in, data.rows)
    equations = _normal_equations(run_rows, len(nuisances), len(frequencies), 3 + robot.cable_count)
    return _gain_spectra(equations, policy.chance_sigmas)


def _sufficient_noise_density(
    likelihood: Likelihood, values: list[float], data: DataSet, policy: ResonancePolicy
) -> float:
    """The smallest acceleration noise density under which the run follows the data; else the largest."""
    for acceleration_noise_density in policy.acceleration_noise_densities:
        innovations = likelihood.innovations(data.recording, values, acceleration_noise_density)
        if innovations.overall_mean_square(data.rows) < policy.max_innovation_variance:
            return acceleration_noise_density
    return policy.acceleration_noise_densities[-1]


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


class _NormalEquations(NamedTuple):
    """Sums of slopes of the innovations ``e`` by ``n`` nuisances ``N`` and by the oscillators ``O`` of F frequencies.

    ``nuisance_information`` is ``N' N``, ``cross_products`` ``N' O``; ``information`` (F, sites, sites) are the blocks
    of ``O' O`` within a frequency; ``score`` is ``(N, O)' e``, ``sum_of_squares`` ``e' e`` of so many observations.
    """

    nuisance_information: Array
    cross_products: Array
    information: Array
    score: Array
    sum_of_squares: float
    observation_count: int


def _normal_equations(
    run: Iterable[RunRows], nuisance_count: int, frequency_count: int, site_count: int
) -> _NormalEquations:
    """Normal equations of the nuisances and the oscillators at ``site_count`` sites, from one run of the filter."""
    oscillator_count = frequency_count * site_count
    inner, cross_products = np.zeros((nuisance_count, nuisance_count)), np.zeros((nuisance_count, oscillator_count))
    information = np.zeros((frequency_count, site_count, site_count))
    score = np.zeros(nuisance_count + oscillator_count)
    sum_of_squares, observation_count = 0.0, 0
    for part in run:
        is_observed = part.segment.observed[part.rows]
        matrix = part.sensitivities[part.rows][is_observed]
        residuals = part.segment.values[part.rows][is_observed]
        sum_of_squares += float(residuals @ residuals)
        observation_count += len(residuals)
        inner += matrix[:, :nuisance_count].T @ matrix[:, :nuisance_count]
        cross_products += matrix[:, :nuisance_count].T @ matrix[:, nuisance_count:]
        slopes = matrix[:, nuisance_count:].reshape(len(matrix), frequency_count, site_count)
        information += np.einsum("rfg,rfh->fgh", slopes, slopes, optimize=True)
        score += matrix.T @ residuals
    return _NormalEquations(inner, cross_products, information, score, sum_of_squares, observation_count)


def _gain_spectra(equations: _NormalEquations, chance_sigmas: float) -> tuple[_GainSpectrum, _GainSpectrum]:
    """Gain spectra with the nuisances projected out; the available gain is what chance does not explain."""
    inner, cross_products, information, score, sum_of_squares, observation_count = equations
    nuisance_count, width = len(inner), information.shape[1]
    chance = chance_sigmas * np.sqrt(0.5 * observation_count)
    projection = _solve_scaled(inner, np.column_stack([cross_products, score[:nuisance_count]]))
    nuisance_gain = 0.5 * float(score[:nuisance_count] @ projection[:, -1])
    available_gain = float(0.5 * (sum_of_squares - observation_count) - chance) - nuisance_gain
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
