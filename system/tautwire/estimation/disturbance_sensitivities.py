"""Sensitivities of the innovations to the logs of a disturbance's numbers, by the filter's recursion differentiated."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from ..recordings.recording import Recording
from .disturbance import Disturbance
from .disturbance_recursion import Derivatives, DisturbanceStates, Run, differentiate_recursion, recursion_buffers
from .innovations import FilterSegment
from .likelihood import Likelihood

Array = NDArray[np.float64]


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

    Source: see :mod:`tautwire.estimation.disturbance_recursion`.
    """
    likelihood = likelihood.with_disturbance(disturbance)
    _, covariance = likelihood.start(parameters)
    states = _disturbance_states(likelihood, disturbance, len(covariance))
    derivatives = _derivatives_at_start(states)
    number_count = len(derivatives.state)
    parts = []
    for segment in segments or likelihood.segments(recording, parameters):
        run = _run_of(segment)
        by_number = np.empty((2, *run.values.shape, number_count))
        differentiate_recursion(run, states, derivatives, by_number, recursion_buffers(states, derivatives))
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
    white_variances = disturbance.white_variances(cables)
    return DisturbanceStates(rms_number, decay_rate, variance, first_white + kinds, white_variances)


def _derivatives_at_start(disturbance: DisturbanceStates) -> Derivatives:
    size, number_count = len(disturbance.rms_number), 1 + int(disturbance.white_number.max())
    derivatives = Derivatives(np.zeros((number_count, size)), np.zeros((size, number_count * size)))
    for r in np.flatnonzero(disturbance.rms_number >= 0):
        derivatives.covariance[r, disturbance.rms_number[r] * size + r] = 2.0 * disturbance.variance[r]
    return derivatives


def _run_of(segment: FilterSegment) -> Run:
    _, observed, _, _, _, _, step, *_ = segment.columns
    results = segment.results
    values = np.where(observed.T > 0.0, results.values, 0.0)
    rows = (results.states.T, observed.T, step[0])
    states, observed, steps = (np.ascontiguousarray(each) for each in rows)
    return Run(states, results.covariances, results.transitions, results.output_matrices, values, observed, steps)
