"""Where a robot rests: the unstrained lengths and states of effects at which its cables hold the platform."""

from __future__ import annotations

from collections.abc import Sequence

import casadi
import numpy as np
from numpy.typing import NDArray

from tautwire_fmu.laws.mathematics import REAL

from ..array_arguments import point_of
from ..errors import TautwireError
from ..model.symbolic import Model
from ..robots.robot import Robot
from ..statics.equilibrium import routes, static_tensions

Array = NDArray[np.float64]

SLACK = 1e-9
LET_OUT = (1e-6, 1e-5, 1e-4, 1e-3)
ITERATIONS = 50
CONVERGED = 1e-10
AT_REST = 1e-6


class OperatingPointError(TautwireError):
    """No state of rest was found, or none about which the platform oscillates; carries position (m) and reason."""

    def __init__(self, robot: str, position: Sequence[float] | Array, reason: str) -> None:
        self.position = tuple(float(coordinate) for coordinate in position)
        self.reason = reason
        super().__init__(f"{robot}: {reason} at [{place(position)}] m")


def place(position: Sequence[float] | Array) -> str:
    """A position as messages show it."""
    return ", ".join(f"{coordinate:g}" for coordinate in position)


def position_of(robot: Robot, at: Sequence[float] | Array | None) -> Array:
    """A position in m, by default the start; raises ArgumentError where it is none."""
    return np.array(robot.platform.start if at is None else point_of("at", at))


def slack_cables(tensions: Array) -> NDArray[np.intp]:
    """Which cables carry nothing, counted from 0."""
    return np.flatnonzero(tensions <= SLACK * np.max(tensions))


def rest_state(robot: Robot, model: Model, position: Array, tensions: Array) -> Array:
    """The state of the model in which the platform rests at a position (m) under static tensions (n,) in N.

    A slack cable has a little more rope than would be straight, so that its law is smooth there.

    Raises OperatingPointError where an effect never settles or something else moves the platform.
    """
    for let_out in LET_OUT:
        state = _newton(robot, model, position, tensions, let_out)
        rates, outputs = _evaluate(model, state)
        slack = slack_cables(tensions)
        if np.all(outputs[6:][slack] <= SLACK * np.max(tensions)):
            break
    pull = float(np.max(np.abs(rates[3:6])))
    if pull > AT_REST * max(robot.gravity, 1.0):
        raise OperatingPointError(
            robot.name, position, f"something pulls the platform away with {pull:.3g} m/s2 under static tensions"
        )
    return state


def _newton(robot: Robot, model: Model, position: Array, tensions: Array, let_out: float) -> Array:
    """Newton's method on unstrained lengths and states of effects.

    Least-norm steps leave a state that nothing determines (what strands remember) where it is at the start.
    """
    count = robot.cable_count
    taut = np.setdiff1d(np.arange(count), slack_cables(tensions)).tolist()
    excess = model.span_tensions / casadi.DM(np.maximum(tensions, np.finfo(float).tiny)) - 1.0
    residual = casadi.vertcat(excess[taut], model.rates[6 + count :])
    slope = casadi.jacobian(residual, model.states[6:])
    equations = casadi.Function("rest", [model.states, model.inputs], [residual, slope])
    state = np.concatenate([position, np.zeros(model.states.numel() - 3)])
    state[6 : 6 + count] = _first_lengths(robot, position, tensions, let_out)
    still = np.zeros(model.inputs.numel())
    for _ in range(ITERATIONS):
        wrong, turn = (np.asarray(value, dtype=float) for value in equations(state, still))
        if not (np.all(np.isfinite(wrong)) and np.all(np.isfinite(turn))):
            break
        if np.max(np.abs(wrong), initial=0.0) <= CONVERGED:
            return state
        state[6:] -= np.linalg.lstsq(turn, wrong.ravel(), rcond=None)[0]
    raise OperatingPointError(robot.name, position, "no state of rest found; an effect may never settle")


def _first_lengths(robot: Robot, position: Array, tensions: Array, let_out: float) -> Array:
    """Unstrained lengths by the inverse of the logarithmic law with the declared stiffness, in m."""
    lengths: Array = np.array([line.length for line in routes(REAL, robot, position.tolist())])
    stiffness = np.array([cable.modulus * cable.area for cable in robot.cables])
    first: Array = lengths * np.exp((static_tensions(robot) - tensions) / stiffness)
    first[slack_cables(tensions)] *= 1.0 + let_out
    return first


def _evaluate(model: Model, state: Array) -> tuple[Array, Array]:
    function = casadi.Function("model", [model.states, model.inputs], [model.rates, model.outputs])
    rates, outputs = function(state, np.zeros(model.inputs.numel()))
    return np.asarray(rates, dtype=float).ravel(), np.asarray(outputs, dtype=float).ravel()
