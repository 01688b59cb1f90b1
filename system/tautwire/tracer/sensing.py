"""What sensors that lag show of a robot, and how that moves with its state and the free parameters.

A sensor that shows the state of ``d`` seconds ago is given that state, to second order:

    y = h(x_d, u_d)        x_d = x - d f + d^2/2 (F f + f_u du/dt)        u_d = u - d du/dt

with the rates ``f`` and their slopes ``F`` and ``f_u`` at ``x``. Its slopes are those of ``h`` there, carried back with
``F`` and ``f_p`` as they are at ``x``:

    y_x = h_x (I - d F (I - d F / 2))        y_p = h_p - d h_x (I - d F / 2) f_p - dy/dt dd/dp
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi
from casadi import SX, Function

from ..model.symbolic import Model


@dataclass(frozen=True)
class _Motion:
    """Rates of the states, of these rates and of the inputs; slopes of the rates by states and parameters."""

    rates: SX
    bend: SX
    inputs: SX
    by_state: SX
    by_parameters: SX


def shown_late(model: Model, cable_count: int, later: SX, step: SX, shift: SX) -> SX:
    """What sensors show ``shift`` (s) after this sample: of a state ``lag - shift`` before it, where they lag.

    That is at most half a sample. ``later`` are the winch speeds at the next sample, in ``step`` seconds.
    """
    motion, late = _motion(model, cable_count, later, step), model.lags - shift
    shown = casadi.vertsplit(_shown(model, cable_count))
    for index in _lagging(model):
        read = Function("read", [model.states, model.inputs, model.parameters], [shown[index]])
        shown[index] = read(*_before(model, motion, late[index]), model.parameters)
    return casadi.vertcat(*shown)


def sensing(model: Model, cable_count: int) -> Function:
    """What sensors show, with its derivatives.

    Arguments: state, inputs, parameters, next winch speeds, time step, shift. Results: as :func:`shown_late`, and its
    derivatives by the state (m, n) and by the parameters (m, p).
    """
    later, step, shift = SX.sym("later", cable_count), SX.sym("step"), SX.sym("shift", 3 + cable_count)
    at = [model.states, model.inputs, model.parameters]
    shown = _shown(model, cable_count)
    results = [shown, casadi.jacobian(shown, model.states), casadi.jacobian(shown, model.parameters)]
    if _lagging(model):
        motion, late = _motion(model, cable_count, later, step), model.lags - shift
        slopes = casadi.jacobian(model.lags, model.parameters)
        rows = list(zip(*map(casadi.vertsplit, results), strict=True))
        for index in _lagging(model):
            rows[index] = _row(model, shown[index], motion, late[index], slopes[index, :])
        results = [casadi.vertcat(*column) for column in zip(*rows, strict=True)]
    return Function("sensing", [*at, later, step, shift], results)


def _row(model: Model, shown: SX, motion: _Motion, late: SX, late_slope: SX) -> tuple[SX, SX, SX]:
    """One sensor: what it shows, and the derivatives."""
    at = [model.states, model.inputs, model.parameters]
    read = Function("read", at, [shown, *(casadi.jacobian(shown, symbol) for symbol in at)])
    value, by_state, by_inputs, by_parameters = read(*_before(model, motion, late), model.parameters)
    turned = by_state - 0.5 * late * casadi.mtimes(by_state, motion.by_state)
    moved = by_state - late * casadi.mtimes(turned, motion.by_state)
    rate = casadi.mtimes(by_state, motion.rates - late * motion.bend) + casadi.mtimes(by_inputs, motion.inputs)
    sensitive = by_parameters - late * casadi.mtimes(turned, motion.by_parameters) - rate * late_slope
    return value, moved, sensitive


def _before(model: Model, motion: _Motion, late: SX) -> tuple[SX, SX]:
    """State and inputs so many seconds ago."""
    return model.states - late * motion.rates + 0.5 * late**2 * motion.bend, model.inputs - late * motion.inputs


def _motion(model: Model, cable_count: int, later: SX, step: SX) -> _Motion:
    slope = casadi.if_else(step > 0.0, (later - model.inputs[:cable_count]) / step, 0.0)
    inputs = casadi.vertcat(slope, SX(model.inputs.numel() - cable_count, 1))
    moved = casadi.vertcat(model.states, model.inputs)
    return _Motion(
        rates=model.rates,
        bend=casadi.jtimes(model.rates, moved, casadi.vertcat(model.rates, inputs)),
        inputs=inputs,
        by_state=casadi.jacobian(model.rates, model.states),
        by_parameters=casadi.jacobian(model.rates, model.parameters),
    )


def _shown(model: Model, cable_count: int) -> SX:
    return casadi.vertcat(model.outputs[:3], model.outputs[6 : 6 + cable_count])


def _lagging(model: Model) -> list[int]:
    """Places of the sensors that lag at all; a lag that is free may be zero."""
    return [index for index, lag in enumerate(casadi.vertsplit(model.lags)) if not lag.is_zero()]
