"""Covariance recursion of an extended Kalman filter, compiled by Numba: the loops over a model's compiled functions.

Scalar measurements are processed one by one (their noise is independent), which needs no matrix inverse and skips a
missing one: with variance ``r`` of the noise, row ``h`` of the output matrix, and innovation ``e``

    s = h P h' + r        g = P h' / s        x <- x + g e        P <- P - g h P

Over a step, transition matrices ``F`` of the states that move, beside those that only decay by ``d``; process noise of
the former is there from the step's start, so that what decays within a step follows it:

    P <- [F; diag d] (P + diag [q; 0]) [F; diag d]' + diag [0; q]

Sensitivities to the free parameters are propagated with the gain held fixed.

Source: Bierman (1977), Factorization Methods for Discrete Sequential Estimation, ch. 2; Ljung (1999), ch. 11.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .step_integration import (
    Integration,
    Step,
    add_to_matrix,
    assign,
    assign_matrix,
    compiled,
    evaluate,
    integrate_step,
)

# Numba caches machine code by the content of this file alone, and what it calls of that module is in it.
STEP_INTEGRATION_SHA256 = "581902eed04fb2d5ed6fbc9ffe928e9a2d044053ab95ce620d17e91cc38376fa"


class Moments(NamedTuple):
    """Moments of the state, changed in place: ``state`` (n), ``covariance`` (n, n), ``sensitivities`` (p, n)."""

    state: Any
    covariance: Any
    sensitivities: Any


class Samples(NamedTuple):
    """Samples of the outputs: ``measured`` and ``observed`` (K, m); ``white_variances`` (m) of the noise."""

    measured: Any
    observed: Any
    white_variances: Any


class Record(NamedTuple):
    """Predicted states and innovations that a run fills in.

    ``states`` (K + 1, n); unless they are empty, ``covariances`` and ``transitions`` to the next sample (K, n, n), the
    latter zero before, and ``output_matrices`` (K, m, n); ``values`` and ``log_variances`` (K, m) of the innovations,
    and ``sensitivities`` (K, p, m) of these.
    """

    states: Any
    covariances: Any
    transitions: Any
    output_matrices: Any
    values: Any
    log_variances: Any
    sensitivities: Any


@compiled
def run_recursion(
    outputs: Step, integration: Integration, process: Step, moments: Moments, samples: Samples, record: Record
) -> None:
    """Run over the K samples; all arrays are in C order.

    For the state, ``outputs`` has the results expected (1, m), by state (n, m) and by parameters (p, m); ``process``
    decay and process noise (1, n). The first states move as the integration has it; behind those that are constant,
    the others only decay.
    """
    output_places, process_places = np.empty_like(outputs.places), np.empty_like(process.places)
    for k in range(len(samples.measured)):
        assign(record.states[k], moments.state)
        if len(record.covariances):
            assign_matrix(record.covariances[k], moments.covariance)
        evaluate(outputs, k, output_places)
        if len(record.output_matrices):
            assign_matrix(record.output_matrices[k], outputs.results[1].T)
        _update_by_measurements(outputs.results, moments, samples, record, k)
        integrate_step(integration, moments.state, k)
        evaluate(process, k, process_places)
        decay, process_noise = process.results[0][0], process.results[1][0]
        if len(record.transitions):
            _record_transition(integration.transition, decay, record.transitions[k])
        _update_covariance_over_step(integration.transition, decay, process_noise, moments.covariance)
        _update_sensitivities_over_step(integration, decay, moments.sensitivities)
        for i in range(len(decay)):
            moments.state[i] *= decay[i]
        assign(moments.state[: integration.moving.shape[1]], integration.moving[0])
    assign(record.states[len(samples.measured)], moments.state)


@compiled
def _update_by_measurements(
    results: tuple[Any, ...], moments: Moments, samples: Samples, record: Record, k: int
) -> None:
    """Update by the outputs of sample k.

    Gaussian elimination leaves of each output what those before it do not predict; the moments follow all at once.
    """
    by_state, white_variances = results[1], samples.white_variances
    innovations = samples.measured[k] - results[0][0]
    slopes = -(results[2] + np.dot(moments.sensitivities, by_state))
    cross_covariances = np.dot(by_state.T, moments.covariance)
    variances = np.dot(cross_covariances, by_state)
    for i in range(len(innovations)):
        variance = variances[i, i] + white_variances[i]
        deviation = np.sqrt(variance)
        innovations[i] /= deviation
        record.values[k, i], record.log_variances[k, i] = innovations[i], np.log(variance)
        for parameter in range(len(slopes)):
            slopes[parameter, i] /= deviation
            record.sensitivities[k, parameter, i] = slopes[parameter, i]
        if samples.observed[k, i] == 0.0:
            innovations[i] = 0.0
            for c in range(cross_covariances.shape[1]):
                cross_covariances[i, c] = 0.0
            continue
        for c in range(cross_covariances.shape[1]):
            cross_covariances[i, c] /= deviation
        for later in range(i + 1, len(innovations)):
            factor = variances[later, i] / deviation
            innovations[later] -= factor * innovations[i]
            _subtract_row(cross_covariances, later, factor, i)
            _subtract_row(variances, later, factor / deviation, i)
            for parameter in range(len(slopes)):
                slopes[parameter, later] -= factor * slopes[parameter, i]
    corrections = np.dot(innovations, cross_covariances)
    for r in range(len(corrections)):
        moments.state[r] += corrections[r]
    add_to_matrix(moments.sensitivities, 1.0, np.dot(slopes, cross_covariances))
    add_to_matrix(moments.covariance, -1.0, np.dot(cross_covariances.T, cross_covariances))


@compiled
def _subtract_row(matrix: Any, row: int, factor: float, other: int) -> None:
    """Subtract a multiple of another row of a matrix from one, without a copy."""
    for c in range(matrix.shape[1]):
        matrix[row, c] -= factor * matrix[other, c]


@compiled
def _record_transition(by_state: Any, decay: Any, transition: Any) -> None:
    from_count, moving_count = by_state.shape
    assign_matrix(transition[:moving_count, :from_count], by_state.T)
    for r in range(moving_count, len(transition)):
        transition[r, r] = decay[r]


@compiled
def _update_covariance_over_step(transition: Any, decay: Any, process_noise: Any, covariance: Any) -> None:
    from_count, moving_count = transition.shape
    size = len(covariance)
    for r in range(moving_count):
        covariance[r, r] += process_noise[r]
    propagated = np.dot(transition.T, covariance[:from_count])
    moved = np.dot(np.ascontiguousarray(propagated[:, :from_count]), transition)
    for r in range(moving_count, size):
        for j in range(moving_count, size):
            covariance[r, j] *= decay[r] * decay[j]
        covariance[r, r] += process_noise[r]
    for r in range(moving_count):
        for j in range(moving_count, size):
            covariance[r, j] = covariance[j, r] = propagated[r, j] * decay[j]
        for j in range(r, moving_count):
            covariance[r, j] = covariance[j, r] = moved[r, j]


@compiled
def _update_sensitivities_over_step(integration: Integration, decay: Any, sensitivities: Any) -> None:
    from_count, moving_count = integration.transition.shape
    moved = np.dot(np.ascontiguousarray(sensitivities[:, :from_count]), integration.transition)
    for i in range(len(sensitivities)):
        for j in range(moving_count):
            sensitivities[i, j] = integration.direct[i, j] + moved[i, j]
        for j in range(moving_count, len(decay)):
            sensitivities[i, j] *= decay[j]
