"""Linearisation of a filter's run, along which the sensitivities of its innovations to further parameters follow.

With the filter's gain held, sensitivities ``S`` of the predicted state to parameters follow

    dv = C S + D          S' = A (S - K dv) + B

where ``C`` and ``A`` are the derivatives of the outputs and of the next state by the state, and ``D`` and ``B``
those by the parameters. All but ``D`` and ``B`` belong to the run, so that any number of parameters costs one run.

Source: Ljung (1999), System Identification, sec. 11.4; Anderson and Moore (1979), Optimal Filtering, ch. 5.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..recordings.recording import Recording
from .likelihood import Likelihood

Array = NDArray[np.float64]

# Of the innovations' correlation matrix: less is rounding.
MIN_RELATIVE_EIGENVALUE = 1e-12


@dataclass(frozen=True)
class LinearisedSegment:
    """Linearised filter segment: K successive samples of a run.

    ``states`` (n, K + 1) as predicted, a run's first where its outputs are linearised; their unstrained lengths are the
    true ones where others were recorded; winch ``speeds`` (cables, K + 1), of the next sample too; ``step`` (K) and
    ``shift`` (m, K) in s; ``rotation`` (3, K) as measured, empty for a point mass. ``transition`` A
    (K, n, n), ``half_transition`` the same from half a step before the next sample, ``output_matrix`` C (K, m, n),
    ``gain`` K (K, n, m); ``whitening`` (K, m, m) makes innovations independent with unit variance and is zero where
    nothing was ``observed`` (K, m). ``transition``, ``output_matrix`` and ``gain`` have the states of a disturbance
    behind the model's n. ``is_recorded``, ``values`` and ``sensitivities`` as for FilterResults, values and
    sensitivities zero where nothing was observed.
    """

    states: Array
    speeds: Array
    step: Array
    shift: Array
    rotation: Array
    transition: Array
    half_transition: Array
    output_matrix: Array
    gain: Array
    whitening: Array
    observed: NDArray[np.bool_]
    is_recorded: NDArray[np.bool_]
    values: Array
    sensitivities: Array

    def integrated_forcing(self, rate_sensitivities: Array) -> Array:
        """State forcing B (K, n, p) by Simpson's rule from sensitivities of the rates (K + 1, n, p) at the samples."""
        begin, end = rate_sensitivities[:-1], rate_sensitivities[1:]
        transition = self.transition[:, : begin.shape[1], : begin.shape[1]]
        forcing: Array = (
            self.step[:, None, None] / 6.0 * (transition @ begin + 2.0 * self.half_transition @ (begin + end) + end)
        )
        return forcing

    def propagate_sensitivities(
        self, state_sensitivities: Array, state_forcing: Array, output_forcing: Array
    ) -> tuple[Array, Array]:
        """Sensitivities of the predicted state (n, p) after this segment, and of the whitened innovations (K, m, p).

        ``state_forcing`` is B (K, n, p), ``output_forcing`` D (K, m, p).
        """
        output_changes = np.empty_like(output_forcing)
        # Nothing acts on the states of a disturbance.
        forced = state_forcing.shape[1]
        sensitivities = np.pad(state_sensitivities, ((0, self.transition.shape[1] - len(state_sensitivities)), (0, 0)))
        for k in range(len(output_forcing)):
            output_changes[k] = self.output_matrix[k] @ sensitivities + output_forcing[k]
            sensitivities = self.transition[k] @ (sensitivities - self.gain[k] @ output_changes[k])
            sensitivities[:forced] += state_forcing[k]
        return sensitivities, -(self.whitening @ output_changes)


def linearise_filter(
    likelihood: Likelihood, values: list[float], recording: Recording, acceleration_noise_density: float = 0.0
) -> Iterator[LinearisedSegment]:
    """Linearise a filter's run over a recording, segment by segment, at some values of its free parameters.

    With ``acceleration_noise_density`` (m/s^2 per root hertz) the run follows what was measured where the model does
    not.
    """
    size = likelihood.model.states.numel()
    variances = likelihood.noise.white_variances(likelihood.cable_count)
    for segment in likelihood.segments(recording, values, acceleration_noise_density):
        _, observed, shift, speed, later, _, step, _, rotation = segment.columns
        results, predicted = segment.results, segment.results.states[:, :-1].copy()
        predicted[:, 0] += results.prior_offset
        is_observed = observed.T[:, :, None] > 0.0
        innovations = np.where(is_observed[:, :, 0], results.values, 0.0)
        output_matrix = results.output_matrices
        cross_covariance = results.covariances @ np.where(is_observed, output_matrix, 0.0).swapaxes(1, 2)
        covariance = np.where(is_observed, output_matrix, 0.0) @ cross_covariance + np.diag(variances)
        inverse_factor = np.linalg.inv(cholesky_factors(covariance))
        whitened_gain = cross_covariance @ inverse_factor.swapaxes(1, 2)
        corrections = (whitened_gain @ innovations[:, :, None])[:, :, 0]
        updated = likelihood.with_true_lengths(predicted + corrections.T)
        rate_jacobian = likelihood.rate_jacobians(values, updated, speed)
        yield LinearisedSegment(
            likelihood.with_true_lengths(results.states),
            np.hstack([speed, later[:, -1:]]),
            step[0],
            shift,
            rotation,
            results.transitions,
            _half_transition(results.transitions[:, :size, :size], rate_jacobian, step[0]),
            output_matrix,
            whitened_gain @ inverse_factor,
            np.where(is_observed, inverse_factor, 0.0),
            is_observed[:, :, 0],
            segment.is_recorded,
            innovations,
            np.where(is_observed, results.sensitivities, 0.0),
        )


def _half_transition(transition: Array, rate_jacobian: Array, step: Array) -> Array:
    """Transition from the middle of each step (K, n, n), from the cubic through both of its ends."""
    identity = np.eye(transition.shape[1])
    bend: Array = step[:, None, None] / 8.0 * (identity - transition) @ rate_jacobian
    return 0.5 * (transition + identity) + bend


def cholesky_factors(covariance: Array) -> Array:
    """Cholesky factors of covariances (K, m, m).

    Where rounding has left one not positive definite, its eigenvalues are raised; NaN where one is not finite.
    """
    try:
        return np.asarray(np.linalg.cholesky(covariance), dtype=float)
    except np.linalg.LinAlgError:
        is_finite = np.all(np.isfinite(covariance), axis=(1, 2), keepdims=True)
        deviations = np.sqrt(np.maximum(np.abs(np.diagonal(covariance, axis1=1, axis2=2)), np.finfo(float).tiny))
        scale = deviations[:, :, None] * deviations[:, None, :]
        eigenvalues, vectors = np.linalg.eigh(np.where(is_finite, covariance / scale, np.eye(covariance.shape[1])))
        raised = np.maximum(eigenvalues, MIN_RELATIVE_EIGENVALUE)[:, None, :]
        definite = np.where(is_finite, scale, 1.0) * ((vectors * raised) @ vectors.swapaxes(1, 2))
        return np.where(is_finite, np.asarray(np.linalg.cholesky(definite), dtype=float), np.nan)
