"""The operating point: unstrained lengths and effect states at which the cables hold the platform at rest."""

from __future__ import annotations

from collections.abc import Sequence

import casadi
import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.mathematics import REAL

from ..array_validation import validate_point
from ..errors import TautwireError
from ..robot.schema import Robot
from ..robot.static_equilibrium import cable_routes, static_tensions
from ..robot.symbolic_model import SymbolicModel

Array = NDArray[np.float64]

SLACK_FRACTION = 1e-9
SLACK_LENGTH_FRACTIONS = (1e-6, 1e-5, 1e-4, 1e-3)
MAX_ITERATIONS = 50
NEWTON_TOLERANCE = 1e-10
ACCELERATION_TOLERANCE = 1e-6


class OperatingPointError(TautwireError):
    """No equilibrium was found, or none about which the platform oscillates; carries position (m) and reason."""

    def __init__(self, robot: str, position: Sequence[float] | Array, reason: str) -> None:
        self.position = tuple(float(coordinate) for coordinate in position)
        self.reason = reason
        super().__init__(f"{robot}: {reason} at [{format_position(position)}] m")


def format_position(position: Sequence[float] | Array) -> str:
    """Formats a position for messages."""
    return ", ".join(f"{coordinate:g}" for coordinate in position)


def requested_position(robot: Robot, at: Sequence[float] | Array | None) -> Array:
    """The requested position in m, by default the start; raises ArgumentError if it is invalid."""
    return np.array(robot.platform.start if at is None else validate_point("at", at))


def slack_cables(tensions: Array) -> NDArray[np.intp]:
    """Indices, from 0, of the cables that carry nothing."""
    return np.flatnonzero(tensions <= SLACK_FRACTION * np.max(tensions))


def equilibrium_state(robot: Robot, model: SymbolicModel, position: Array, tensions: Array) -> Array:
    """Equilibrium state of the model at a position (m) under static tensions (n,) in N.

    A slack cable is a little longer than its span, so that its law is smooth there.

    Raises OperatingPointError where an effect never settles or something else moves the platform.
    """
    for slack_length in SLACK_LENGTH_FRACTIONS:
        state = _solve_equilibrium(robot, model, position, tensions, slack_length)
        rates, outputs = _evaluate_model(model, state)
        slack = slack_cables(tensions)
        if np.all(outputs[6:][slack] <= SLACK_FRACTION * np.max(tensions)):
            break
    residual_acceleration = float(np.max(np.abs(rates[3:6])))
    if residual_acceleration > ACCELERATION_TOLERANCE * max(robot.gravity, 1.0):
        raise OperatingPointError(
            robot.name,
            position,
            f"the platform accelerates by {residual_acceleration:.3g} m/s2 under static tensions",
        )
    return state


def _solve_equilibrium(
    robot: Robot, model: SymbolicModel, position: Array, tensions: Array, slack_length: float
) -> Array:
    """Newton's method on unstrained lengths and states of effects.

    Least-norm steps leave an undetermined state (hysteresis of strands) at its initial value.
    """
    count = robot.cable_count
    taut = np.setdiff1d(np.arange(count), slack_cables(tensions)).tolist()
    excess = model.span_tensions / casadi.DM(np.maximum(tensions, np.finfo(float).tiny)) - 1.0
    residual = casadi.vertcat(excess[taut], model.rates[6 + count :])
    jacobian = casadi.jacobian(residual, model.states[6:])
    equations = casadi.Function("rest", [model.states, model.inputs], [residual, jacobian])
    state = np.concatenate([position, np.zeros(model.states.numel() - 3)])
    state[6 : 6 + count] = _initial_lengths(robot, position, tensions, slack_length)
    zero_inputs = np.zeros(model.inputs.numel())
    for _ in range(MAX_ITERATIONS):
        residual_value, jacobian_value = (np.asarray(value, dtype=float) for value in equations(state, zero_inputs))
        if not (np.all(np.isfinite(residual_value)) and np.all(np.isfinite(jacobian_value))):
            break
        if np.max(np.abs(residual_value), initial=0.0) <= NEWTON_TOLERANCE:
            return state
        state[6:] -= np.linalg.lstsq(jacobian_value, residual_value.ravel(), rcond=None)[0]
    raise OperatingPointError(robot.name, position, "no equilibrium found; the states of an effect may never converge")


def _initial_lengths(robot: Robot, position: Array, tensions: Array, slack_length: float) -> Array:
    """Unstrained lengths by the inverse of the logarithmic law with the declared stiffness, in m."""
    lengths: Array = np.array([line.length for line in cable_routes(REAL, robot, position.tolist())])
    stiffness = np.array([cable.modulus * cable.area for cable in robot.cables])
    unstrained_lengths: Array = lengths * np.exp((static_tensions(robot) - tensions) / stiffness)
    unstrained_lengths[slack_cables(tensions)] *= 1.0 + slack_length
    return unstrained_lengths


def _evaluate_model(model: SymbolicModel, state: Array) -> tuple[Array, Array]:
    function = casadi.Function("model", [model.states, model.inputs], [model.rates, model.outputs])
    rates, outputs = function(state, np.zeros(model.inputs.numel()))
    return np.asarray(rates, dtype=float).ravel(), np.asarray(outputs, dtype=float).ravel()
