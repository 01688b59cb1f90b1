"""Measurement model: outputs of sensors that lag, with their derivatives by state and free parameters.

A sensor that shows the state of ``d`` seconds ago is given that state, to second order:

    y = h(x_d, u_d)        x_d = x - d f + d^2/2 (F f + f_u du/dt)        u_d = u - d du/dt

with the rates ``f`` and their Jacobians ``F`` and ``f_u`` at ``x``. Its derivatives are those of ``h`` there, carried
back with ``F`` and ``f_p`` as they are at ``x``:

    y_x = h_x (I - d F (I - d F / 2))        y_p = h_p - d h_x (I - d F / 2) f_p - dy/dt dd/dp
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi
from casadi import SX, Function

from ..robot.symbolic_model import SymbolicModel


@dataclass(frozen=True)
class _Motion:
    """Rates of the states, of these rates and of the inputs; Jacobians of the rates by states and parameters."""

    rates: SX
    acceleration: SX
    input_rates: SX
    by_state: SX
    by_parameters: SX


def delayed_outputs(model: SymbolicModel, cable_count: int, next_speed: SX, step: SX, shift: SX) -> SX:
    """Outputs of the sensors ``shift`` (s) after this sample: of a state ``lag - shift`` before it, where they lag.

    That is at most half a sample. ``next_speed`` are the winch speeds at the next sample, in ``step`` seconds.
    """
    motion, delays = _motion(model, cable_count, next_speed, step), model.sensor_delays - shift
    outputs = casadi.vertsplit(_sensor_outputs(model, cable_count))
    for index in _lagging_sensors(model):
        read = Function("read", [model.states, model.inputs, model.parameters], [outputs[index]])
        outputs[index] = read(*_delayed_arguments(model, motion, delays[index]), model.parameters)
    return casadi.vertcat(*outputs)


def measurement_model(model: SymbolicModel, cable_count: int) -> Function:
    """Measurement model: outputs of the sensors with their derivatives.

    Arguments: state, inputs, parameters, next winch speeds, time step, shift. Results: as :func:`delayed_outputs`, and
    its derivatives by the state (m, n) and by the parameters (m, p).
    """
    later, step, shift = SX.sym("later", cable_count), SX.sym("step"), SX.sym("shift", 3 + cable_count)
    arguments = [model.states, model.inputs, model.parameters]
    outputs = _sensor_outputs(model, cable_count)
    results = [outputs, casadi.jacobian(outputs, model.states), casadi.jacobian(outputs, model.parameters)]
    if _lagging_sensors(model):
        motion, delays = _motion(model, cable_count, later, step), model.sensor_delays - shift
        lag_sensitivities = casadi.jacobian(model.sensor_delays, model.parameters)
        rows = list(zip(*map(casadi.vertsplit, results), strict=True))
        for index in _lagging_sensors(model):
            rows[index] = _delayed_row(model, outputs[index], motion, delays[index], lag_sensitivities[index, :])
        results = [casadi.vertcat(*column) for column in zip(*rows, strict=True)]
    return Function("sensing", [*arguments, later, step, shift], results)


def _delayed_row(
    model: SymbolicModel, output: SX, motion: _Motion, delay: SX, delay_sensitivity: SX
) -> tuple[SX, SX, SX]:
    """One sensor's delayed output with its derivatives."""
    arguments = [model.states, model.inputs, model.parameters]
    read = Function("read", arguments, [output, *(casadi.jacobian(output, symbol) for symbol in arguments)])
    value, by_state, by_inputs, by_parameters = read(*_delayed_arguments(model, motion, delay), model.parameters)
    half_delayed = by_state - 0.5 * delay * casadi.mtimes(by_state, motion.by_state)
    delayed_by_state = by_state - delay * casadi.mtimes(half_delayed, motion.by_state)
    output_rate = casadi.mtimes(by_state, motion.rates - delay * motion.acceleration) + casadi.mtimes(
        by_inputs, motion.input_rates
    )
    delayed_by_parameters = (
        by_parameters - delay * casadi.mtimes(half_delayed, motion.by_parameters) - output_rate * delay_sensitivity
    )
    return value, delayed_by_state, delayed_by_parameters


def _delayed_arguments(model: SymbolicModel, motion: _Motion, delay: SX) -> tuple[SX, SX]:
    """State and inputs ``delay`` seconds ago."""
    return (
        model.states - delay * motion.rates + 0.5 * delay**2 * motion.acceleration,
        model.inputs - delay * motion.input_rates,
    )


def _motion(model: SymbolicModel, cable_count: int, next_speed: SX, step: SX) -> _Motion:
    speed_rates = casadi.if_else(step > 0.0, (next_speed - model.inputs[:cable_count]) / step, 0.0)
    input_rates = casadi.vertcat(speed_rates, SX(model.inputs.numel() - cable_count, 1))
    variables = casadi.vertcat(model.states, model.inputs)
    return _Motion(
        rates=model.rates,
        acceleration=casadi.jtimes(model.rates, variables, casadi.vertcat(model.rates, input_rates)),
        input_rates=input_rates,
        by_state=casadi.jacobian(model.rates, model.states),
        by_parameters=casadi.jacobian(model.rates, model.parameters),
    )


def _sensor_outputs(model: SymbolicModel, cable_count: int) -> SX:
    return casadi.vertcat(model.outputs[:3], model.outputs[6 : 6 + cable_count])


def _lagging_sensors(model: SymbolicModel) -> list[int]:
    """Indices of the sensors that lag at all; a lag that is free may be zero."""
    return [index for index, lag in enumerate(casadi.vertsplit(model.sensor_delays)) if not lag.is_zero()]
