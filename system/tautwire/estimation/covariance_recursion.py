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
    multiply,
)

# Numba caches machine code by the content of this file alone, and what it calls of that module is in it.
STEP_INTEGRATION_SHA256 = "fd2f20ddf94da6c2b5cacbb45cb1e8c894f1859957ac1ab7eba2c754dc7c791a"


class Functions(NamedTuple):
    """Functions of a sample and the state.

    ``outputs`` has the results expected (1, m), by state (n, m) and by parameters and static start (p + s, m), each
    with the others held; ``process`` decay and process noise (1, n).
    """

    outputs: Step
    process: Step


class Moments(NamedTuple):
    """Moments of the state, changed in place: ``state`` (n), ``covariance`` (n, n), ``sensitivities`` (p, n).

    The first sample's outputs are linearised at the state; its mean is ``prior_offset`` (n) from there.
    """

    state: Any
    prior_offset: Any
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
    latter zero before, and ``output_matrices`` (K, m, n); ``values`` (K, m) of the innovations in deviations, their
    ``variances`` (K, m), and ``sensitivities`` (K, p, m) of the values.
    """

    states: Any
    covariances: Any
    transitions: Any
    output_matrices: Any
    values: Any
    variances: Any
    sensitivities: Any


class Buffers(NamedTuple):
    """Buffers of a run, written anew for each sample.

    ``innovations`` (m,) and their ``slopes`` by parameters (p, m); their ``variances`` without white noise and the
    ``whitening`` matrix (m, m); their ``cross_covariances`` with the state, and ``whitened`` ones (m, n); what is taken
    from the ``covariance`` (n, n) and added to the ``sensitivities`` (p, n). ``through_statics`` is what outputs change
    by parameters and constants through the static start (p + c, m). Of a step that moves states by c others:
    ``moved_rows`` (moving, n) of the covariance, their first columns (moving, c), and ``moved`` ones by both sides
    (moving, moving); first columns (p, c) of the sensitivities, and ``moved_sensitivities`` (p, moving).
    """

    innovations: Any
    slopes: Any
    variances: Any
    whitening: Any
    cross_covariances: Any
    whitened: Any
    covariance: Any
    sensitivities: Any
    through_statics: Any
    moved_rows: Any
    moved_rows_from: Any
    moved: Any
    sensitivities_from: Any
    moved_sensitivities: Any


def empty_record(sizes: tuple[int, int, int, int], keeps_covariances: bool) -> Record:
    """A record for numbers of samples, outputs, states and parameters, to be filled in."""
    count, m, n, p = sizes
    kept = count if keeps_covariances else 0
    return Record(
        np.empty((count + 1, n)),
        np.empty((kept, n, n)),
        np.zeros((kept, n, n)),
        np.empty((kept, m, n)),
        np.empty((count, m)),
        np.empty((count, m)),
        np.empty((count, p, m)),
    )


def recursion_buffers(output_count: int, size: int, parameter_count: int, integration: Integration) -> Buffers:
    """Buffers for a number of outputs, states and parameters, and an integration."""
    m, n, p = output_count, size, parameter_count
    from_count, moving = integration.transition.shape
    shapes: list[tuple[int, ...]] = [(m,), (p, m), (m, m), (m, m), (m, n), (m, n), (n, n), (p, n)]
    shapes += [(len(integration.static_start.results[1]), m)]
    shapes += [(moving, n), (moving, from_count), (moving, moving), (p, from_count), (p, moving)]
    return Buffers(*(np.empty(shape) for shape in shapes))


@compiled
def run_recursion(
    functions: Functions, integration: Integration, moments: Moments, samples: Samples, record: Record, buffers: Buffers
) -> None:
    """Run over the K samples; all arrays are in C order.

    The first states move as the integration has it; behind those that are constant, the others only decay.
    """
    outputs, process = functions.outputs, functions.process
    evaluate(integration.static_start, 0)
    for k in range(len(samples.measured)):
        assign(record.states[k], moments.state)
        if len(record.covariances):
            assign_matrix(record.covariances[k], moments.covariance)
        evaluate(outputs, k)
        _add_slopes_of_statics(outputs.results, integration, buffers.through_statics)
        if len(record.output_matrices):
            assign_matrix(record.output_matrices[k], outputs.results[1].T)
        if k == 0:
            _move_to_prior_mean(outputs.results, moments)
        _update_by_measurements(outputs.results, moments, samples, record, buffers, k)
        integrate_step(integration, moments.state, k)
        evaluate(process, k)
        decay, process_noise = process.results[0][0], process.results[1][0]
        if len(record.transitions):
            _record_transition(integration.transition, decay, record.transitions[k])
        _update_covariance_over_step(integration.transition, decay, process_noise, moments.covariance, buffers)
        _update_sensitivities_over_step(integration, decay, moments.sensitivities, buffers)
        for i in range(len(decay)):
            moments.state[i] *= decay[i]
        assign(moments.state[: integration.moving.shape[1]], integration.moving[0])
    assign(record.states[len(samples.measured)], moments.state)


@compiled
def _add_slopes_of_statics(results: tuple[Any, ...], integration: Integration, through_statics: Any) -> None:
    """Add what the outputs change by parameters and constants through the static start."""
    slopes, moving, count = integration.static_start.results[1], integration.moving.shape[1], integration.constant_count
    if len(slopes) > 0:
        parameter_count = len(slopes) - count
        multiply(slopes, results[2][parameter_count:], through_statics)
        add_to_matrix(results[2][:parameter_count], 1.0, through_statics[:parameter_count])
        add_to_matrix(results[1][moving : moving + count], 1.0, through_statics[parameter_count:])


@compiled
def _move_to_prior_mean(results: tuple[Any, ...], moments: Moments) -> None:
    """Move the state, and what is expected of it, from where it was linearised to its mean."""
    for j in range(len(moments.state)):
        moments.state[j] += moments.prior_offset[j]
        for i in range(results[1].shape[1]):
            results[0][0, i] += results[1][j, i] * moments.prior_offset[j]


@compiled
def _update_by_measurements(
    results: tuple[Any, ...], moments: Moments, samples: Samples, record: Record, buffers: Buffers, k: int
) -> None:
    """Update by the outputs of sample k.

    Gaussian elimination leaves of each output what those before it do not predict; the moments follow all at once.
    """
    by_state, cross_covariances, whitened = results[1], buffers.cross_covariances, buffers.whitened
    multiply(moments.sensitivities, by_state, buffers.slopes)
    for i in range(by_state.shape[1]):
        buffers.innovations[i] = samples.measured[k, i] - results[0][0, i]
        for parameter in range(len(buffers.slopes)):
            buffers.slopes[parameter, i] = -(results[2][parameter, i] + buffers.slopes[parameter, i])
    multiply(by_state.T, moments.covariance, cross_covariances)
    multiply(cross_covariances, by_state, buffers.variances)
    _whiten(samples, record, buffers, k)
    multiply(buffers.whitening, cross_covariances, whitened)
    for i in range(len(whitened)):
        for r in range(len(moments.state)):
            moments.state[r] += buffers.innovations[i] * whitened[i, r]
    multiply(buffers.slopes, whitened, buffers.sensitivities)
    add_to_matrix(moments.sensitivities, 1.0, buffers.sensitivities)
    multiply(whitened.T, whitened, buffers.covariance)
    add_to_matrix(moments.covariance, -1.0, buffers.covariance)


@compiled
def _whiten(samples: Samples, record: Record, buffers: Buffers, k: int) -> None:
    """Whiten innovations and slopes, and record them; the ``whitening`` matrix has no row of what is not observed."""
    innovations, slopes = buffers.innovations, buffers.slopes
    variances, whitening = buffers.variances, buffers.whitening
    count = len(whitening)
    for i in range(count):
        for c in range(count):
            whitening[i, c] = 1.0 if c == i else 0.0
    for i in range(count):
        variance = variances[i, i] + samples.white_variances[i]
        deviation = np.sqrt(variance)
        innovations[i] /= deviation
        record.values[k, i], record.variances[k, i] = innovations[i], variance
        for parameter in range(len(slopes)):
            slopes[parameter, i] /= deviation
            record.sensitivities[k, parameter, i] = slopes[parameter, i]
        if samples.observed[k, i] == 0.0:
            innovations[i] = 0.0
            for c in range(i + 1):
                whitening[i, c] = 0.0
            continue
        for c in range(i + 1):
            whitening[i, c] /= deviation
        for later in range(i + 1, count):
            factor = variances[later, i] / deviation
            innovations[later] -= factor * innovations[i]
            for c in range(i + 1):
                whitening[later, c] -= factor * whitening[i, c]
            for c in range(count):
                variances[later, c] -= factor / deviation * variances[i, c]
            for parameter in range(len(slopes)):
                slopes[parameter, later] -= factor * slopes[parameter, i]


@compiled
def _record_transition(by_state: Any, decay: Any, transition: Any) -> None:
    from_count, moving_count = by_state.shape
    assign_matrix(transition[:moving_count, :from_count], by_state.T)
    for r in range(moving_count, len(transition)):
        transition[r, r] = decay[r]


@compiled
def _update_covariance_over_step(
    transition: Any, decay: Any, process_noise: Any, covariance: Any, buffers: Buffers
) -> None:
    from_count, moving_count = transition.shape
    moved_rows, moved = buffers.moved_rows, buffers.moved
    for r in range(moving_count):
        covariance[r, r] += process_noise[r]
    multiply(transition.T, covariance[:from_count], moved_rows)
    assign_matrix(buffers.moved_rows_from, moved_rows)
    multiply(buffers.moved_rows_from, transition, moved)
    # Ranges from zero: an index that may be negative costs Numba a branch, and the loop its vectors.
    decay, process_noise = decay[moving_count:], process_noise[moving_count:]
    decaying, behind = covariance[moving_count:, moving_count:], moved_rows[:, moving_count:]
    below, beside = covariance[moving_count:], covariance[:, moving_count:]
    for r in range(len(decay)):
        for c in range(len(decay)):
            decaying[r, c] *= decay[r] * decay[c]
        decaying[r, r] += process_noise[r]
    for r in range(moving_count):
        for c in range(len(decay)):
            beside[r, c] = behind[r, c] * decay[c]
            below[c, r] = beside[r, c]
        for c in range(r + 1):
            covariance[r, c] = covariance[c, r] = moved[r, c]


@compiled
def _update_sensitivities_over_step(integration: Integration, decay: Any, sensitivities: Any, buffers: Buffers) -> None:
    moving_count, moved = integration.transition.shape[1], buffers.moved_sensitivities
    assign_matrix(buffers.sensitivities_from, sensitivities)
    multiply(buffers.sensitivities_from, integration.transition, moved)
    for i in range(len(sensitivities)):
        for j in range(moving_count):
            sensitivities[i, j] = integration.direct[i, j] + moved[i, j]
        for j in range(moving_count, len(decay)):
            sensitivities[i, j] *= decay[j]
