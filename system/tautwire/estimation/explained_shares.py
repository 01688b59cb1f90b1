"""Shares of what the declared robot misses: how much each effect explains, and how much is left.

Misses are those of simulations on unseen data, beyond what the sensors' noise leaves. With the mean squares ``e^2`` of
an error and ``s^2`` of noise, of positions, tensions and orientation,

    M = sum over these of max(e^2 / s^2 - 1, 0)        share = (M without the effect - M) / (M without any effect)

at most what all effects explain together. Shares need not sum to one: what two effects explain together counts for
both. Without an effect all else stays as it is, the initial state included. An effect that acts on several cables with
a value each is one effect.

An effect is the same from beginning to end; what is only like it now and then would need another size on each stretch.
One whose state settles has a time constant that shows; without, it is only like another effect: a relaxation that takes
far longer than the motion is a modulus, a far faster one damping. A slow drift stays a drift. Effects of which each
changes far more than is missed, and than all of them together, nearly cancel each other, and what they leave shows none
of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from statistics import median

import numpy as np
from numpy.typing import NDArray
from scipy.signal import periodogram
from scipy.stats import t as students_t

from ..cosimulation.robot_cosimulation import CosimulationResult
from ..number_format import format_significant
from ..recordings.recording import Recording
from ..robot.schema import Robot
from .cosimulation_validation import noise_floor, output_errors
from .disturbance import sensor_noise_only
from .estimation_data import DataSet
from .hypotheses import Hypothesis
from .identification_context import IdentificationContext
from .likelihood import Likelihood
from .measured_outputs import Outputs, SimulatedOutputs, measured_outputs, output_names, output_residuals
from .parameter_fit import Fit, Fitter
from .policy import SizePolicy
from .smoothed_states import calibrate, calibrated_robot, with_initial_state
from .trace_result import Comparison, Errors

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ExplainedShares:
    """Shares of the effects and of what is left, from 0 to 1, and sizes in standard deviations of one sample's noise.

    ``sizes`` are those of what each effect changes in the outputs, ``spreads`` how much they differ by stretch, see
    :func:`amplitude_spread`, and ``time_deviations`` how well their time constants show, see the function of that name.
    ``size_missed`` is the size of what the robot without effects misses beside noise, its
    uncertain numbers at their best, ``size_left`` that of what is left, and ``size_together`` that of what all effects
    change, the uncertain numbers as they are beside them.
    """

    effects: tuple[float, ...]
    sizes: tuple[float, ...]
    spreads: tuple[float, ...]
    time_deviations: tuple[float, ...]
    left: float
    size_missed: float
    size_left: float
    size_together: float

    @property
    def explained(self) -> float:
        """Share that all effects explain together."""
        return 1.0 - self.left

    def substantial(self, policy: SizePolicy) -> list[int]:
        """Indices of the effects that matter, the largest first.

        Their shares are worth a name, and more than the form of the largest may leave; their sizes are beyond noise,
        not far beyond what is missed, and about the same on all stretches; their time constants show.
        """
        shown = set(self.steady(policy)) & set(self.timed(policy)) & set(self.uncancelled(policy))
        ranked = sorted(shown, key=lambda index: (-self.effects[index], index))
        least = max(policy.min_share, policy.max_left_share_of_form * max(self.effects, default=0.0))
        return [i for i in ranked if self.effects[i] >= least and self.sizes[i] >= policy.min_size]

    def explains(self, policy: SizePolicy) -> bool:
        """Whether effects that matter explain enough for a name where much is left."""
        large = self.substantial(policy)
        explained = max((self.explained, *(self.effects[index] for index in large)))
        return bool(large) and explained >= policy.min_explained_share

    def steady(self, policy: SizePolicy) -> list[int]:
        """Indices of the effects that have about the same size on all stretches."""
        return [index for index, spread in enumerate(self.spreads) if spread <= policy.max_amplitude_spread]

    def uncancelled(self, policy: SizePolicy) -> list[int]:
        """Indices of the effects that change the outputs by few times what is missed: none nearly cancels another.

        Or by few times what all together change: uncertain numbers may imitate one so well that little is missed.
        """
        largest = policy.max_size_to_missed * max(self.size_missed, self.size_together)
        return [index for index, size in enumerate(self.sizes) if size <= largest]

    def timed(self, policy: SizePolicy) -> list[int]:
        """Indices of the effects whose time constants the recordings determine, or that have none."""
        deviations = enumerate(self.time_deviations)
        return [index for index, deviation in deviations if deviation <= policy.max_time_deviation]


def explained_shares(
    context: IdentificationContext,
    declared: Fitter,
    fit: Fit,
    accepted: Sequence[Hypothesis],
    data: DataSet,
    after: Comparison,
) -> ExplainedShares:
    """Shares of the accepted effects of a fit's robot, on some data.

    ``declared`` fits the robot without effects, ``after`` compares the robot with them.
    """
    robot = fit.robot
    floor = sensor_noise_floor(context.fitter, robot, data)
    at_start = with_initial_state(context.fitter, robot, data)
    names = list(dict.fromkeys(hypothesis.effect.name for hypothesis in accepted))
    without_any = reduce(lambda each, name: as_declared(each, name, accepted, context.robot), names, at_start)
    robots = [at_start, without_any, *(as_declared(at_start, name, accepted, context.robot) for name in names)]
    complete, outputs_without_any, *without = (simulated_outputs(context.fitter, each, data) for each in robots)
    recording, outputs_without = after.recording, dict(zip(names, without, strict=True))
    missed = missed_without_effects(context, declared, data, floor)
    left = _missed(recording, after.after, floor)
    total = max(missed, left, np.finfo(float).tiny)
    outputs = [outputs_without[hypothesis.effect.name] for hypothesis in accepted]
    residual, noise = output_residuals(recording, complete), floor.by_output
    changes = [output_residuals(complete, each) for each in outputs]
    # Without one effect the others may miss more than the robot without any.
    explained = 1.0 - left / total
    return ExplainedShares(
        tuple(float(np.clip((_missed(recording, each, floor) - left) / total, 0.0, explained)) for each in outputs),
        tuple(_size(change, recording, floor) for change in changes),
        tuple(
            amplitude_spread(residual / noise, change / noise, data.rows, context.policy.stability.stretches)
            for change in changes
        ),
        time_deviations(fit, accepted),
        float(np.clip(left / total, 0.0, 1.0)),
        missed**0.5,
        left**0.5,
        _size(output_residuals(complete, outputs_without_any), recording, floor),
    )


def amplitude_spread(residual: Array, signature: Array, rows: NDArray[np.bool_], stretch_count: int) -> float:
    """Half-width of the 95 % interval of an effect's amplitude, relative to it, by its spread over stretches.

    With the residual r and what the effect changes, d, (N, m) both over noise, of the B stretches of the ``rows`` (N,)

        c_b = sum of r d on stretch b     E_b = sum of d^2 there     w = t sqrt(B / (B - 2) sum_b u_b^2) / sum_b E_b
        u_b = c_b - E_b (a + s ln(mean of d^2 on stretch b)),     |s| <= |1 + a| / 2

    with t Student's of B - 2 degrees. The slope s, by least squares beside one over b, weighed by 1 / E_b, is that of
    an effect by another power of its signature than the formula's, 1 + 2 s / (1 + a): drag that is linear in speed has
    s = -(1 + a) / 4. What goes with time as well counts as a change. NaN entries of r do not count.
    """
    is_counted = np.isfinite(residual) & rows[:, None]
    by_sample = (residual * signature, signature**2, 1.0)
    by_row = [np.where(is_counted, values, 0.0).sum(axis=1)[rows] for values in by_sample]
    by_stretch, energy, count = (np.array([part.sum() for part in np.array_split(v, stretch_count)]) for v in by_row)
    energy = energy + np.finfo(float).tiny
    amplitude = float(by_stretch.sum() / energy.sum())
    regressors = np.column_stack([np.log(energy / np.maximum(count, 1.0)), np.arange(stretch_count)])
    regressors -= np.average(regressors, axis=0, weights=energy)
    weights = np.sqrt(energy / energy.max())
    changes = by_stretch / energy - amplitude
    slope = np.linalg.lstsq(regressors * weights[:, None], changes * weights, rcond=None)[0][0]
    largest = abs(1.0 + amplitude) / 2.0
    left = by_stretch - energy * (amplitude + np.clip(slope, -largest, largest) * regressors[:, 0])
    spread = np.sqrt(stretch_count / (stretch_count - 2) * (left @ left))
    return float(students_t.ppf(0.975, stretch_count - 2) * spread / energy.sum())


def time_deviations(fit: Fit, accepted: Sequence[Hypothesis]) -> tuple[float, ...]:
    """Relative standard deviations of the effects' best determined time constants, by curvature.

    An effect with a value for each cable has their median. Zero where an effect has no time constant, and where it
    drifts: a drift that takes far longer than the recording is the same effect.
    """
    own = [_time_deviation(fit, hypothesis) for hypothesis in accepted]
    return tuple(
        median(value for value, other in zip(own, accepted, strict=True) if other.effect is each.effect)
        for each in accepted
    )


def _time_deviation(fit: Fit, hypothesis: Hypothesis) -> float:
    if any(state.drifts for state in hypothesis.effect.states):
        return 0.0
    times = [parameter.name for parameter in hypothesis.parameters if parameter.is_time_constant]
    indices = [fit.parameter_index(hypothesis.effect.name, hypothesis.cables, name) for name in times]
    return min((float(fit.standard_deviations[index] / fit.values[index]) for index in indices), default=0.0)


def missed_without_effects(context: IdentificationContext, declared: Fitter, data: DataSet, floor: Errors) -> float:
    """What the robot without effects misses: the less of as declared and with its uncertain numbers as FIT has them."""
    max_sigmas = context.policy.size.max_calibration_sigmas
    calibration = calibrate(declared, context.robot, context.split.estimation).clipped(max_sigmas)
    calibrated = calibration.calibrated_robot(context.robot)
    recording = calibrate(declared, calibrated, data).clipped(max_sigmas).without_sensor_errors(data.recording)
    outputs, outputs_as_declared = (
        simulated_outputs(declared, with_initial_state(declared, each, data), data)
        for each in (calibrated, context.robot)
    )
    # Numbers that a wrong model fitted to one recording may be worse on another than those declared.
    return min(_missed(recording, outputs, floor), _missed(data.recording, outputs_as_declared, floor))


def missed_on_validation(context: IdentificationContext, *robots: Robot) -> tuple[list[float], Errors]:
    """What robots with their effects, calibrated on FIT, miss on CHECK beside noise, and that noise: the last one's."""
    estimation, validation = context.split.estimation, context.split.validation
    calibrated = [calibrated_robot(context.fitter, robot, estimation) for robot in robots]
    floor = sensor_noise_floor(context.fitter, calibrated[-1], validation)
    return [missed_with_effects(context.fitter, robot, validation, floor) for robot in calibrated], floor


def missed_with_effects(fitter: Fitter, robot: Robot, data: DataSet, floor: Errors) -> float:
    """What a robot with its effects misses."""
    recording = calibrate(fitter, robot, data).without_sensor_errors(data.recording)
    return _missed(recording, simulated_outputs(fitter, with_initial_state(fitter, robot, data), data), floor)


def simulated_outputs(fitter: Fitter, robot: Robot, data: DataSet) -> SimulatedOutputs:
    """Simulated outputs of a robot, from its initial state, over a recording's winch speeds.

    They are those of the co-simulated FMUs within the accuracy of integration, in a tenth of the time.
    """
    interval = float(np.median(np.diff(data.recording.time)))
    likelihood = Likelihood(robot, (), replace(fitter.noise, disturbance=None), interval, fitter.poll_interrupts)
    return likelihood.simulated_outputs(data.recording, ())


def sensor_noise_floor(fitter: Fitter, robot: Robot, data: DataSet) -> Errors:
    """Errors that noise of the sensors and winch speeds alone would leave, without a force on the platform.

    They are those of the robot without its effects, on which they hardly depend: with a rope's friction that is far
    stiffer than the rope, the variances grow without bound.
    """
    noise, robot = fitter.noise, replace(robot, effects=())
    if noise.disturbance:
        limited = sensor_noise_only(noise.disturbance, noise.position, noise.tension, noise.rotation)
        fitter = fitter.with_disturbance(limited)
    return noise_floor(fitter, robot, data)


def as_declared(robot: Robot, name: str, accepted: Sequence[Hypothesis], declared: Robot) -> Robot:
    """A robot without an accepted effect, or with the values that the declared robot has where it has the effect."""
    removed = [hypothesis.cables for hypothesis in accepted if hypothesis.effect.name == name]
    others = [s for s in robot.effects if s.name != name or s.cables not in removed]
    is_declared = [s for s in declared.effects if s.name == name]
    on_platform = [s for s in is_declared if not s.cables]
    on_cables = [
        replace(s, cables=shared)
        for s in is_declared
        for cables in removed
        if (shared := tuple(cable for cable in s.cables if cable in cables))
    ]
    return replace(robot, effects=(*others, *on_platform, *on_cables))


def _missed(recording: Recording, outputs: Outputs, floor: Errors) -> float:
    errors = output_errors(recording, outputs)
    pairs = zip(errors.by_kind, floor.by_kind, strict=True)
    return float(sum(max((error / least) ** 2 - 1.0, 0.0) for error, least in pairs if error == error))


def _size(change: Array, recording: Recording, floor: Errors) -> float:
    """Size of a change of the outputs (N, m), where they were measured, over the noise of one sample."""
    measured = measured_outputs(recording, is_rigid=len(floor.rotations) > 0)
    squares = np.where(np.isfinite(measured), change, np.nan) ** 2
    parts = zip(np.split(squares, [3, 3 + recording.cable_count], axis=1), floor.by_kind, strict=True)
    means = [float(np.nanmean(part)) / least**2 for part, least in parts if np.isfinite(part).any()]
    return float(sum(means) ** 0.5)


@dataclass(frozen=True)
class RemainingError:
    """Error that is left, of the output of which it is largest over noise.

    Its root mean square, that of noise alone, both in ``unit``, and its main frequency in Hz.
    """

    output: str
    rms: float
    noise: float
    unit: str
    frequency: float

    @property
    def sentence(self) -> str:
        """In words."""
        rms, noise = format_significant(self.rms, 3), format_significant(self.noise, 2)
        error = f"{rms} {self.unit} in {self.output}, where noise leaves {noise} {self.unit}"
        return f"{error}; it is strongest at {self.frequency:.2g} Hz"


def remaining_error(recording: Recording, motion: CosimulationResult, floor: Errors) -> RemainingError:
    """The output whose error exceeds its noise most, with the strongest line of the error's spectrum."""
    residual, noise = output_residuals(recording, motion), floor.by_output
    rms = np.array([np.sqrt(np.mean(c[np.isfinite(c)] ** 2)) if np.isfinite(c).any() else 0.0 for c in residual.T])
    index = int(np.argmax(np.nan_to_num(rms / noise)))
    is_measured = np.isfinite(residual[:, index])
    time = recording.time
    grid = np.linspace(time[0], time[-1], len(time))
    evenly_sampled = np.interp(grid, time[is_measured], residual[is_measured, index])
    frequency, power = periodogram(evenly_sampled, fs=1.0 / (grid[1] - grid[0]), window="hann")
    strongest = float(frequency[1 + int(np.argmax(power[1:]))])
    names = output_names(recording.cable_count, is_rigid=True)
    scale, unit = (1e3, "mm") if index < 3 else (1.0, "N") if index < 3 + recording.cable_count else (1e3, "mrad")
    return RemainingError(names[index], scale * float(rms[index]), scale * float(noise[index]), unit, strongest)
