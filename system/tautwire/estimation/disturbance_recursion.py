"""Sensitivities of the innovations to the logs of a disturbance's numbers: a Kalman filter's recursion differentiated.

With the linearisation ``C`` and ``T`` of outputs and steps held, covariance ``P`` of the predicted state, Cholesky
factor ``L`` of ``C P C' + R``, whitened innovations ``v``, ``W = L^-1 C``, ``G = W P``, ``A = T (I - G' W)`` and
``K = T G' L^-1``, derivatives are

    M_j = W P_j W' + L^-1 R_j L^-T
    v_j = -W x_j - Phi(M_j) v                l_j = diag M_j
    x_j' = A (x_j + P_j W' v) - K R_j L^-T v + T_j x+
    P_j' = A P_j A' + K R_j K' + T_j P+ T' + T P+ T_j' + Q_j

where ``l`` are the logs of the innovations' variances, ``Phi`` takes the lower triangle with half of the diagonal, and
of the updated moments ``x+`` and ``P+`` the latter need not be known: ``P+ T' = P A'``. Most of the time goes into
products with the covariances of all numbers at once, which BLAS does several times as fast as loops.

Source: Gupta and Mehra (1974), IEEE Transactions on Automatic Control 19(6), 774-783; Särkkä (2013), Bayesian Filtering
and Smoothing, sec. 12.3 and appendix A.3.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from .step_integration import compiled, multiply

# Numba caches machine code by the content of this file alone, and what it calls of that module is in it.
STEP_INTEGRATION_SHA256 = "fd2f20ddf94da6c2b5cacbb45cb1e8c894f1859957ac1ab7eba2c754dc7c791a"


class DisturbanceStates(NamedTuple):
    """By which of a disturbance's numbers each state of a filter moves, and the white noise of each output.

    ``rms_number`` is the index of the rms among the numbers, before that of the bandwidth, and -1 where a state has
    none; ``decay_rate`` (1/s) and ``variance`` are its own. Number 0 is the rms of the platform's force.
    ``white_number`` (m) is the index of each output's white noise, ``white_variance`` (m) its variance.
    """

    rms_number: Any
    decay_rate: Any
    variance: Any
    white_number: Any
    white_variance: Any


class Run(NamedTuple):
    """Run of a filter over K samples, samples first: :class:`tautwire.estimation.compiled_filter.FilterResults`."""

    states: Any
    covariances: Any
    transitions: Any
    output_matrices: Any
    values: Any
    observed: Any
    steps: Any


class Derivatives(NamedTuple):
    """Derivatives of the predicted ``state`` (k, n) and its ``covariance`` (n, k n), changed in place."""

    state: Any
    covariance: Any


class Buffers(NamedTuple):
    """Buffers of a run, written anew for each sample; C, W, G, L, A and K are those of the module.

    ``output`` and ``whitened`` (m, n) are C without what is not observed, and W; ``by_state`` (n, m) the one's
    transpose, then the other's; ``variances`` and ``whitening`` (m, m) C P C' and L^-1; ``gain`` and ``moved_gain``
    (n, m) G' and T G'; ``noise_gain`` (n, m) is K. ``onward`` (n, n) is A', ``factors`` (n, n + m) has A and K,
    ``processes`` (d, n) the last rows of ``P+ T'``.
    ``kept`` (k, n) are x_j + P_j W' v, ``outputs`` (k, m) W x_j, ``crossed`` (m, k n) W P_j, and
    ``crossed_variances`` (m k, m) W P_j W'; ``moved`` (n + m, k n) has P_j A', then R_j K'. Names that end in ``rows``
    are the first n rows or all of the others, (rows k, n).
    """

    output: Any
    whitened: Any
    by_state: Any
    variances: Any
    whitening: Any
    gain: Any
    moved_gain: Any
    noise_gain: Any
    onward: Any
    factors: Any
    processes: Any
    kept: Any
    outputs: Any
    crossed: Any
    crossed_rows: Any
    crossed_variances: Any
    moved: Any
    moved_rows: Any
    covariance_rows: Any


def recursion_buffers(disturbance: DisturbanceStates, derivatives: Derivatives) -> Buffers:
    """Buffers for a disturbance's states and numbers."""
    (k, n), m = derivatives.state.shape, len(disturbance.white_number)
    d = np.count_nonzero(disturbance.rms_number >= 0)
    shapes = [*[(m, n)] * 2, (n, m), *[(m, m)] * 2, *[(n, m)] * 3, (n, n), (n, n + m), (d, n), (k, n), (k, m)]
    crossed, moved = np.empty((m, k * n)), np.zeros((n + m, k * n))
    arrays = [*map(np.empty, shapes), crossed, crossed.reshape((m * k, n)), np.empty((m * k, m))]
    arrays += [moved, moved[:n].reshape((n * k, n)), derivatives.covariance.reshape((n * k, n))]
    return Buffers(*arrays)


@compiled
def differentiate_recursion(
    run: Run, disturbance: DisturbanceStates, derivatives: Derivatives, by_number: Any, buffers: Buffers
) -> None:
    """Differentiate a run's recursion; fills in ``by_number`` (2, K, m, k), see :func:`disturbance_sensitivities`."""
    size = derivatives.state.shape[1]
    first = size - len(buffers.processes)
    for k in range(len(run.values)):
        _set_gains(run, disturbance, buffers, k)
        multiply(buffers.whitened, derivatives.covariance, buffers.crossed)
        multiply(buffers.crossed_rows, buffers.by_state, buffers.crossed_variances)
        multiply(derivatives.state, buffers.by_state, buffers.outputs)
        _differentiate_innovations(run.values[k], disturbance, buffers, by_number[:, k])
        for j in range(len(buffers.kept)):
            for c in range(size):
                buffers.kept[j, c] = derivatives.state[j, c]
            for i in range(len(buffers.crossed)):
                for c in range(size):
                    buffers.kept[j, c] += run.values[k, i] * buffers.crossed[i, j * size + c]
        multiply(buffers.kept, buffers.onward, derivatives.state)
        multiply(buffers.covariance_rows, buffers.onward, buffers.moved_rows)
        _add_white_noise(run.values[k], disturbance, derivatives, buffers)
        multiply(buffers.factors, buffers.moved, derivatives.covariance)
        multiply(run.covariances[k, first:], buffers.onward, buffers.processes)
        for i in range(first, size):
            _add_process(run, k, i, disturbance, derivatives, buffers)


@compiled
def _set_gains(run: Run, disturbance: DisturbanceStates, buffers: Buffers, k: int) -> None:
    """Fill in what does not depend on the numbers; an output that was not observed is noise of its own."""
    output, by_state, onward = buffers.output, buffers.by_state, buffers.onward
    count, size = output.shape
    for i in range(count):
        for c in range(size):
            output[i, c] = run.observed[k, i] * run.output_matrices[k, i, c]
            by_state[c, i] = output[i, c]
    multiply(run.covariances[k], by_state, buffers.gain)
    multiply(output, buffers.gain, buffers.variances)
    _whiten(disturbance, buffers.variances, buffers.whitening)
    multiply(buffers.whitening, output, buffers.whitened)
    for i in range(count):
        for c in range(size):
            by_state[c, i] = buffers.whitened[i, c]
    multiply(run.covariances[k], by_state, buffers.gain)
    multiply(run.transitions[k], buffers.gain, buffers.moved_gain)
    multiply(buffers.moved_gain, buffers.whitening, buffers.noise_gain)
    multiply(buffers.moved_gain, buffers.whitened, onward)
    for r in range(size):
        for c in range(size):
            buffers.factors[r, c] = run.transitions[k, r, c] - onward[r, c]
        for i in range(count):
            buffers.factors[r, size + i] = buffers.noise_gain[r, i]
    for r in range(size):
        for c in range(size):
            onward[r, c] = buffers.factors[c, r]


@compiled
def _whiten(disturbance: DisturbanceStates, variances: Any, whitening: Any) -> None:
    """Set ``L^-1`` by elimination in ``variances``, which are without white noise."""
    count = len(whitening)
    for i in range(count):
        for c in range(count):
            whitening[i, c] = 1.0 if c == i else 0.0
    for i in range(count):
        deviation = np.sqrt(variances[i, i] + disturbance.white_variance[i])
        for c in range(i + 1):
            whitening[i, c] /= deviation
        for later in range(i + 1, count):
            factor = variances[later, i] / deviation
            for c in range(i + 1):
                whitening[later, c] -= factor * whitening[i, c]
            for c in range(i + 1, count):
                variances[later, c] -= factor / deviation * variances[i, c]


@compiled
def _differentiate_innovations(
    innovations: Any, disturbance: DisturbanceStates, buffers: Buffers, by_number: Any
) -> None:
    """Fill in ``by_number`` (2, m, k) of a sample."""
    whitening, variances = buffers.whitening, buffers.crossed_variances
    number_count, count = buffers.outputs.shape
    for i in range(count):
        for j in range(number_count):
            by_number[0, i, j] = -buffers.outputs[j, i]
        for c in range(i + 1):
            weight = 0.5 if c == i else 1.0
            for o in range(c + 1):
                noise = 2.0 * disturbance.white_variance[o] * whitening[i, o] * whitening[c, o]
                variances[i * number_count + disturbance.white_number[o], c] += noise
            for j in range(number_count):
                by_number[0, i, j] -= weight * variances[i * number_count + j, c] * innovations[c]
        for j in range(number_count):
            by_number[1, i, j] = variances[i * number_count + j, i]


@compiled
def _add_white_noise(
    innovations: Any, disturbance: DisturbanceStates, derivatives: Derivatives, buffers: Buffers
) -> None:
    """Add what white noise changes in the state by the filter's gain, and set what it changes in the covariance."""
    count, size = buffers.whitened.shape
    for i in range(count):
        number, noise, error = disturbance.white_number[i], 2.0 * disturbance.white_variance[i], 0.0
        for o in range(i, count):
            error += innovations[o] * buffers.whitening[o, i]
        for r in range(size):
            scaled = noise * buffers.noise_gain[r, i]
            derivatives.state[number, r] -= scaled * error
            buffers.moved[size + i, number * size + r] = scaled


@compiled
def _add_process(
    run: Run, k: int, i: int, disturbance: DisturbanceStates, derivatives: Derivatives, buffers: Buffers
) -> None:
    """Add what decay and size of the process in state i change in the step from sample k."""
    transition, rms, covariance = run.transitions[k], disturbance.rms_number[i], derivatives.covariance
    size = len(transition)
    process, bandwidth = i - size + len(buffers.processes), (rms + 1) * size
    exponent = disturbance.decay_rate[i] * run.steps[k]
    updated = run.states[k, i]
    for o in range(len(buffers.whitened)):
        updated += buffers.gain[i, o] * run.values[k, o]
    for r in range(size):
        # A force's mean over a step has decayed half as far.
        slope = -exponent * transition[r, i] if r == i else -0.5 * exponent * transition[r, i]
        if slope != 0.0 and (r == i or rms == 0):
            derivatives.state[rms + 1, r] += slope * updated
            for c in range(size):
                change = slope * buffers.processes[process, c]
                covariance[r, bandwidth + c] += change
                covariance[c, bandwidth + r] += change
    decayed = np.exp(-2.0 * exponent)
    covariance[i, rms * size + i] += 2.0 * disturbance.variance[i] * (1.0 - decayed)
    covariance[i, bandwidth + i] += 2.0 * exponent * disturbance.variance[i] * decayed
