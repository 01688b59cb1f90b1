"""Step refinement with Richardson extrapolation of the identified matrices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

from ..cosimulation import Port
from .pulse_experiments import IdentificationError, PulseExperiment, Responses, measure_responses
from .realisation import TINY, SignalIndices, StateSpaceMatrices, realise, zero_order_hold

Array = NDArray[np.float64]

MAX_HALVINGS = 8
MAX_RELATIVE_ERROR = 1e-3
DIVERGENCE_FACTOR = 100.0
MAX_PREDICTION_ERROR = 0.1
MIN_FEEDTHROUGH = 1e-3
MAX_RADIANS_PER_STEP, FREQUENCY_COUNT = 0.5, 12


@dataclass(frozen=True)
class RefinedMatrices:
    """Refined matrices with the shortest step (s) taken, their estimated relative ``error``, and responses there."""

    matrices: StateSpaceMatrices
    step: float
    error: float
    responses: Responses


def refine_step(experiment: PulseExperiment, signals: SignalIndices, step: float, tolerance: float) -> RefinedMatrices:
    """Halves the step, beginning with ``step`` (s), until extrapolated matrices change by less than ``tolerance``.

    Raises IdentificationError if they do not converge.
    """
    tables: dict[int, list[StateSpaceMatrices]] = {}
    best: RefinedMatrices | None = None
    first: Responses | None = None
    amplitudes: Array | None = None
    reference: StateSpaceMatrices | None = None
    for step_size in (step / 2**halving for halving in range(MAX_HALVINGS + 1)):
        responses = measure_responses(experiment, step_size, amplitudes)
        first = first or responses
        amplitudes = responses.amplitudes
        matrices = realise(responses, signals)
        if matrices is None or (reference is not None and len(matrices.A) != len(reference.A)):
            tables, reference = {}, None
        if matrices is None:
            continue
        if reference is None:
            reference = matrices
        elif signals.states is None:
            matrices = _align_states(matrices, reference, step)
        previous_tables = tables
        # Unobserved slow states cause a first-order error, whatever the order of the coupling.
        tables = {
            order: _extrapolate(previous_tables.get(order, []), matrices, order) for order in (experiment.order, 1)
        }
        if not previous_tables:
            continue
        order, change = _most_converged_order(_ScaledNorm(responses, signals), tables, previous_tables)
        if best is None or change < best.error:
            best = RefinedMatrices(tables[order][-1], step_size, change, responses)
        if change <= tolerance or change > DIVERGENCE_FACTOR * best.error:
            break
    if first is None or best is None or best.error > MAX_RELATIVE_ERROR:
        raise _divergence(step, best)
    _require_prediction(best.matrices, first, signals, experiment.observed_ports)
    return best


def _most_converged_order(
    norm: _ScaledNorm,
    tables: Mapping[int, Sequence[StateSpaceMatrices]],
    previous_tables: Mapping[int, Sequence[StateSpaceMatrices]],
) -> tuple[int, float]:
    """The order whose extrapolated matrices changed least since the previous step, and that relative change."""
    changes = {order: norm.distance(row[-1], previous_tables[order][-1]) for order, row in tables.items()}
    order = min(changes, key=changes.__getitem__)
    return order, changes[order]


def _divergence(step: float, best: RefinedMatrices | None) -> IdentificationError:
    change = "" if best is None else f", at {best.step:.2g} s the matrices still change by {best.error:.2g}"
    return IdentificationError(f"no step from {step:g} s down is short enough{change}", "begin with a shorter step")


def _require_prediction(
    matrices: StateSpaceMatrices, responses: Responses, signals: SignalIndices, observed_ports: Sequence[Port]
) -> None:
    """Requires that the matrices predict the longest experiment: short ones miss dead time and slow states."""
    transition, input_integral = zero_order_hold(matrices.A, responses.step)
    states = input_integral @ matrices.B * responses.amplitudes
    free_response = []
    for _ in responses.free_response:
        states = transition @ states
        free_response.append((matrices.C @ states).T)
    output_indices = list(signals.outputs)
    deviations = np.max(np.abs(np.array(free_response) - responses.free_response[:, :, output_indices]), axis=(0, 1))
    relative_deviations = deviations / responses.scales[output_indices]
    worst = int(np.argmax(relative_deviations))
    if relative_deviations[worst] > MAX_PREDICTION_ERROR:
        raise IdentificationError(
            f"{observed_ports[output_indices[worst]]} deviates from the plant of short steps by "
            f"{relative_deviations[worst]:.0%} over a longer time",
            "leave outputs with dead time away, or begin with a shorter step",
        )


def _extrapolate(
    table: Sequence[StateSpaceMatrices], matrices: StateSpaceMatrices, order: int
) -> list[StateSpaceMatrices]:
    """Next row of Neville's table (Richardson extrapolation): matrices without the errors of order, order + 1 ..."""
    row = [matrices]
    for power, coarse in enumerate(table, start=order):
        weight = 1.0 / (2.0**power - 1.0)
        fine = row[-1]
        mixed = {name: getattr(fine, name) + weight * (getattr(fine, name) - getattr(coarse, name)) for name in "ABCD"}
        row.append(StateSpaceMatrices(**mixed, state_scales=matrices.state_scales, residual=matrices.residual))
    return row


@dataclass(frozen=True)
class _ScaledNorm:
    """Norm of systems in units of the largest deviations in the experiments."""

    responses: Responses
    signals: SignalIndices

    def distance(self, one: StateSpaceMatrices, other: StateSpaceMatrices) -> float:
        """The largest relative difference in the norm of :func:`tautwire.linear.linearise_fmus`."""
        amplitudes = self.responses.amplitudes
        output_scales = self.responses.scales[list(self.signals.outputs)]
        if self.signals.states is None:
            return self._response_distance(one, other, amplitudes / output_scales[:, None])
        state_scales = np.maximum(other.state_scales, TINY)
        scales = {
            "A": (state_scales, state_scales),
            "B": (state_scales, amplitudes),
            "C": (output_scales, state_scales),
            "D": (output_scales, amplitudes),
        }
        largest = 0.0
        for name, (rows, columns) in scales.items():
            unit = columns / rows[:, None]
            size = float(np.linalg.norm(getattr(other, name) * unit))
            change = float(np.linalg.norm((getattr(one, name) - getattr(other, name)) * unit))
            # Without feedthrough D is rounding only.
            largest = max(largest, change / max(size, MIN_FEEDTHROUGH if name == "D" else TINY))
        return largest

    def _response_distance(self, one: StateSpaceMatrices, other: StateSpaceMatrices, unit: Array) -> float:
        max_frequency = MAX_RADIANS_PER_STEP / self.responses.step
        laplace_points = 1j * np.geomspace(1e-3 * max_frequency, max_frequency, FREQUENCY_COUNT)
        pairs = [(_frequency_response(one, s) * unit, _frequency_response(other, s) * unit) for s in laplace_points]
        return max(float(np.linalg.norm(a - b) / max(float(np.linalg.norm(b)), TINY)) for a, b in pairs)


def _frequency_response(matrices: StateSpaceMatrices, laplace_point: complex) -> NDArray[np.complex128]:
    """``C (s I - A)^-1 B + D``."""
    state_response = np.linalg.solve(laplace_point * np.eye(len(matrices.A)) - matrices.A, matrices.B)
    response: NDArray[np.complex128] = matrices.C.astype(complex) @ state_response + matrices.D
    return response


def _align_states(matrices: StateSpaceMatrices, reference: StateSpaceMatrices, span: float) -> StateSpaceMatrices:
    """Similarity transformation to the states of another realisation, by matching their observability matrices."""
    transformation, *_ = np.linalg.lstsq(
        _observability_matrix(reference, span), _observability_matrix(matrices, span), rcond=None
    )
    inverse = np.linalg.inv(transformation)
    return StateSpaceMatrices(
        A=transformation @ matrices.A @ inverse,
        B=transformation @ matrices.B,
        C=matrices.C @ inverse,
        D=matrices.D,
        state_scales=reference.state_scales,
        residual=matrices.residual,
    )


def _observability_matrix(matrices: StateSpaceMatrices, span: float) -> Array:
    """Observability matrix over as many instants as there are states, and now, (instants p, n)."""
    return np.concatenate([matrices.C @ expm(matrices.A * span * k) for k in range(len(matrices.A) + 1)], axis=0)
