"""The robot linearised about rest: python-control's state space, and modes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import casadi
import control
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.optimize import linear_sum_assignment

from .errors import InputError, TautwireError
from .robot import Robot
from .statics import directions, static_tensions
from .symbolic import Model, symbolic_model

Array = NDArray[np.float64]

POSITION, VELOCITY = slice(0, 3), slice(3, 6)
SLACK = 1e-9
ITERATIONS = 50
CONVERGED = 1e-10
REAL_EIGENVALUE = 1e-9


class OperatingPointError(TautwireError):
    """No state of rest was found, or none about which the platform oscillates; tells where and why."""


@dataclass(frozen=True)
class Modes:
    """The three translational modes with the winches held, by ascending frequency.

    ``frequencies`` (3,) in Hz, undamped; ``damping_ratios`` (3,); ``shapes`` (3, 3), unit columns;
    ``cable_shares`` (n, 3), each cable's part of the energy stored in the mode, columns sum to 1.
    """

    frequencies: Array
    damping_ratios: Array
    shapes: Array
    cable_shares: Array


@dataclass(frozen=True)
class LinearPlant:
    """A robot linearised about rest; all signals are deviations from there, in SI units.

    ``system`` is a continuous ``control.StateSpace`` with named states (position, velocity, unstrained
    lengths, states of effects), inputs (winch speeds, external force) and outputs (position, velocity,
    tensions, lengths). ``position`` (3,) in m; ``tensions`` (n,) in N; ``state`` is the operating point.
    """

    system: Any
    position: Array
    tensions: Array
    state: Array
    modes: Modes


def linearise(robot: Robot, at: Sequence[float] | Array | None = None) -> LinearPlant:
    """Linearise about rest at a position in m, by default the start, with exact derivatives of the laws.

    Elsewhere it is the same robot, moved there by its winches: start lengths and start tensions stay, the
    unstrained lengths are those at which the laws give the static tensions, and states of effects have
    settled.

    Raises UnreachableError where the cables cannot hold the platform, InputError where one of them is slack
    (its law has a kink there), OperatingPointError where the states of an effect never settle.
    """
    position = _position(robot, at)
    tensions = static_tensions(robot, position)
    _refuse_slack(robot, position, tensions)
    model = symbolic_model(robot)
    state = _rest(robot, model, position, tensions)
    matrices = _jacobians(model, state)
    system = control.ss(
        *matrices,
        states=_signals(model.state_names),
        inputs=_signals(model.input_names),
        outputs=_signals(model.output_names),
        name="plant",
    )
    return LinearPlant(system, position, tensions, state, _modes(robot, position, tensions, *matrices[:3]))


def model_document(plant: LinearPlant) -> dict[str, Any]:
    """The content of a model file: operating point, modes, matrices as lists of rows, names."""
    system, modes = plant.system, plant.modes
    return {
        "position": plant.position.tolist(),
        "tensions": plant.tensions.tolist(),
        "frequencies_hz": modes.frequencies.tolist(),
        "damping_ratios": modes.damping_ratios.tolist(),
        "mode_shapes": modes.shapes.tolist(),
        **{name: np.asarray(getattr(system, name)).tolist() for name in ("A", "B", "C", "D")},
        "states": list(system.state_labels),
        "inputs": list(system.input_labels),
        "outputs": list(system.output_labels),
    }


def _signals(names: Sequence[str]) -> list[str]:
    # python-control keeps the dot for "system.signal" and refuses it in a name.
    return [name.replace(".", "_") for name in names]


def _position(robot: Robot, at: Sequence[float] | Array | None) -> Array:
    position = np.array(robot.platform.start if at is None else at, dtype=float)
    if position.shape != (3,) or not np.all(np.isfinite(position)):
        raise InputError("at", f"is {position.tolist()}, must be three finite coordinates in m", "give X,Y,Z")
    return position


def _refuse_slack(robot: Robot, position: Array, tensions: Array) -> None:
    slack = np.flatnonzero(tensions <= SLACK * np.max(tensions))
    if len(slack):
        place = ", ".join(f"{coordinate:g}" for coordinate in position)
        raise InputError(
            robot.name,
            f"cable {slack[0] + 1} hangs slack at [{place}] m, where its law has a kink and no derivative",
            "choose a position where every cable pulls, or raise tension.minimum",
        )


def _rest(robot: Robot, model: Model, position: Array, tensions: Array) -> Array:
    """The state at rest, by Newton's method on unstrained lengths and states of effects.

    Least-norm steps leave a state that nothing determines (a drum's angle) where it is at the start.
    """
    count = robot.cable_count
    unknown = model.states[6:]
    excess = model.outputs[6 : 6 + count] / tensions - 1.0
    residual = casadi.vertcat(excess, model.rates[6 + count :])
    equations = casadi.Function("rest", [model.states, model.inputs], [residual, casadi.jacobian(residual, unknown)])
    state = np.concatenate([position, np.zeros(model.states.numel() - 3)])
    state[6 : 6 + count] = _first_lengths(robot, position, tensions)
    still = np.zeros(model.inputs.numel())
    for _ in range(ITERATIONS):
        wrong, slope = (np.asarray(value, dtype=float) for value in equations(state, still))
        if not (np.all(np.isfinite(wrong)) and np.all(np.isfinite(slope))):
            break
        if np.max(np.abs(wrong)) <= CONVERGED:
            return state
        state[6:] -= np.linalg.lstsq(slope, wrong.ravel(), rcond=None)[0]
    place = ", ".join(f"{coordinate:g}" for coordinate in position)
    raise OperatingPointError(f"{robot.name}: no state of rest found at [{place}] m; an effect may never settle")


def _first_lengths(robot: Robot, position: Array, tensions: Array) -> Array:
    """Unstrained lengths by Hooke's law with the declared stiffness, in m."""
    lengths: Array = np.linalg.norm(np.array(robot.anchors) - position, axis=1)
    stiffness = np.array([cable.modulus * cable.area for cable in robot.cables])
    return lengths * (1.0 - (tensions - static_tensions(robot)) / stiffness)


def _jacobians(model: Model, state: Array) -> tuple[Array, Array, Array, Array]:
    pairs = [(f, x) for f in (model.rates, model.outputs) for x in (model.states, model.inputs)]
    derivatives = casadi.Function(
        "derivatives", [model.states, model.inputs], [casadi.jacobian(f, x) for f, x in pairs]
    )
    values = derivatives(state, np.zeros(model.inputs.numel()))
    a, b, c, d = (np.asarray(value, dtype=float) for value in values)
    return a, b, c, d


def _modes(robot: Robot, position: Array, tensions: Array, A: Array, B: Array, C: Array) -> Modes:
    """Solve ``K phi = omega^2 M phi``; K at constant unstrained lengths and states of effects."""
    mass = np.linalg.inv(B[VELOCITY, robot.cable_count :])
    stiffness = -mass @ A[VELOCITY, POSITION]
    squares, shapes = eigh(0.5 * (stiffness + stiffness.T), 0.5 * (mass + mass.T))
    if squares[0] <= 0.0:
        raise OperatingPointError(f"{robot.name}: the platform is not held stably at {position.tolist()} m")
    omega: Array = np.sqrt(squares)
    shapes = shapes / np.linalg.norm(shapes, axis=0)
    shapes = shapes * np.sign(shapes[np.argmax(np.abs(shapes), axis=0), range(3)])
    return Modes(
        frequencies=omega / (2.0 * np.pi),
        damping_ratios=_damping_ratios(_held(A, robot.cable_count), omega, shapes),
        shapes=shapes,
        cable_shares=_cable_shares(robot, position, tensions, C, shapes),
    )


def _cable_shares(robot: Robot, position: Array, tensions: Array, C: Array, shapes: Array) -> Array:
    """``phi' K_i phi / sum_i phi' K_i phi``, ``K_i = -u (dT/dp) + T (I - u u') / l`` for each cable."""
    unit = directions(robot, position)
    lengths = np.linalg.norm(np.array(robot.anchors) - position, axis=1)
    slopes = C[6 : 6 + robot.cable_count, POSITION]
    along = unit.T @ shapes
    across = 1.0 - along**2
    energy: Array = -along * (slopes @ shapes) + (tensions / lengths)[:, None] * across
    return energy / energy.sum(axis=0)


def _held(A: Array, cable_count: int) -> Array:
    """A without the unstrained lengths: they stand still with the winches and only add zero eigenvalues."""
    rest = np.r_[0:6, 6 + cable_count : len(A)]
    held: Array = A[np.ix_(rest, rest)]
    return held


def _damping_ratios(A: Array, omega: Array, shapes: Array) -> Array:
    """Damping ratio of each mode, from the eigenvalues of A whose eigenvectors look most like its shape.

    A pair p, q belongs to ``s^2 + 2 zeta w s + w^2``: ``w^2 = p q``, ``zeta = -(p + q) / (2 w)``.
    """
    values, vectors = np.linalg.eig(A)
    moved = vectors[POSITION] / np.maximum(np.linalg.norm(vectors[POSITION], axis=0), np.finfo(float).tiny)
    likeness = np.abs(shapes.T @ moved)
    ratios = np.full(len(omega), np.nan)
    turning = np.flatnonzero(values.imag > REAL_EIGENVALUE * np.abs(values))
    distance = np.abs(np.log(np.abs(values[turning])[None, :] / omega[:, None]))
    for mode, place in zip(*linear_sum_assignment(distance - likeness[:, turning]), strict=True):
        value = values[turning[place]]
        ratios[mode] = -value.real / abs(value)
    free = set(np.flatnonzero(np.abs(values.imag) <= REAL_EIGENVALUE * np.abs(values)).tolist())
    for mode in np.flatnonzero(np.isnan(ratios)):
        pair = _real_pair(values.real, likeness[mode], omega[mode], sorted(free))
        free.difference_update(pair)
        p, q = values.real[list(pair)]
        ratios[mode] = -(p + q) / (2.0 * np.sqrt(p * q))
    return ratios


def _real_pair(values: Array, likeness: Array, omega: float, free: Sequence[int]) -> tuple[int, ...]:
    """The two real eigenvalues of one sign that fit an overdamped mode best."""

    def misfit(pair: tuple[int, ...]) -> float:
        p, q = values[list(pair)]
        if p * q <= 0.0:
            return np.inf
        return float(abs(np.log(p * q / omega**2)) - likeness[list(pair)].sum())

    return min(combinations(free, 2), key=misfit)
