"""From responses to pulses to the matrices of a continuous linear system.

The responses after the pulse are free: ``z_k+1 = F z_k`` for states that are seen, or for coordinates of what is seen
in a few steps together. F from all of them by least squares, ``A = log(F) / h``, and B, C, D from what is left.

Source: Juang and Pappa (1985), Journal of Guidance, Control, and Dynamics 8(5), 620-627, for states that are not seen.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm, logm

from .experiments import IdentificationError, Responses

Array = NDArray[np.float64]

RANK = 1e-7
UNREACHED = 1e-10
MOST_BLOCKS = 8
TINY = 1e-300
# Beyond these a step is too long to tell a state's rate from its change: turn in rad, and what a decay leaves.
FASTEST_TURN, SLOWEST_REST = 2.0, 1e-3


@dataclass(frozen=True)
class Signals:
    """Which of the ports seen are outputs and which are states; None where these have coordinates of their own."""

    outputs: tuple[int, ...]
    states: tuple[int, ...] | None
    state_names: tuple[str, ...]


@dataclass(frozen=True)
class Matrices:
    """A continuous system with n states, m inputs, p outputs; ``sizes`` (n,) are the states' largest deviations.

    ``residual`` is what the states leave unexplained of themselves and of the outputs, relative to the largest.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    sizes: Array
    residual: float


def realise(responses: Responses, signals: Signals) -> Matrices | None:
    """The system from its inputs to its outputs; None where the step is too long for its fastest states.

    Raises IdentificationError where the inputs do not reach a named state, or there is no end of states.
    """
    scaled = responses.free / responses.sizes
    if signals.states is None:
        states, unit = _coordinates(scaled[:, :, list(signals.outputs)])
        return _continuous(responses, states, unit, None, list(signals.outputs))
    states = scaled[:, :, list(signals.states)]
    _refuse_unreached(states, signals.state_names)
    unit = responses.sizes[list(signals.states)]
    return _continuous(responses, states, unit, responses.held[:, list(signals.states)].T, list(signals.outputs))


def _continuous(
    responses: Responses, states: Array, unit: Array, pushed: Array | None, outputs: list[int]
) -> Matrices | None:
    """Matrices from trajectories (N', m, n) of scaled states; ``unit`` (n,) is what one of them stands for.

    ``pushed`` (n, m) are the states at the end of the pulses, where they are seen; otherwise one free step leads back.
    """
    before, after = _flat(states[:-1]), _flat(states[1:])
    moved, *_ = np.linalg.lstsq(before, after, rcond=None)
    values = np.linalg.eigvals(moved)
    turn, left = np.max(np.abs(np.angle(values)), initial=0.0), np.min(np.abs(values), initial=1.0)
    if turn > FASTEST_TURN or left < SLOWEST_REST:
        return None
    A, order = np.real(logm(moved.T)) / responses.step, len(unit)
    twice = np.block([[A, np.eye(order)], [np.zeros((order, 2 * order))]])
    held = expm(responses.step * twice)[:order, order:]
    pushed = np.linalg.solve(moved.T, states[0].T) if pushed is None else pushed / unit[:, None]
    scale = responses.sizes[outputs]
    shown = responses.free[: len(states)][:, :, outputs] / scale
    reading, *_ = np.linalg.lstsq(_flat(states), _flat(shown), rcond=None)
    C = scale[:, None] * reading.T
    return Matrices(
        A=unit[:, None] * A / unit,
        B=unit[:, None] * np.linalg.solve(held, pushed) / responses.pushes,
        C=C / unit,
        D=(responses.held[:, outputs].T - C @ pushed) / responses.pushes,
        sizes=unit * np.max(np.abs(_flat(states)), axis=0, initial=0.0),
        residual=max(_unexplained(before @ moved, after), _unexplained(_flat(states) @ reading, _flat(shown))),
    )


def _unexplained(told: Array, there: Array) -> float:
    """What is left of scaled quantities, relative to the largest."""
    return float(np.max(np.abs(there - told), initial=0.0) / max(float(np.max(np.abs(there), initial=0.0)), TINY))


def _coordinates(scaled: Array) -> tuple[Array, Array]:
    """Trajectories of states from what is seen in as few steps together as tell all of them apart, and their units."""
    stacks, order = scaled, _rank(scaled)
    for blocks in range(2, MOST_BLOCKS + 1):
        count = len(scaled) - blocks + 1
        longer = np.concatenate([scaled[k : k + count] for k in range(blocks)], axis=2)
        found = _rank(longer)
        if found <= order:
            left = np.linalg.svd(_flat(stacks).T, full_matrices=False)[0][:, :order]
            return stacks @ left, np.ones(order)
        stacks, order = longer, found
    raise IdentificationError(
        f"{MOST_BLOCKS} steps together still show new states, {order} so far", "name the states, or add outputs"
    )


def _rank(trajectories: Array) -> int:
    values = np.linalg.svd(_flat(trajectories), compute_uv=False)
    return int(np.sum(values > RANK * values[0]))


def _flat(trajectories: Array) -> Array:
    return trajectories.reshape(-1, trajectories.shape[-1])


def _refuse_unreached(trajectories: Array, names: tuple[str, ...]) -> None:
    _, values, right = np.linalg.svd(_flat(trajectories), full_matrices=False)
    if len(values) < len(names) or values[-1] < UNREACHED * values[0]:
        name = names[int(np.argmax(np.abs(right[-1])))]
        raise IdentificationError(
            f"the inputs do not reach the state {name} on its own", "add an input that moves it, or leave the state out"
        )
