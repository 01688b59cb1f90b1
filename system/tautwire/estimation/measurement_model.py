"""Measurement model: outputs of sensors that lag, with their derivatives by state and free parameters.

A sensor that shows the state of ``d`` seconds ago is given that state, to second order:

    y = h(x_d, u_d)        x_d = x - d f + d^2/2 (F f + f_u du/dt)        u_d = u - d du/dt

with the rates ``f`` and their Jacobians ``F`` and ``f_u`` at ``x``. Its derivatives are those of ``h`` there, carried
back with ``F`` and ``f_p`` as they are at ``x``:

    y_x = h_x (I - d F (I - d F / 2))        y_p = h_p - d h_x (I - d F / 2) f_p - dy/dt dd/dp

An orientation is an output by its difference to the measured one q, ``log(exp(r) q^-1)`` with the state's rotation
vector r, as in a multiplicative extended Kalman filter: what is measured of that is zero, whatever the orientation.
Source: Markley (2003), Journal of Guidance, Control, and Dynamics 26(2), 311-317.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi
from casadi import SX, Function

from tautwire_fmu.laws.rotation import multiply, quaternion_of, rotation_vector_of
from tautwire_fmu.laws.vectors import Vector, scale

from ..robot.platform_symbols import vector_of
from ..robot.symbolic_equations import CASADI_MATHEMATICS
from ..robot.symbolic_model import SymbolicModel


@dataclass(frozen=True)
class _Motion:
    """Rates of the states, of these rates and of the inputs; Jacobians of the rates by states and parameters."""

    rates: SX
    acceleration: SX
    input_rates: SX
    by_state: SX
    by_parameters: SX


@dataclass(frozen=True)
class SensorInstant:
    """What outputs depend on beside the model: a sample's instant, its symbols in the order of their columns.

    ``next_speed`` (n) are the winch speeds at the next sample, in ``step`` seconds; a sensor shows the state ``shift``
    (m) seconds later; ``measured_rotation`` (3) is what the tracker shows of a platform that turns, as a rotation
    vector in rad, empty for a point mass.
    """

    next_speed: SX
    step: SX
    shift: SX
    measured_rotation: SX

    @classmethod
    def of(cls, model: SymbolicModel) -> SensorInstant:
        """New symbols for a model."""
        return cls(
            SX.sym("later", model.indices.cable_count),
            SX.sym("step"),
            SX.sym("shift", output_count(model)),
            SX.sym("measured_rotation", rotation_count(model)),
        )

    @property
    def symbols(self) -> list[SX]:
        """All of them."""
        return [self.next_speed, self.step, self.shift, self.measured_rotation]


def output_count(model: SymbolicModel) -> int:
    """Number m of outputs: x, y, z, tensions, and where the platform turns its rotation about each axis."""
    return int(model.sensor_delays.numel())


def rotation_count(model: SymbolicModel) -> int:
    """Number of rotations among the outputs: three where the platform turns, else none."""
    return model.indices.degrees_of_freedom - 3


def delayed_outputs(model: SymbolicModel, cable_count: int, instant: SensorInstant) -> SX:
    """Outputs of the sensors ``shift`` (s) after this sample: of a state ``lag - shift`` before it, where they lag.

    That is at most half a sample.
    """
    motion = _motion(model, cable_count, instant.next_speed, instant.step)
    delays = model.sensor_delays - instant.shift
    outputs = casadi.vertsplit(_sensor_outputs(model, instant.measured_rotation))
    for index in _lagging_sensors(model):
        arguments = [model.states, model.inputs, model.parameters, instant.measured_rotation]
        read = Function("read", arguments, [outputs[index]])
        outputs[index] = read(*_delayed_arguments(model, motion, delays[index]), *arguments[2:])
    return casadi.vertcat(*outputs)


def measurement_model(model: SymbolicModel, cable_count: int) -> Function:
    """Measurement model: outputs of the sensors with their derivatives.

    Arguments: state, inputs, parameters, and the symbols of a :class:`SensorInstant`. Results: as
    :func:`delayed_outputs`, and its derivatives by the state (m, n) and by the parameters (m, p).
    """
    instant = SensorInstant.of(model)
    arguments = [model.states, model.inputs, model.parameters]
    outputs = _sensor_outputs(model, instant.measured_rotation)
    results = [outputs, casadi.jacobian(outputs, model.states), casadi.jacobian(outputs, model.parameters)]
    if _lagging_sensors(model):
        motion = _motion(model, cable_count, instant.next_speed, instant.step)
        rows = list(zip(*map(casadi.vertsplit, results), strict=True))
        for index in _lagging_sensors(model):
            rows[index] = _delayed_row(model, instant, motion, index, outputs[index])
        results = [casadi.vertcat(*column) for column in zip(*rows, strict=True)]
    return Function("sensing", [*arguments, *instant.symbols], results)


def _delayed_row(
    model: SymbolicModel, instant: SensorInstant, motion: _Motion, index: int, output: SX
) -> tuple[SX, SX, SX]:
    """One sensor's delayed output with its derivatives."""
    delay = model.sensor_delays[index] - instant.shift[index]
    delay_sensitivity = casadi.jacobian(model.sensor_delays[index], model.parameters)
    variables, fixed = [model.states, model.inputs, model.parameters], instant.measured_rotation
    results = [output, *(casadi.jacobian(output, symbol) for symbol in variables)]
    read = Function("read", [*variables, fixed], results)
    delayed = _delayed_arguments(model, motion, delay)
    value, by_state, by_inputs, by_parameters = read(*delayed, model.parameters, fixed)
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


def _sensor_outputs(model: SymbolicModel, measured_rotation: SX) -> SX:
    """Positions, tensions, and the small rotation that takes the measured orientation to the state's, in rad."""
    outputs = [model.outputs[:3], model.outputs[model.indices.tensions]]
    if rotation_count(model):
        rotation = model.outputs[model.indices.pose][3:]
        outputs += rotation_between(vector_of(measured_rotation), vector_of(rotation))
    return casadi.vertcat(*outputs)


def rotation_between(start: Vector, end: Vector) -> Vector:
    """Rotation vector, in rad, from one rotation vector's orientation to another's: ``log(exp(end) exp(-start))``."""
    turned = quaternion_of(CASADI_MATHEMATICS, end)
    back = quaternion_of(CASADI_MATHEMATICS, scale(-1.0, start))
    return rotation_vector_of(CASADI_MATHEMATICS, multiply(turned, back))


def _lagging_sensors(model: SymbolicModel) -> list[int]:
    """Indices of the sensors that lag at all; a lag that is free may be zero."""
    return [index for index, lag in enumerate(casadi.vertsplit(model.sensor_delays)) if not lag.is_zero()]
