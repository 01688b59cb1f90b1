"""Compiled filter: the functions of one model's Kalman filter as machine code, each compiled at its first use.

Likelihoods that differ in numbers alone share it.
"""

from __future__ import annotations

from functools import cached_property

import casadi

from ..robot.symbolic_model import SymbolicModel, constants_as_parameters
from .integration_steps import Substeps
from .kalman_filter import Noise, filter_jacobians, filter_step
from .native_functions import CompiledFunction


class CompiledFilter:
    """Functions of a model's filter; the last ``constant_count`` states of the model are uncertain parameters.

    Of the noise only whether it has a disturbance matters, and without one its levels.
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
        self.lags = casadi.Function("lags", [model.parameters], [model.sensor_delays])

    @cached_property
    def step(self) -> CompiledFunction:
        """See :func:`tautwire.estimation.kalman_filter.filter_step`."""
        function = filter_step(self.model, self._cable_count, self._noise, self._substeps, self._has_sensitivities)
        return CompiledFunction(function, carried=3)

    @cached_property
    def jacobians(self) -> CompiledFunction:
        """See :func:`tautwire.estimation.kalman_filter.filter_jacobians`."""
        return CompiledFunction(filter_jacobians(self.model, self._cable_count, self._noise, self._substeps))

    @cached_property
    def given_constants(self) -> CompiledFilter:
        """The filter of the other states, without sensitivities; its parameters are the model's, then the constants."""
        model = constants_as_parameters(self.model, self._constant_count)
        return CompiledFilter(model, 0, self._cable_count, self._noise, self._substeps, has_sensitivities=False)
