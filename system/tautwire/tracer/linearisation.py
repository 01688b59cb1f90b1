"""The filter's run over a recording, linearised: how a small change of the robot would move every innovation.

With the filter's gain held, slopes ``S`` of the predicted state by parameters follow

    dv = C S + D          S' = A (S - K dv) + B

where ``C`` and ``A`` are the derivatives of what sensors show and of the next state by the state, and ``D`` and ``B``
those by the parameters. All but ``D`` and ``B`` belong to the run, so that any number of parameters costs one run.

Source: Ljung (1999), System Identification, sec. 11.4; Anderson and Moore (1979), Optimal Filtering, ch. 5.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..native.repeated import stacked
from ..recordings.recording import Recording
from .likelihood import Likelihood

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Linearised:
    """K successive samples of a run.

    ``states`` (n, K + 1) as predicted and winch ``speeds`` (cables, K + 1), of the next sample too; ``step`` (K) and
    ``shift`` (m, K) in s. ``transition`` A (K, n, n), ``half`` the same from half a step before the next sample,
    ``sensing`` C (K, m, n), ``gain`` K (K, n, m); ``whitening`` (K, m, m) makes innovations independent with unit
    variance and is zero where nothing was ``seen`` (K, m). ``own``, ``values`` and ``slopes`` as for Stretch, values
    and slopes zero where nothing was seen.
    """

    states: Array
    speeds: Array
    step: Array
    shift: Array
    transition: Array
    half: Array
    sensing: Array
    gain: Array
    whitening: Array
    seen: NDArray[np.bool_]
    own: NDArray[np.bool_]
    values: Array
    slopes: Array

    def carry(self, state_slopes: Array, by_rates: Array, by_sensors: Array) -> tuple[Array, Array]:
        """Slopes of the predicted state (n, p) after this stretch, and of the whitened innovations (K, m, p).

        ``by_rates`` is B (K, n, p), ``by_sensors`` D (K, m, p).
        """
        moved = np.empty_like(by_sensors)
        slopes = state_slopes
        for k in range(len(by_sensors)):
            moved[k] = self.sensing[k] @ slopes + by_sensors[k]
            slopes = self.transition[k] @ (slopes - self.gain[k] @ moved[k]) + by_rates[k]
        return slopes, -(self.whitening @ moved)


def linearise_run(
    likelihood: Likelihood, values: list[float], recording: Recording, roughness: float = 0.0
) -> Iterator[Linearised]:
    """Each stretch of a filter's run over a recording, at some values of its free parameters.

    With ``roughness`` (m/s^2 per root hertz) the run follows what was measured where the model does not.
    """
    theta = np.array(values, dtype=float)[:, None]
    noise = likelihood.noise
    variances = np.square(noise.of_outputs(likelihood.cable_count))
    for stretch in likelihood.stretches(recording, values, roughness):
        measured, seen, shift, speed, later, step, _ = stretch.columns
        count = measured.shape[1]
        before = stretch.states[:, :-1]
        looked = seen.T[:, :, None] > 0.0
        innovations = np.where(looked[:, :, 0], stretch.values, 0.0)
        sensing = stacked(likelihood.slopes(count, before, before, theta, shift, speed, later, step)[0], count)
        spread = stretch.covariances @ np.where(looked, sensing, 0.0).swapaxes(1, 2)
        covariance = np.where(looked, sensing, 0.0) @ spread + np.diag(variances)
        root = np.linalg.cholesky(covariance)
        whitening = np.where(looked, np.linalg.inv(root), 0.0)
        gain = spread @ np.linalg.inv(covariance)
        moved = np.einsum("kij,kjl,kl->ki", gain, root, innovations)
        after = before + moved.T
        _, *ahead = likelihood.slopes(count, before, after, theta, shift, speed, later, step)
        transition, half = (stacked(matrix, count) for matrix in ahead)
        yield Linearised(
            stretch.states,
            np.hstack([speed, later[:, -1:]]),
            step[0],
            shift,
            transition,
            half,
            sensing,
            gain,
            whitening,
            looked[:, :, 0],
            stretch.own,
            innovations,
            np.where(looked, stretch.slopes, 0.0),
        )
