"""States of a disturbance behind those of a robot's model, as CasADi expressions of a filter's step.

Each decays, and noise is added to it; errors e of recorded rope lengths and forces F drive the model meanwhile:

    x(t + h) = f(x(t), e(t), F(t) e^(-a h / 2))      d(t + h) = e^(-a h) d(t) + w      var w = s^2 (1 - e^(-2 a h))

The rms of a force is fitted, that of a length is given: held over a step, its error has the spectral density at zero
``h s^2 coth(a h / 2)``, that of the process within ``(a h)^2 / 12``; decaying it would be less by ``e^(-a h)``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import casadi
from casadi import SX

from ..robot.platform_symbols import StateIndices
from ..robot.symbolic_model import SymbolicModel


class DisturbanceSymbols:
    """States of a disturbance: errors of recorded rope lengths, wrench, and errors of the outputs; any may be absent.

    ``arguments`` are their decay rates (1/s) and variances; the first ``driving_count`` states act on the robot.
    """

    def __init__(self, indices: StateIndices, length_count: int, output_count: int) -> None:
        self._lengths = slice(indices.lengths.start, indices.lengths.start + length_count)
        self._length_count, self._output_count = length_count, output_count
        self._force_count = indices.degrees_of_freedom if output_count else 0
        self.driving_count = length_count + self._force_count
        self.count = self.driving_count + output_count
        self._decay_rates, self._variances = SX.sym("decay_rate", self.count), SX.sym("variance", self.count)
        self._driving = SX.sym("driving", self.driving_count)
        self.arguments = casadi.vertcat(self._decay_rates, self._variances)

    def with_true_lengths(self, state: SX, model_size: int) -> SX:
        """The model's states of a filter's, with the errors of recorded lengths added to its unstrained lengths."""
        model_state = SX(state[:model_size])
        model_state[self._lengths] += state[model_size : model_size + self._length_count]
        return model_state

    def added_to(self, outputs: Sequence[SX], state: SX) -> Sequence[SX]:
        """Outputs, and their derivatives by state and parameters, with the errors of sensors."""
        expected, by_state, by_parameters = outputs
        if not self.count:
            return outputs
        by_driving = casadi.horzcat(by_state[:, self._lengths], SX(expected.numel(), self._force_count))
        errors = state[state.numel() - self._output_count :] if self._output_count else SX(expected.numel(), 1)
        by_errors = SX.eye(expected.numel()) if self._output_count else SX(expected.numel(), 0)
        return expected + errors, casadi.horzcat(by_state, by_driving, by_errors), by_parameters

    def decay(self, step: SX) -> SX:
        """Factors by which the states decay in a step."""
        return casadi.exp(-self._decay_rates * step)

    def process_noise(self, step: SX) -> SX:
        """Variances that a step adds to the states."""
        return self._variances * (1.0 - casadi.exp(-2.0 * self._decay_rates * step))

    def driven(self, model: SymbolicModel) -> SymbolicModel:
        """The model with constant errors of lengths, and a constant wrench on the platform, as its last parameters."""
        if not self.count:
            return model
        inputs = SX(model.inputs)
        inputs[model.inputs.numel() - self._force_count :] += self._driving[self._length_count :]
        states = SX(model.states)
        states[self._lengths] += self._driving[: self._length_count]
        expressions = [model.rates, model.rates_by_statics]
        rates, by_statics = casadi.substitute(expressions, [model.states, model.inputs], [states, inputs])
        parameters = casadi.vertcat(model.parameters, self._driving)
        return replace(model, rates=rates, rates_by_statics=by_statics, parameters=parameters)

    def mean_driving(self, state: SX, step: SX) -> SX:
        """Means over a step of what drives the model, of the states behind it."""
        size = state.numel() - self.count
        mean: SX = self.mean_decay(step) * state[size : size + self.driving_count]
        return mean

    def mean_decay(self, step: SX) -> SX:
        """What the states that drive the model are multiplied by, for their means over a step."""
        force_decay = self.decay(0.5 * step)[self._length_count : self.driving_count]
        return casadi.vertcat(SX.ones(self._length_count), force_decay)
