"""Sensitivities of the innovations to the logs of a disturbance's numbers: a Kalman filter's recursion differentiated.

With the linearisation ``C`` and ``T`` of outputs and steps held, covariance ``P`` of the predicted state, Cholesky
factor ``L`` of ``C P C' + R``, whitened innovations ``v``, ``W = L^-1 C`` and ``G = W P``, derivatives are

    M_j = W P_j W' + N_j                     N_j = L^-1 R_j L^-T
    v_j = -W x_j - Phi(M_j) v                l_j = diag M_j
    x_j+ = (I - G' W) (x_j + P_j W' v) - G' N_j v
    P_j+ = (I - G' W) P_j (I - G' W)' + G' N_j G

where ``l`` are the logs of the innovations' variances, and ``Phi`` takes the lower triangle with half of the diagonal.
Over a step

    x_j' = T x_j+ + T_j x+                   P_j' = T P_j+ T' + T_j P+ T' + T P+ T_j' + Q_j

With ``S_j = W P_j - M_j G / 2``, whose M_j is without N_j, the first product is ``P_j - G' S_j - S_j' G``; and of T
only the states that move have more than their own decay. So n states take n^2 operations for each number, not n^3.

Source: Gupta and Mehra (1974), IEEE Transactions on Automatic Control 19(6), 774-783; Särkkä (2013), Bayesian Filtering
and Smoothing, sec. 12.3 and appendix A.3.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..recordings.recording import Recording
from .disturbance import Disturbance
from .innovations import FilterSegment
from .likelihood import Likelihood
from .step_integration import compiled_with_arrays

Array = NDArray[np.float64]


class DisturbanceStates(NamedTuple):
    """By which of a disturbance's numbers each state of a filter moves, and the white noise of each output.

    Of the n states the first ``moving_count`` mix, the others only decay. ``rms_number`` is the index of the rms among
    the numbers, before that of the bandwidth, and -1 where a state has none; ``decay_rate`` (1/s) and ``variance`` are
    its own. Number 0 is the rms of the platform's force.
    ``white_number`` (m) is the index of each output's white noise, ``white_variance`` (m) its variance.
    """

    moving_count: int
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
    """Derivatives of the predicted ``state`` (n, k) and its ``covariance`` (n, k, n), changed in place."""

    state: Any
    covariance: Any


def disturbance_sensitivities(
    likelihood: Likelihood,
    disturbance: Disturbance,
    recording: Recording,
    parameters: Sequence[float] | Array,
    segments: Iterable[FilterSegment] = (),
) -> tuple[Array, Array]:
    """Derivatives of whitened innovations and of the logs of their variances by the logs of a disturbance's numbers.

    Both (N, m, k), of the N samples of a recording; where nothing was observed they mean nothing. The k numbers are rms
    and bandwidth of each process, then the white noise of each kind of sensor. The likelihood has to have a
    disturbance. The linearisation is held: where states move with the numbers, differences of whole runs are not quite
    these. ``segments`` are those of the filter's run where they are known; else it runs.

    Source: see the module.
    """
    likelihood = likelihood.with_disturbance(disturbance)
    _, covariance = likelihood.start(parameters)
    states = _disturbance_states(likelihood, disturbance, len(covariance))
    derivatives = _derivatives_at_start(states)
    number_count = derivatives.state.shape[1]
    parts = []
    for segment in segments or likelihood.segments(recording, parameters):
        run = _run_of(segment)
        by_number = np.empty((2, *run.values.shape, number_count))
        differentiate_recursion(run, states, derivatives, by_number)
        parts.append(by_number[:, segment.is_recorded])
    values, log_variances = np.concatenate(parts, axis=1)
    return values, log_variances


def _disturbance_states(likelihood: Likelihood, disturbance: Disturbance, size: int) -> DisturbanceStates:
    cables, turning = likelihood.cable_count, disturbance.rotation is not None
    kinds = np.repeat([0, 1, 2], [3, cables, 3 if turning else 0])
    numbers = np.append(np.zeros(6 if turning else 3, dtype=int), 2 + 2 * kinds)
    rates, variances = np.split(likelihood.disturbance_arguments[:, 0], 2)
    first, count = size - len(numbers), len(numbers)
    rms_number, decay_rate, variance = np.full(size, -1), np.zeros(size), np.zeros(size)
    rms_number[first:], decay_rate[first:], variance[first:] = numbers, rates[-count:], variances[-count:]
    first_white = int(numbers.max()) + 2
    white_variances, moving_count = disturbance.white_variances(cables), likelihood.moving_count
    return DisturbanceStates(moving_count, rms_number, decay_rate, variance, first_white + kinds, white_variances)


def _derivatives_at_start(disturbance: DisturbanceStates) -> Derivatives:
    size, number_count = len(disturbance.rms_number), 1 + int(disturbance.white_number.max())
    derivatives = Derivatives(np.zeros((size, number_count)), np.zeros((size, number_count, size)))
    for r in np.flatnonzero(disturbance.rms_number >= 0):
        derivatives.covariance[r, disturbance.rms_number[r], r] = 2.0 * disturbance.variance[r]
    return derivatives


def _run_of(segment: FilterSegment) -> Run:
    _, observed, _, _, _, _, step, *_ = segment.columns
    results = segment.results
    values = np.where(observed.T > 0.0, results.values, 0.0)
    rows = (results.states.T, observed.T, step[0])
    states, observed, steps = (np.ascontiguousarray(each) for each in rows)
    return Run(states, results.covariances, results.transitions, results.output_matrices, values, observed, steps)


@compiled_with_arrays
def differentiate_recursion(run: Run, disturbance: DisturbanceStates, derivatives: Derivatives, by_number: Any) -> None:
    """Differentiate a run's recursion; fills in ``by_number`` (2, K, m, k), see :func:`disturbance_sensitivities`."""
    size, number_count = derivatives.state.shape
    first = size - np.count_nonzero(disturbance.rms_number >= 0)
    for k in range(len(run.values)):
        innovations, transition = run.values[k], run.transitions[k]
        whitening, output, gain = _whitened(run, disturbance, k)
        moved_gain = np.dot(transition, gain.T)
        by_covariance = np.dot(derivatives.covariance.reshape((-1, size)), np.dot(innovations, output))
        cross_covariances = np.dot(output, derivatives.covariance.reshape((size, -1))).reshape((-1, size))
        variances = np.dot(cross_covariances, output.T)
        _subtract_gain(gain, cross_covariances - 0.5 * np.dot(variances, gain), derivatives.covariance)
        _move_covariances(transition, disturbance.moving_count, derivatives.covariance)
        _differentiate_innovations(
            innovations, whitening, np.dot(output, derivatives.state), variances, disturbance, by_number[:, k]
        )
        kept = derivatives.state + by_covariance.reshape((size, number_count))
        moved = np.dot(transition, kept - np.dot(gain.T, np.dot(output, kept)))
        for r in range(size):
            for j in range(number_count):
                derivatives.state[r, j] = moved[r, j]
        _add_white_noise(np.dot(moved_gain, whitening), np.dot(innovations, whitening), disturbance, derivatives)
        updated = run.states[k] + np.dot(innovations, gain)
        onward = np.dot(run.covariances[k, first:], transition.T)
        onward -= np.dot(np.ascontiguousarray(gain[:, first:].T), moved_gain.T)
        _add_processes(transition, updated, onward, run.steps[k], disturbance, derivatives)


@compiled_with_arrays
def _whitened(run: Run, disturbance: DisturbanceStates, k: int) -> Any:
    """``L^-1``, ``L^-1 C`` and ``L^-1 C P`` of sample k; an output that was not observed is noise of its own."""
    output = run.output_matrices[k].copy()
    count, size = output.shape
    for i in range(count):
        _scale_row(output, i, run.observed[k, i])
    gain, whitening = np.dot(output, run.covariances[k]), np.eye(count)
    variances = np.dot(gain, output.T)
    for i in range(count):
        for earlier in range(i):
            factor = variances[i, earlier]
            for c in range(i, count):
                variances[c, i] -= factor * variances[c, earlier]
            for c in range(size):
                output[i, c] -= factor * output[earlier, c]
                gain[i, c] -= factor * gain[earlier, c]
            for c in range(i):
                whitening[i, c] -= factor * whitening[earlier, c]
        deviation = np.sqrt(variances[i, i] + disturbance.white_variance[i])
        for c in range(i, count):
            variances[c, i] /= deviation
        _scale_row(output, i, 1.0 / deviation)
        _scale_row(gain, i, 1.0 / deviation)
        _scale_row(whitening, i, 1.0 / deviation)
    return whitening, output, gain


@compiled_with_arrays
def _scale_row(matrix: Any, row: int, factor: float) -> None:
    """Multiply a row; written as ``matrix[row] *= factor``, it takes Numba seconds to compile."""
    for c in range(matrix.shape[1]):
        matrix[row, c] *= factor


@compiled_with_arrays
def _differentiate_innovations(
    innovations: Any,
    whitening: Any,
    by_state: Any,
    variances: Any,
    disturbance: DisturbanceStates,
    by_number: Any,
) -> None:
    """Fill in ``by_number`` (2, m, k) of a sample; ``variances`` (m k, m) are ``W P_j W'``, to which it adds N_j."""
    count, number_count = by_state.shape
    by_covariance = variances.reshape((count, number_count, count))
    for i in range(count):
        for j in range(number_count):
            by_number[0, i, j] = -by_state[i, j]
        for c in range(i + 1):
            weight = 0.5 if c == i else 1.0
            for o in range(count):
                noise = 2.0 * disturbance.white_variance[o] * whitening[i, o] * whitening[c, o]
                by_covariance[i, disturbance.white_number[o], c] += noise
            for j in range(number_count):
                by_number[0, i, j] -= weight * by_covariance[i, j, c] * innovations[c]
        for j in range(number_count):
            by_number[1, i, j] = by_covariance[i, j, i]


@compiled_with_arrays
def _subtract_gain(gain: Any, shared: Any, covariance: Any) -> None:
    """Turn ``P_j`` into ``P_j - G' S_j - S_j' G``, by ``shared`` S (m k, n)."""
    size, number_count = covariance.shape[:2]
    products = np.dot(gain.T, shared.reshape((len(gain), -1))).reshape((size, number_count, size))
    for r in range(size):
        for j in range(number_count):
            for c in range(r + 1):
                covariance[r, j, c] -= products[r, j, c] + products[c, j, r]
                covariance[c, j, r] = covariance[r, j, c]


@compiled_with_arrays
def _move_covariances(transition: Any, moving_count: int, covariance: Any) -> None:
    """Turn symmetric ``P_j`` into ``T P_j T'``; only the first states mix."""
    size, number_count = covariance.shape[:2]
    by_state = np.ascontiguousarray(transition[:moving_count])
    moved = np.dot(by_state, covariance.reshape((size, -1))).reshape((-1, size))
    both = np.dot(moved, by_state.T).reshape((moving_count, number_count, moving_count))
    for r in range(moving_count, size):
        for j in range(number_count):
            for c in range(moving_count):
                covariance[r, j, c] = covariance[c, j, r] = moved[c * number_count + j, r] * transition[r, r]
            for c in range(moving_count, size):
                covariance[r, j, c] *= transition[r, r] * transition[c, c]
    for r in range(moving_count):
        for j in range(number_count):
            for c in range(moving_count):
                covariance[r, j, c] = both[r, j, c]


@compiled_with_arrays
def _add_white_noise(gain: Any, errors: Any, disturbance: DisturbanceStates, derivatives: Derivatives) -> None:
    """Add what white noise changes by the filter's ``gain`` (n, m), from ``errors`` (m) over their variances."""
    for i in range(len(errors)):
        number, noise = disturbance.white_number[i], 2.0 * disturbance.white_variance[i]
        for r in range(len(gain)):
            scaled = noise * gain[r, i]
            derivatives.state[r, number] -= scaled * errors[i]
            for c in range(len(gain)):
                derivatives.covariance[r, number, c] += scaled * gain[c, i]


@compiled_with_arrays
def _add_processes(
    transition: Any, state: Any, onward: Any, step: float, disturbance: DisturbanceStates, derivatives: Derivatives
) -> None:
    """Add what decay and size of the processes change in a step from an updated state.

    ``onward`` are the last rows of ``P+ T'``, those of the processes.
    """
    first = len(state) - len(onward)
    for i in range(first, len(state)):
        rms = disturbance.rms_number[i]
        exponent = disturbance.decay_rate[i] * step
        # A force's mean over a step has decayed half as far.
        slopes = -0.5 * exponent * transition[:, i] if rms == 0 else np.zeros(len(state))
        slopes[i] = -exponent * transition[i, i]
        for r in range(len(state)):
            if slopes[r] != 0.0:
                derivatives.state[r, rms + 1] += slopes[r] * state[i]
                for c in range(len(state)):
                    derivatives.covariance[r, rms + 1, c] += slopes[r] * onward[i - first, c]
                    derivatives.covariance[c, rms + 1, r] += slopes[r] * onward[i - first, c]
        decayed = np.exp(-2.0 * exponent)
        derivatives.covariance[i, rms, i] += 2.0 * disturbance.variance[i] * (1.0 - decayed)
        derivatives.covariance[i, rms + 1, i] += 2.0 * exponent * disturbance.variance[i] * decayed
