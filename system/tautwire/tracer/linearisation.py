"""Linearised filter: how a small change of the robot would move every innovation of a recording.

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

from ..native.repeated import by_sample
from ..recordings.recording import Recording
from .likelihood import Likelihood

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LinearisedSegment:
    """Linearised filter segment: Linearised filter segment: K successive samples of a run.

    ``states`` (n, K + 1) as predicted and winch ``speeds`` (cables, K + 1), of the next sample too; ``step`` (K) and
    ``shift`` (m, K) in s. ``transition`` A (K, n, n), ``half_transition`` the same from half a step before the next
    sample, ``output_matrix`` C (K, m, n), ``gain`` K (K, n, m); ``whitening`` (K, m, m) makes innovations independent
    with unit variance and is zero where nothing was ``observed`` (K, m). ``is_recorded``, ``values`` and
    ``sensitivities`` as for FilterSegment, values and sensitivities zero where nothing was observed.
    """

    states: Array
    speeds: Array
    step: Array
    shift: Array
    transition: Array
    half_transition: Array
    output_matrix: Array
    gain: Array
    whitening: Array
    observed: NDArray[np.bool_]
    is_recorded: NDArray[np.bool_]
    values: Array
    sensitivities: Array

    def propagate_sensitivities(
        self, state_sensitivities: Array, state_forcing: Array, output_forcing: Array
    ) -> tuple[Array, Array]:
        """Sensitivities of the predicted state (n, p) after this segment, and of the whitened innovations (K, m, p).

        ``state_forcing`` is B (K, n, p), ``output_forcing`` D (K, m, p).
        """
        output_changes = np.empty_like(output_forcing)
        sensitivities = state_sensitivities
        for k in range(len(output_forcing)):
            output_changes[k] = self.output_matrix[k] @ sensitivities + output_forcing[k]
            sensitivities = self.transition[k] @ (sensitivities - self.gain[k] @ output_changes[k]) + state_forcing[k]
        return sensitivities, -(self.whitening @ output_changes)


def linearise_filter(
    likelihood: Likelihood, values: list[float], recording: Recording, acceleration_noise_density: float = 0.0
) -> Iterator[LinearisedSegment]:
    """Linearise a filter's run over a recording, segment by segment, at some values of its free parameters.

    With ``acceleration_noise_density`` (m/s^2 per root hertz) the run follows what was measured where the model does
    not.
    """
    theta = np.array(values, dtype=float)[:, None]
    noise = likelihood.noise
    variances = np.square(noise.of_outputs(likelihood.cable_count))
    for segment in likelihood.segments(recording, values, acceleration_noise_density):
        measured, observed, shift, speed, later, step, _ = segment.columns
        count = measured.shape[1]
        predicted = segment.states[:, :-1]
        is_observed = observed.T[:, :, None] > 0.0
        innovations = np.where(is_observed[:, :, 0], segment.values, 0.0)
        output_matrix = by_sample(
            likelihood.jacobians(count, predicted, predicted, theta, shift, speed, later, step)[0], count
        )
        cross_covariance = segment.covariances @ np.where(is_observed, output_matrix, 0.0).swapaxes(1, 2)
        covariance = np.where(is_observed, output_matrix, 0.0) @ cross_covariance + np.diag(variances)
        cholesky_factor = np.linalg.cholesky(covariance)
        whitening = np.where(is_observed, np.linalg.inv(cholesky_factor), 0.0)
        gain = cross_covariance @ np.linalg.inv(covariance)
        corrections = np.einsum("kij,kjl,kl->ki", gain, cholesky_factor, innovations)
        updated = predicted + corrections.T
        _, *jacobians = likelihood.jacobians(count, predicted, updated, theta, shift, speed, later, step)
        transition, half_transition = (by_sample(matrix, count) for matrix in jacobians)
        yield LinearisedSegment(
            segment.states,
            np.hstack([speed, later[:, -1:]]),
            step[0],
            shift,
            transition,
            half_transition,
            output_matrix,
            gain,
            whitening,
            is_observed[:, :, 0],
            segment.is_recorded,
            innovations,
            np.where(is_observed, segment.sensitivities, 0.0),
        )
