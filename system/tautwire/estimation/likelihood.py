"""Likelihood of a recording under a robot with its effects: an extended Kalman filter's innovations.

The filter predicts each sample from all before it, so noise of the winch speeds, which integrates into a drift of
the unstrained lengths, is accounted for instead of piling up as in plain simulation. With innovations ``e_k`` of
variance ``s_k``

    log p(recording) = -1/2 sum_k (e_k^2 / s_k + log s_k + log 2 pi)

Source: Ljung (1999), System Identification, sec. 7.4.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from copy import copy
from dataclasses import replace
from math import pi

import numpy as np
from numpy.typing import NDArray

from ..recordings.recording import Recording
from ..robot.schema import Robot
from ..robot.symbolic_model import FreeParameter, SymbolicModel, symbolic_model
from ..robot.uncertain_parameters import uncertain_parameters
from .compiled_filter import CompiledFilter, FilterInputs, FilterState
from .disturbance import Disturbance
from .filter_columns import align_delayed_outputs, filter_columns, unaligned_samples
from .initial_state_prior import has_uncertain_equilibrium, initial_covariance, settled_covariance
from .innovations import FilterSegment, Innovations, concatenated
from .integration_steps import MAX_STATE_ANGLE, MAX_STATE_ANGLE_BESIDE_DISTURBANCE, substeps_of_robot
from .iterated_update import with_iterated_update
from .kalman_filter import Noise
from .measured_outputs import SimulatedOutputs, measured_outputs, orientations, require_small_rotations
from .measurement_model import output_count, rotation_count
from .native_functions import by_sample

Array = NDArray[np.float64]

# Samples of a segment: binding functions to one takes as long as 40 samples, and its covariances take memory.
SEGMENT_SAMPLES = 2_000
SEGMENT_SAMPLES_WITH_COVARIANCES = 500


class Likelihood:
    """Innovations of recordings under a robot whose free parameters vary; compiled once.

    ``poll_interrupts`` is called before each segment of a run. One step of the state turns the fastest vibration by
    ``max_state_angle`` (rad) at most, by default as finely as fits need.
    """

    def __init__(
        self,
        robot: Robot,
        free: Sequence[FreeParameter],
        noise: Noise,
        sample_time: float,
        poll_interrupts: Callable[[], None] = lambda: None,
        max_state_angle: float | None = None,
    ) -> None:
        self.poll_interrupts = poll_interrupts
        self.uncertain = uncertain_parameters(robot)
        model = symbolic_model(robot, free, self.uncertain, robot.platform.start_orientation)
        self.robot = robot
        self.noise = noise
        self.cable_count = robot.cable_count
        state_count = model.states.numel()
        has_effect_states = state_count > model.indices.lengths.stop + len(self.uncertain)
        default_angle = MAX_STATE_ANGLE_BESIDE_DISTURBANCE if noise.disturbance else MAX_STATE_ANGLE
        max_angle = default_angle if max_state_angle is None else max_state_angle
        substeps = substeps_of_robot(robot, sample_time, state_count, has_effect_states, max_angle)
        self._filter_functions = CompiledFilter(model, len(self.uncertain), robot.cable_count, noise, substeps)
        self._held_constants = np.zeros(0)

    @property
    def model(self) -> SymbolicModel:
        """The equations that the filter is made of."""
        return self._filter_functions.model

    def innovations(
        self,
        recording: Recording,
        parameters: Sequence[float] | Array,
        acceleration_noise_density: float = 0.0,
        keeps_segments: bool = False,
    ) -> Innovations:
        """Filter a recording at some values of the free parameters.

        ``acceleration_noise_density`` (m/s^2 per root hertz) adds process noise, an unknown white acceleration of the
        platform: a fit that starts far from the solution then follows the data instead of losing phase. The segments
        are kept with their covariances, which takes memory in proportion to the recording's length.
        """
        self._require_small_rotations(recording)
        measured, shift = self._aligned_outputs(recording, parameters)
        observed = np.isfinite(measured)
        covariance = self._start_covariance(parameters)
        filter_segments: Iterable[FilterSegment] = self._filter(
            recording, (measured, shift), parameters, covariance, acceleration_noise_density, keeps_segments
        )
        kept = tuple(filter_segments) if keeps_segments else ()
        values, log_variances, sensitivities, last_state = concatenated(kept or filter_segments)
        is_noise = unaligned_samples(np.isfinite(self._measured(recording)), observed)
        counted = observed | is_noise
        values[~counted] = np.nan
        log_variances[~observed] = np.nan
        _count_as_noise(values, log_variances, sensitivities, is_noise)
        size = self.model.states.numel()
        constants = last_state[size - len(self.uncertain) : size]
        return Innovations(counted, values, sensitivities, log_variances, constants, kept)

    @property
    def instruction_count(self) -> int:
        """Instructions of the filter, in proportion to which this takes memory."""
        return self._filter_functions.instruction_count

    def rate_jacobians(self, parameters: Sequence[float] | Array, states: Array, speed: Array) -> Array:
        """Jacobians of the rates by the states (K, n, n), at states (n, K) that winch speeds (cables, K) move."""
        functions, theta, count = self._filter_functions, self.arguments(parameters)[:, None], states.shape[1]
        first = len(states) - len(self.uncertain)
        statics, slopes = functions.static_start(count, theta, states[first:])
        jacobians = functions.rate_jacobians(count, states, theta, statics, speed)
        by_state, by_statics = (by_sample(each, count) for each in jacobians)
        # Uncertain constants have no rates.
        by_state[:, :first, first:] += by_statics[:, :first] @ by_sample(slopes, count)[:, :, len(theta) :]
        return by_state

    def start(self, parameters: Sequence[float] | Array) -> tuple[Array, Array]:
        """Initial state (n,) and covariance (n, n) of the filter, disturbance included."""
        state, _ = self._start(self.arguments(parameters))
        return state.ravel(), self._start_covariance(parameters)

    def with_true_lengths(self, states: Array) -> Array:
        """The model's states (n, K) of a filter's, with the errors of recorded lengths added to its unstrained lengths.

        What acts on the ropes is computed from these, see :mod:`tautwire.estimation.disturbance_symbols`.
        """
        size, count, first = self.model.states.numel(), len(self.noise.rope_lengths), self.model.indices.lengths.start
        model_states = states[:size].copy()
        model_states[first : first + count] += states[size : size + count]
        return model_states

    def with_disturbance(self, disturbance: Disturbance) -> Likelihood:
        """The same likelihood under another disturbance; it has to have one."""
        other = copy(self)
        other.noise = replace(self.noise, disturbance=disturbance)
        return other

    def given_constants(self, constants: Array) -> Likelihood:
        """The conditional likelihood given the uncertain parameters (c,), in standard deviations; no sensitivities.

        A filter of so many states less is several times as fast.
        """
        other = copy(self)
        other.uncertain = ()
        other._held_constants = constants
        other._filter_functions = self._filter_functions.given_constants
        return other

    def segments(
        self,
        recording: Recording,
        parameters: Sequence[float] | Array,
        acceleration_noise_density: float = 0.0,
        keeps_covariances: bool = True,
    ) -> Iterator[FilterSegment]:
        """The filter's run over a recording, segment by segment: memory does not grow with its length.

        For ``acceleration_noise_density`` see :meth:`innovations`.
        """
        outputs = self._aligned_outputs(recording, parameters)
        covariance = self._start_covariance(parameters)
        yield from self._filter(
            recording, outputs, parameters, covariance, acceleration_noise_density, keeps_covariances
        )

    def simulated_outputs(self, recording: Recording, parameters: Sequence[float] | Array) -> SimulatedOutputs:
        """Simulated outputs without noise, as late as the sensors show them, over a recording's winch speeds."""
        nothing = np.zeros((recording.sample_count, output_count(self.model)))
        columns, is_recorded = filter_columns(recording, nothing, nothing)
        theta, interval = self.arguments(parameters), columns[3:7]
        start, _ = (np.array(part) for part in self._filter_functions.start(theta))
        statics, _ = self._filter_functions.static_start(1, theta[:, None], start[len(start) - len(self.uncertain) :])
        _, outputs = self._filter_functions.simulation(len(is_recorded), start, theta[:, None], statics, *interval)
        lags = np.array(self._filter_functions.lags(theta)).ravel()
        time, shown = recording.time, outputs[:, is_recorded]
        rows = np.array([np.interp(time - lag, time, column) for lag, column in zip(lags, shown, strict=True)]).T
        tensions, reference = slice(3, 3 + self.cable_count), self.model.reference_orientation
        turned = orientations(rows[:, tensions.stop :], reference) if self._is_rigid else None
        return SimulatedOutputs(rows[:, :3], rows[:, tensions], turned)

    @property
    def _is_rigid(self) -> bool:
        return rotation_count(self.model) > 0

    def _measured(self, recording: Recording) -> Array:
        return measured_outputs(recording, self._is_rigid, self.model.reference_orientation)

    def _require_small_rotations(self, recording: Recording) -> None:
        if self._is_rigid:
            require_small_rotations(recording, self.model.reference_orientation)

    def _aligned_outputs(self, recording: Recording, parameters: Sequence[float] | Array) -> tuple[Array, Array]:
        lags = np.array(self._filter_functions.lags(self.arguments(parameters))).ravel()
        return align_delayed_outputs(recording.time, self._measured(recording), lags)

    def counted_as_noise(self, recording: Recording, parameters: Sequence[float] | Array) -> NDArray[np.bool_]:
        """Samples (N, m) that stand for those which a lag leaves without a state."""
        aligned, _ = self._aligned_outputs(recording, parameters)
        return unaligned_samples(np.isfinite(self._measured(recording)), np.isfinite(aligned))

    def open_loop_variances(self, recording: Recording, parameters: Sequence[float] | Array) -> Array:
        """Variance of measured less simulated, shape (N, m), where the model is right and its start exact.

        Noise of the sensors, and of the recorded winch speeds as it integrates, or errors of the recorded rope lengths
        against that of the first.
        """
        no_measurements = np.full((recording.sample_count, output_count(self.model)), np.nan)
        outputs = (no_measurements, np.zeros_like(no_measurements))
        filter_segments = self._filter(recording, outputs, parameters, self._start_covariance_of_lengths(), 0.0)
        _, log_variances, *_ = concatenated(filter_segments)
        variances: Array = np.exp(log_variances)
        return variances

    def _filter(
        self,
        recording: Recording,
        outputs: tuple[Array, Array],
        parameters: Sequence[float] | Array,
        start_covariance: Array,
        acceleration_noise_density: float,
        keeps_covariances: bool = False,
    ) -> Iterator[FilterSegment]:
        columns, is_recorded = filter_columns(recording, *outputs, rotation_count(self.model))
        theta = self.arguments(parameters)
        state, sensitivities = self._start(theta)
        now = FilterState(state.ravel(), np.zeros(len(state)), start_covariance, sensitivities)
        length = SEGMENT_SAMPLES_WITH_COVARIANCES if keeps_covariances else SEGMENT_SAMPLES
        for begin in range(0, len(is_recorded), length):
            self.poll_interrupts()
            of_segment = tuple(column[:, begin : begin + length] for column in columns)
            inputs = FilterInputs(
                of_segment,
                theta[:, None],
                self.disturbance_arguments,
                self.noise.white_variances(self.cable_count),
                acceleration_noise_density,
            )
            if begin == 0 and has_uncertain_equilibrium(self.robot):
                now = with_iterated_update(self._filter_functions, inputs, now)
            results = self._filter_functions.run(now, inputs, keeps_covariances)
            yield FilterSegment(of_segment, is_recorded[begin : begin + length], results)
            now = results.end

    def arguments(self, parameters: Sequence[float] | Array) -> Array:
        """The free parameters, then the constants that are held."""
        return np.append(np.asarray(parameters, dtype=float), self._held_constants)

    def _start(self, arguments: Array) -> tuple[Array, Array]:
        """Initial state (n, 1) and its sensitivities (n, p); disturbances start at zero."""
        state, sensitivities = (np.array(part) for part in self._filter_functions.start(arguments))
        zeros = np.zeros((len(self.noise.processes(self.cable_count)), 1 + sensitivities.shape[1]))
        return np.vstack([state, zeros[:, :1]]), np.vstack([sensitivities, zeros[:, 1:]])

    @property
    def disturbance_arguments(self) -> Array:
        """Decay rates (1/s) and variances of the states behind the model's, a column; empty where there are none."""
        processes = self.noise.processes(self.cable_count)
        rates = [2.0 * pi * process.bandwidth for process in processes]
        return np.array([*rates, *(process.rms**2 for process in processes)])[:, None]

    def _start_covariance(self, parameters: Sequence[float] | Array) -> Array:
        size, lengths = self.model.states.numel(), len(self.noise.rope_lengths)
        covariance = self._start_covariance_of_lengths()
        prior, at_rest = (
            initial_covariance(self.robot, noise, size, len(self.uncertain))
            for noise in (self.noise, self.noise.at_rest)
        )
        slopes = np.array(self._filter_functions.settling_slopes(self.arguments(parameters)))
        covariance[:size, :size] += (
            prior - at_rest + settled_covariance(at_rest, slopes, self._filter_functions.settling)
        )
        variances = [process.rms**2 for process in self.noise.processes(self.cable_count)[lengths:]]
        covariance[size + lengths :, size + lengths :] = np.diag(variances)
        return covariance

    def _start_covariance_of_lengths(self) -> Array:
        """The filter's initial covariance (n, n) where all is known but the errors of recorded lengths.

        These count from the first, whose own error is no error of the length that statics gives.
        """
        size = self.model.states.numel()
        covariance = np.zeros([size + len(self.noise.processes(self.cable_count))] * 2)
        for cable, error in enumerate(self.noise.rope_lengths):
            both = np.ix_(*[[self.model.indices.lengths.start + cable, size + cable]] * 2)
            covariance[both] = error.rms**2 * np.array([[1.0, -1.0], [-1.0, 1.0]])
        return covariance


def _count_as_noise(values: Array, log_variances: Array, sensitivities: Array, is_noise: NDArray[np.bool_]) -> None:
    """Make samples that a lag leaves without a state noise: dropping them must neither pay nor cost."""
    for column in np.flatnonzero(is_noise.any(axis=0)):
        indices = np.flatnonzero(is_noise[:, column])
        of_others = log_variances[np.isfinite(log_variances[:, column]), column]
        values[indices, column] = np.where(np.arange(len(indices)) % 2, 1.0, -1.0)
        log_variances[indices, column] = np.median(of_others) if len(of_others) else 0.0
        sensitivities[indices, column] = 0.0
