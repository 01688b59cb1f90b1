"""Compiled filter: a model's Kalman filter as machine code, each of its functions compiled at first use.

Likelihoods that differ in numbers alone share it.
"""

from __future__ import annotations

import sys
from dataclasses import astuple, dataclass
from functools import cached_property

import casadi
import numpy as np
from casadi import SX
from numpy.typing import NDArray

from ..robot.symbolic_model import SymbolicModel, constants_as_parameters
from .covariance_recursion import Functions, Moments, Samples, empty_record, recursion_buffers, run_recursion
from .integration_steps import Substeps
from .kalman_filter import (
    Noise,
    output_function,
    preparation_function,
    process_function,
    rate_jacobians_function,
    simulation_function,
    slope_function,
    static_start_function,
    trajectory_function,
)
from .native_functions import BoundFunction, CompiledFunction
from .step_integration import Division, Integration, Step, integration_buffers

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FilterInputs:
    """Inputs of a filter over K samples.

    ``measured``, ``observed`` and ``shift`` (m, K), speed and next speed (cables, K), their bends (2 cables, K), time
    step and drift (1, K), and measured rotation (3, K), empty for a point mass, as ``columns``; for the bends see
    :mod:`tautwire.recordings.speed_interpolation`. The same for all samples are ``parameters``
    (p, 1), ``disturbance`` (see :func:`tautwire.estimation.kalman_filter.process_function`), variances of white
    noise (m,), and the density of acceleration noise.
    """

    columns: tuple[Array, ...]
    parameters: Array
    disturbance: Array
    white_variances: Array
    acceleration_noise_density: float


@dataclass(frozen=True)
class FilterState:
    """State (n,), covariance (n, n), and sensitivities (n, p) of a filter before a sample.

    The sample's outputs are linearised at the state; its prior mean is ``prior_offset`` (n,) from there.
    """

    state: Array
    prior_offset: Array
    covariance: Array
    sensitivities: Array


@dataclass(frozen=True)
class FilterResults:
    """Predicted ``states`` (n, K + 1) and whitened innovations.

    ``covariances`` of the former, ``transitions`` to the next sample (K, n, n) and ``output_matrices`` (K, m, n), none
    unless they are kept; ``values`` and ``log_variances`` (K, m), ``sensitivities`` (K, m, p); ``end`` is the state
    after the last sample. Outputs of the first one are linearised at its state, of which the prediction is
    ``prior_offset`` (n,) away.
    """

    states: Array
    prior_offset: Array
    covariances: Array
    transitions: Array
    output_matrices: Array
    values: Array
    log_variances: Array
    sensitivities: Array
    end: FilterState


@dataclass(frozen=True)
class _BoundFunctions:
    """A filter's functions, bound to the inputs of a run and to what its loops change, ``moving`` to ``index``.

    For these see :class:`tautwire.estimation.step_integration.Integration`.
    """

    static_start: BoundFunction
    outputs: BoundFunction
    preparation: BoundFunction
    part: BoundFunction
    slope: BoundFunction
    process: BoundFunction
    moving: Array
    middle: Array
    index: Array


class CompiledFilter:
    """Filter of a model whose last ``constant_count`` states are uncertain parameters.

    Of the noise only whether it has a disturbance matters, and that of winch speeds and rope lengths.
    """

    def __init__(
        self,
        model: SymbolicModel,
        constant_count: int,
        cable_count: int,
        noise: Noise,
        substeps: Substeps,
        has_sensitivities: bool = True,
    ) -> None:
        self.model = model
        self._constant_count, self._cable_count = constant_count, cable_count
        self._noise, self._substeps, self._has_sensitivities = noise, substeps, has_sensitivities
        parameters = model.parameters[: model.parameters.numel() if has_sensitivities else 0]
        start_sensitivities = casadi.jacobian(model.start, parameters)
        self.start = casadi.Function("start", [model.parameters], [model.start, start_sensitivities])
        self.settling, self.settling_slopes = _settling_states(model, constant_count)
        self.lags = casadi.Function("lags", [model.parameters], [model.sensor_delays])

    @property
    def instruction_count(self) -> int:
        """Instructions of its functions, in proportion to which it takes memory."""
        functions = (self.outputs, self.static_start, self._preparation, self._trajectory, self._slopes, self._process)
        return sum(function.instruction_count for function in functions)

    @cached_property
    def outputs(self) -> CompiledFunction:
        """See :func:`tautwire.estimation.kalman_filter.output_function`."""
        function = output_function(self.model, self._cable_count, self._noise, self._has_sensitivities)
        return CompiledFunction(function, max_compiled=sys.maxsize)

    @cached_property
    def static_start(self) -> CompiledFunction:
        """See :func:`tautwire.estimation.kalman_filter.static_start_function`."""
        function = static_start_function(self.model, self._constant_count, self._has_sensitivities)
        return CompiledFunction(function, max_compiled=sys.maxsize)

    @cached_property
    def simulation(self) -> CompiledFunction:
        """See :func:`tautwire.estimation.kalman_filter.simulation_function`; the state is carried."""
        return CompiledFunction(simulation_function(self.model, self._cable_count, self._substeps), carried=1)

    @cached_property
    def rate_jacobians(self) -> CompiledFunction:
        """See :func:`tautwire.estimation.kalman_filter.rate_jacobians_function`."""
        return CompiledFunction(rate_jacobians_function(self.model, self._cable_count))

    @cached_property
    def given_constants(self) -> CompiledFilter:
        """The filter of the other states, without sensitivities; its parameters are the model's, then the constants."""
        model = constants_as_parameters(self.model, self._constant_count)
        return CompiledFilter(model, 0, self._cable_count, self._noise, self._substeps, has_sensitivities=False)

    def first_outputs(self, state: Array, inputs: FilterInputs) -> tuple[Array, Array]:
        """Expected outputs (m,) of the first sample, and their slopes by the state (m, n), the static start held."""
        _, _, shift, speed, later, _, step, _, rotation = (column[:, :1] for column in inputs.columns)
        theta, end = inputs.parameters, self.model.states.numel()
        statics, _ = self.static_start(1, theta, state[end - self._constant_count : end, None])
        arguments = (state[:, None], theta, statics, shift, speed, later, step, rotation)
        expected, by_state, _ = self.outputs(1, *arguments)
        return expected.ravel(), by_state

    def run(self, start: FilterState, inputs: FilterInputs, keeps_covariances: bool) -> FilterResults:
        """Run over K samples."""
        sensitivities = np.ascontiguousarray(start.sensitivities.T).copy()
        moments = Moments(start.state.copy(), start.prior_offset, start.covariance.copy(), sensitivities)
        measured, observed, *_, step, _, _ = inputs.columns
        output_count, count = measured.shape
        size, parameter_count = start.sensitivities.shape
        bound = self._bind(count, moments.state, inputs)
        integration = self._integration(bound, np.ascontiguousarray(step[0]), parameter_count)
        record = empty_record((count, output_count, size, parameter_count), keeps_covariances)
        samples = Samples(np.ascontiguousarray(measured.T), np.ascontiguousarray(observed.T), inputs.white_variances)
        buffers = recursion_buffers(output_count, size, parameter_count, integration)
        functions = Functions(_step(bound.outputs), _step(bound.process))
        run_recursion(functions, integration, moments, samples, record, buffers)
        with np.errstate(invalid="ignore", divide="ignore"):
            log_variances = np.log(record.variances)
        return FilterResults(
            record.states.T,
            start.prior_offset,
            record.covariances,
            record.transitions,
            record.output_matrices,
            record.values,
            log_variances,
            record.sensitivities.swapaxes(1, 2),
            FilterState(moments.state, np.zeros(size), moments.covariance, moments.sensitivities.T),
        )

    def _bind(self, count: int, state: Array, inputs: FilterInputs) -> _BoundFunctions:
        _, _, shift, speed, later, bends, step, drift, rotation = inputs.columns
        theta, density = inputs.parameters, np.full((1, 1), inputs.acceleration_noise_density)
        first = self.model.states.numel() - self._constant_count
        static_start = self.static_start.bind(count, theta, state[first : first + self._constant_count, None])
        statics = static_start.results[0].T
        preparation = self._preparation.bind(count, state[:, None], theta, statics, step, inputs.disturbance)
        constants, index = preparation.results[0].T, np.zeros((1, 1))
        moving, middle = np.zeros((2, 1, first))
        return _BoundFunctions(
            static_start,
            self.outputs.bind(count, state[:, None], theta, statics, shift, speed, later, step, rotation),
            preparation,
            self._trajectory.bind(count, moving.T, constants, speed, later, bends, step, index),
            self._slopes.bind(count, middle.T, constants, speed, later, index),
            self._process.bind(count, step, drift, density, inputs.disturbance),
            moving,
            middle,
            index,
        )

    def _integration(self, bound: _BoundFunctions, steps: Array, parameter_count: int) -> Integration:
        slope, division, moving_count = _step(bound.slope), Division(*astuple(self._substeps)), bound.moving.shape[1]
        driving_count = bound.preparation.results[1].shape[1]
        return Integration(
            _step(bound.static_start),
            self._constant_count,
            _step(bound.preparation),
            _step(bound.part),
            slope,
            division,
            bound.moving,
            bound.middle,
            bound.index,
            steps,
            np.empty((self.model.states.numel() + driving_count, moving_count)),
            np.empty((parameter_count, moving_count)),
            integration_buffers(slope, division),
        )

    @cached_property
    def _preparation(self) -> CompiledFunction:
        function = preparation_function(self.model, self._noise, self._constant_count)
        return CompiledFunction(function, max_compiled=sys.maxsize)

    @cached_property
    def _trajectory(self) -> CompiledFunction:
        arguments = (self.model, self._cable_count, self._noise, self._substeps, self._constant_count)
        return CompiledFunction(trajectory_function(*arguments), max_compiled=sys.maxsize)

    @cached_property
    def _slopes(self) -> CompiledFunction:
        arguments = (self.model, self._cable_count, self._noise, self._substeps, self._constant_count)
        return CompiledFunction(slope_function(*arguments, self._has_sensitivities), max_compiled=sys.maxsize)

    @cached_property
    def _process(self) -> CompiledFunction:
        function = process_function(self.model, self._cable_count, self._noise)
        return CompiledFunction(function, max_compiled=sys.maxsize)


def _settling_states(model: SymbolicModel, constant_count: int) -> tuple[NDArray[np.int64], casadi.Function]:
    """Internal states of ropes that have an equilibrium, and the slopes of their rates at the start by all states."""
    internal = range(model.indices.lengths.stop, model.states.numel() - constant_count)
    settling = [index for index in internal if index not in model.drifting]
    rates, statics = model.rates_by_statics[settling] if settling else SX(0, 1), model.static_start
    through_statics = casadi.mtimes(casadi.jacobian(rates, statics.symbols), statics.jacobian(model.states))
    slopes = casadi.jacobian(rates, model.states) + through_statics
    at_rest = [casadi.densify(model.start), SX.zeros(*model.inputs.shape)]
    (at_start,) = casadi.substitute([slopes], [statics.symbols], [statics.values])
    (at_start,) = casadi.substitute([at_start], [model.states, model.inputs], at_rest)
    return np.array(settling, dtype=int), casadi.Function("settling_slopes", [model.parameters], [at_start])


def _step(function: BoundFunction) -> Step:
    return Step(function.address, function.places.ctypes.data, function.strides.ctypes.data, function.results)
