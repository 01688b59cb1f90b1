"""State-space realisation of pulse responses (eigensystem realisation).

After the pulse the response is free: ``z_k+1 = F z_k`` for measured states, or for coordinates of the outputs of a few
steps stacked (block Hankel matrix). F from all of them by least squares, ``A = log(F) / h``, then B, C and D.

Source: Juang and Pappa (1985), Journal of Guidance, Control, and Dynamics 8(5), 620-627, for unmeasured states.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm, logm

from .pulse_experiments import IdentificationError, Responses

Array = NDArray[np.float64]

RANK_TOLERANCE = 1e-7
CONTROLLABILITY_TOLERANCE = 1e-10
MAX_HANKEL_BLOCKS = 8
TINY = 1e-300
# Beyond these a step is too long for a unique matrix logarithm: phase in rad, and remaining share of a decay.
MAX_PHASE_PER_STEP, MIN_DECAY_FACTOR = 2.0, 1e-3


@dataclass(frozen=True)
class SignalIndices:
    """Indices of outputs and states among the observed ports; ``states`` is None where they are not measured."""

    outputs: tuple[int, ...]
    states: tuple[int, ...] | None
    state_names: tuple[str, ...]


@dataclass(frozen=True)
class StateSpaceMatrices:
    """A continuous system with n states, m inputs, p outputs; ``state_scales`` (n,) are the states' largest deviations.

    ``residual`` is the largest equation error of states and outputs, relative to the largest value.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    state_scales: Array
    residual: float


def realise(responses: Responses, signals: SignalIndices) -> StateSpaceMatrices | None:
    """Realises the system from its inputs to its outputs; None if the step is too long for its fastest states.

    Raises IdentificationError where a named state is uncontrollable, or the order does not converge.
    """
    scaled = responses.free_response / responses.scales
    if signals.states is None:
        states, state_units = _state_coordinates(scaled[:, :, list(signals.outputs)])
        return _continuous(responses, states, state_units, None, list(signals.outputs))
    states = scaled[:, :, list(signals.states)]
    _require_controllable(states, signals.state_names)
    state_units = responses.scales[list(signals.states)]
    return _continuous(
        responses, states, state_units, responses.pulse_response[:, list(signals.states)].T, list(signals.outputs)
    )


def _continuous(
    responses: Responses, states: Array, state_units: Array, pulse_states: Array | None, outputs: list[int]
) -> StateSpaceMatrices | None:
    """Continuous matrices from trajectories (N', m, n) of scaled states with ``state_units`` (n,).

    ``pulse_states`` (n, m) are the states at the end of the pulses if measured; otherwise they follow from the first
    free step.
    """
    states_before, states_after = _flatten(states[:-1]), _flatten(states[1:])
    transition, *_ = np.linalg.lstsq(states_before, states_after, rcond=None)
    values = np.linalg.eigvals(transition)
    max_phase, min_decay = np.max(np.abs(np.angle(values)), initial=0.0), np.min(np.abs(values), initial=1.0)
    if max_phase > MAX_PHASE_PER_STEP or min_decay < MIN_DECAY_FACTOR:
        return None
    A = np.real(logm(transition.T)) / responses.step
    _, input_integral = zero_order_hold(A, responses.step)
    pulse_states = (
        np.linalg.solve(transition.T, states[0].T) if pulse_states is None else pulse_states / state_units[:, None]
    )
    scale = responses.scales[outputs]
    scaled_outputs = responses.free_response[: len(states)][:, :, outputs] / scale
    output_map, *_ = np.linalg.lstsq(_flatten(states), _flatten(scaled_outputs), rcond=None)
    C = scale[:, None] * output_map.T
    return StateSpaceMatrices(
        A=state_units[:, None] * A / state_units,
        B=state_units[:, None] * np.linalg.solve(input_integral, pulse_states) / responses.amplitudes,
        C=C / state_units,
        D=(responses.pulse_response[:, outputs].T - C @ pulse_states) / responses.amplitudes,
        state_scales=state_units * np.max(np.abs(_flatten(states)), axis=0, initial=0.0),
        residual=max(
            _relative_residual(states_before @ transition, states_after),
            _relative_residual(_flatten(states) @ output_map, _flatten(scaled_outputs)),
        ),
    )


def zero_order_hold(A: Array, step: float) -> tuple[Array, Array]:
    """Transition matrix of a step (s), and the integral of it over the step, which constant inputs act through."""
    order = len(A)
    augmented = np.block([[A, np.eye(order)], [np.zeros((order, 2 * order))]])
    exponential = expm(step * augmented)
    return exponential[:order, :order], exponential[:order, order:]


def _relative_residual(predicted: Array, observed: Array) -> float:
    """Largest residual of scaled quantities, relative to the largest value."""
    return float(
        np.max(np.abs(observed - predicted), initial=0.0) / max(float(np.max(np.abs(observed), initial=0.0)), TINY)
    )


def _state_coordinates(scaled: Array) -> tuple[Array, Array]:
    """State trajectories from the smallest block Hankel matrix of full order, and the states' units."""
    stacks, order = scaled, _numerical_rank(scaled)
    for blocks in range(2, MAX_HANKEL_BLOCKS + 1):
        count = len(scaled) - blocks + 1
        longer = np.concatenate([scaled[k : k + count] for k in range(blocks)], axis=2)
        longer_order = _numerical_rank(longer)
        if longer_order <= order:
            left_vectors = np.linalg.svd(_flatten(stacks).T, full_matrices=False)[0][:, :order]
            return stacks @ left_vectors, np.ones(order)
        stacks, order = longer, longer_order
    raise IdentificationError(
        f"{MAX_HANKEL_BLOCKS} steps in the Hankel matrix still reveal new states, {order} so far",
        "name the states, or add outputs",
    )


def _numerical_rank(trajectories: Array) -> int:
    values = np.linalg.svd(_flatten(trajectories), compute_uv=False)
    return int(np.sum(values > RANK_TOLERANCE * values[0]))


def _flatten(trajectories: Array) -> Array:
    return trajectories.reshape(-1, trajectories.shape[-1])


def _require_controllable(trajectories: Array, names: tuple[str, ...]) -> None:
    _, values, right_vectors = np.linalg.svd(_flatten(trajectories), full_matrices=False)
    if len(values) < len(names) or values[-1] < CONTROLLABILITY_TOLERANCE * values[0]:
        name = names[int(np.argmax(np.abs(right_vectors[-1])))]
        raise IdentificationError(
            f"the inputs do not control the state {name} on its own",
            "add an input that moves it, or leave the state out",
        )
