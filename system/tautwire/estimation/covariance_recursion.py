"""Covariance recursion of an extended Kalman filter, compiled by Numba: the loops over a model's compiled functions.

Scalar measurements are processed one by one (their noise is independent), which needs no matrix inverse and skips a
missing one: with variance ``r`` of the noise, row ``h`` of the output matrix, and innovation ``e``

    s = h P h' + r        g = P h' / s        x <- x + g e        P <- P - g h P

Over a step, transition matrices ``F`` of the states that move, beside those that only decay by ``d``; process noise of
the former is there from the step's start, so that what decays within a step follows it:

    P <- [F; diag d] (P + diag [q; 0]) [F; diag d]' + diag [0; q]

Sensitivities to the free parameters are propagated with the gain held fixed. Loops in machine code take a third of the
time of the same operations written out one by one, which outgrow the processor's caches.

Source: Bierman (1977), Factorization Methods for Discrete Sequential Estimation, ch. 2; Ljung (1999), ch. 11.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .step_integration import Integration, Step, compiled, evaluate, integrate_step


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
    latter zero before; ``values`` and ``log_variances`` (K, m) of the innovations, and ``sensitivities`` (K, p, m) of
    these.
    """

    states: Any
    covariances: Any
    transitions: Any
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
        record.states[k] = moments.state
        if len(record.covariances):
            record.covariances[k] = moments.covariance
        evaluate(outputs, k, output_places)
        _update_by_measurements(outputs.results, moments, samples, record, k)
        integrate_step(integration, moments.state, k)
        evaluate(process, k, process_places)
        decay, process_noise = process.results[0][0], process.results[1][0]
        if len(record.transitions):
            _record_transition(integration.transition, decay, record.transitions[k])
        _update_covariance_over_step(integration.transition, decay, process_noise, moments.covariance)
        _update_sensitivities_over_step(integration, decay, moments.sensitivities)
        moments.state[:] *= decay
        moments.state[: integration.moving.shape[1]] = integration.moving[0]
    record.states[len(samples.measured)] = moments.state


@compiled
def _update_by_measurements(
    results: tuple[Any, ...], moments: Moments, samples: Samples, record: Record, k: int
) -> None:
    """Update by the outputs of sample k, one after the other."""
    expected, by_state = results[0][0], results[1]
    correction = np.zeros_like(moments.state)
    for i in range(len(expected)):
        cross_covariance = _cross_covariance(moments.covariance, by_state, i)
        variance, innovation = samples.white_variances[i], samples.measured[k, i] - expected[i]
        for j in range(len(correction)):
            variance += by_state[j, i] * cross_covariance[j]
            innovation -= by_state[j, i] * correction[j]
        deviation = np.sqrt(variance)
        record.values[k, i], record.log_variances[k, i] = innovation / deviation, np.log(variance)
        slopes = _innovation_sensitivities(moments.sensitivities, results, i)
        record.sensitivities[k, :, i] = slopes / deviation
        if samples.observed[k, i] == 0.0:
            continue
        for r in range(len(correction)):
            gain = cross_covariance[r] / variance
            correction[r] += gain * innovation
            for a in range(len(slopes)):
                moments.sensitivities[a, r] += gain * slopes[a]
        cross_covariance /= deviation
        for r in range(len(correction)):
            factor = cross_covariance[r]
            for j in range(len(correction)):
                moments.covariance[r, j] -= factor * cross_covariance[j]
    moments.state[:] += correction


@compiled
def _cross_covariance(covariance: Any, by_state: Any, i: int) -> Any:
    """Covariance of the state with output i, ``P h'`` (n); most slopes of an output are zero."""
    products = np.zeros(len(covariance))
    for j in range(len(covariance)):
        slope = by_state[j, i]
        if slope != 0.0:
            for r in range(len(covariance)):
                products[r] += slope * covariance[j, r]
    return products


@compiled
def _innovation_sensitivities(sensitivities: Any, results: tuple[Any, ...], i: int) -> Any:
    """Derivatives (p) of the innovation of output i by the parameters."""
    by_state, by_parameters = results[1], results[2]
    slopes = np.empty(len(sensitivities))
    for a in range(len(sensitivities)):
        total = by_parameters[a, i]
        for j in range(len(by_state)):
            total += by_state[j, i] * sensitivities[a, j]
        slopes[a] = -total
    return slopes


@compiled
def _record_transition(by_state: Any, decay: Any, transition: Any) -> None:
    from_count, moving_count = by_state.shape
    transition[:moving_count, :from_count] = by_state.T
    for r in range(moving_count, len(transition)):
        transition[r, r] = decay[r]


@compiled
def _update_covariance_over_step(transition: Any, decay: Any, process_noise: Any, covariance: Any) -> None:
    from_count, moving_count = transition.shape
    size = len(covariance)
    for r in range(moving_count):
        covariance[r, r] += process_noise[r]
    propagated = np.zeros((moving_count, size))
    for r in range(moving_count):
        for j in range(from_count):
            slope = transition[j, r]
            if slope != 0.0:
                for t in range(size):
                    propagated[r, t] += slope * covariance[j, t]
    for r in range(moving_count, size):
        for j in range(moving_count, size):
            covariance[r, j] *= decay[r] * decay[j]
    for r in range(moving_count):
        for j in range(moving_count, size):
            covariance[r, j] = covariance[j, r] = propagated[r, j] * decay[j]
        for j in range(r, moving_count):
            total = 0.0
            for c in range(from_count):
                total += transition[c, j] * propagated[r, c]
            covariance[r, j] = covariance[j, r] = total
    for r in range(moving_count, size):
        covariance[r, r] += process_noise[r]


@compiled
def _update_sensitivities_over_step(integration: Integration, decay: Any, sensitivities: Any) -> None:
    transition, direct = integration.transition, integration.direct
    from_count, moving_count = transition.shape
    for a in range(len(sensitivities)):
        moved = direct[a].copy()
        for r in range(moving_count):
            for j in range(from_count):
                moved[r] += transition[j, r] * sensitivities[a, j]
        sensitivities[a, :moving_count] = moved
        sensitivities[a, moving_count:] *= decay[moving_count:]
